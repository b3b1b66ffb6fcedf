// Draws the frame to scale. Columns turn about a base corner, and the beam lies on the diagonally
// opposite corner, so that u and v in the drawing follow from theta alone.
const SVG = "http://www.w3.org/2000/svg";

function drawn(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

// Displacement [right, up] of the contact with the beam when a column turns by theta.
function moved(height, across, theta) {
  const side = theta < 0 ? -1 : 1;
  const angle = Math.abs(theta);
  // Vectors from the corner that stays to the opposite upper one, before and after the turn.
  const x = -across * Math.cos(angle) + height * Math.sin(angle);
  const y = across * Math.sin(angle) + height * Math.cos(angle);
  return [side * (x + across), y - height];
}

// Rotation at which a structure balances, on the side of a rotation; of equal columns the slenderness.
function balanceAt(structure, theta) {
  return structure.balance ? structure.balance[theta < 0 ? 1 : 0] : structure.slenderness;
}

// What that rotation is called.
function balanceName(structure) {
  return structure.balance ? "rotation of balance" : "slenderness";
}

// A vector [right, up] turned clockwise.
function turnedBy(angle, [x, y]) {
  const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
  return [x * cosine + y * sine, y * cosine - x * sine];
}

function clockwise(from, to) {
  return Math.atan2(from[1] * to[0] - from[0] * to[1], from[0] * to[0] + from[1] * to[1]);
}

// Two columns that differ, when the left one turns by theta: the rotations of the right one and of
// the beam, and the displacement [right, up] of the corner of the left one that carries the beam. The
// beam keeps the distance of both corners, so the right one is where two circles meet.
function linkagePose(structure, theta) {
  const { heights, widths, spacing } = structure;
  const side = theta < 0 ? -1 : 1;
  const arms = [0, 1].map((i) => [-side * widths[i], heights[i]]);
  const pivots = [0, 1].map((i) => [i * spacing + side * widths[i] / 2, -heights[i]]);
  const corners = [0, 1].map((i) => [pivots[i][0] + arms[i][0], 0]);
  const span = [corners[1][0] - corners[0][0], 0];
  const arm = turnedBy(theta, arms[0]);
  const first = [pivots[0][0] + arm[0], pivots[0][1] + arm[1]];
  const line = [pivots[1][0] - first[0], pivots[1][1] - first[1]];
  const length = Math.hypot(...line);
  const along = (span[0] ** 2 - arms[1][0] ** 2 - arms[1][1] ** 2 + length ** 2) / (2 * length);
  const across = Math.sqrt(Math.max(0, span[0] ** 2 - along ** 2));
  const beam = [(along * line[0] - across * line[1]) / length, (along * line[1] + across * line[0]) / length];
  const second = [beam[0] - line[0], beam[1] - line[1]];
  return {
    thetas: [theta, clockwise(arms[1], second)],
    turn: clockwise(span, beam),
    corner: corners[0],
    moved: [first[0] - corners[0][0], first[1]],
    side,
  };
}

// The same as `rockingFrame` for two columns that differ: with level tops, on two levels of ground.
function linkageFrame(host, structure, lean) {
  const { heights, widths, spacing, mass_ratio: mass } = structure;
  const tall = Math.max(...heights);
  const depth = structure.beam_depth || (tall * mass) / (8 + 2 * mass) + 0.05 * tall;
  const wide = Math.max(...widths);
  const room = wide + Math.max(0.3, 1.08 * Math.sin(Math.min(1.4 * lean, Math.PI / 2))) * tall;
  const [left, right] = [-room, spacing + room];
  const top = Math.max(...heights.map((height, i) => Math.hypot(height, widths[i]) - height)) + depth + 0.08 * tall;
  const svg = drawn("svg", {
    viewBox: `${left} ${-top} ${right - left} ${top + 1.24 * tall}`,
    role: "img", "aria-labelledby": "frame-caption", class: "frame",
  }, host);
  const middle = spacing / 2;
  for (const [x, width, height] of [[left, middle - left, heights[0]], [middle, right - middle, heights[1]]]) {
    drawn("rect", { x, y: height, width, height: 0.03 * tall, class: "soil" }, svg);
  }
  const outlines = heights.map((height, i) => ({
    x: i * spacing - widths[i] / 2, y: 0, width: widths[i], height,
  }));
  const beam = { x: -wide, y: -depth, width: spacing + 2 * wide, height: depth };
  for (const outline of [...outlines, beam]) drawn("rect", { ...outline, class: "rest" }, svg);
  const columns = outlines.map((outline) => drawn("rect", { ...outline, class: "column" }, svg));
  const cap = drawn("rect", { ...beam, class: "beam" }, svg);
  const arrow = drawn("path", { class: "push" }, svg);
  const level = 1.14 * tall;
  const degrees = (angle) => (angle * 180) / Math.PI;

  function pose(theta, push) {
    const { thetas, turn, corner, moved: [x, up], side } = linkagePose(structure, theta);
    columns.forEach((column, i) => {
      const pivot = `${i * spacing + (side * widths[i]) / 2} ${heights[i]}`;
      column.setAttribute("transform", `rotate(${degrees(thetas[i])} ${pivot})`);
    });
    cap.setAttribute("transform", `translate(${x} ${-up}) rotate(${degrees(turn)} ${corner[0]} 0)`);
    const centre = [middle + (structure.beam_offset || 0) - corner[0], (structure.beam_depth || 0) / 2];
    const place = turnedBy(turn, centre);
    svg.dataset.right = x + place[0] - centre[0];
    svg.dataset.up = up + place[1] - centre[1];
    svg.dataset.turn = turn;
    const length = 0.45 * (right - left) * push;
    const head = Math.sign(push) * Math.min(0.06 * tall, Math.abs(length));
    arrow.setAttribute("d", `M${middle} ${level}h${length}m${-head} ${-0.6 * Math.abs(head)}l${head} ` +
      `${0.6 * Math.abs(head)}l${-head} ${0.6 * Math.abs(head)}`);
  }
  return pose;
}

// Leaves room for this rotation [rad].
function rockingFrame(host, structure, lean) {
  if (structure.heights) return linkageFrame(host, structure, lean);
  const { height, width, mass_ratio: mass } = structure;
  const seat = structure.top_contact_width ?? width;
  const outline = (x) => `${x - width / 2},0 ${x + width / 2},0 ` +
    `${x + seat / 2},${-height} ${x - seat / 2},${-height}`;
  const single = mass === 0;
  const spacing = single ? 0 : Math.max(1.25 * height, 2.5 * width);
  const depth = single ? 0 : (height * mass) / (8 + 2 * mass) + 0.05 * height;
  const reach = spacing / 2 + width + Math.max(0.3, 1.08 * Math.sin(Math.min(lean, Math.PI / 2))) * height;
  const top = Math.max(height, Math.hypot(height, width)) + depth + 0.08 * height;
  const below = 0.24 * height;
  const svg = drawn("svg", {
    viewBox: `${-reach} ${-top} ${2 * reach} ${top + below}`,
    role: "img", "aria-labelledby": "frame-caption", class: "frame",
  }, host);
  const places = single ? [0] : [-spacing / 2, spacing / 2];
  const beam = { width: spacing + 2 * width, height: depth, x: -spacing / 2 - width };
  drawn("rect", { x: -reach, y: 0, width: 2 * reach, height: 0.03 * height, class: "soil" }, svg);
  for (const x of places) {
    drawn("polygon", { points: outline(x), class: "rest" }, svg);
  }
  if (!single) drawn("rect", { ...beam, y: -height - depth, class: "rest" }, svg);
  const columns = places.map(() =>
    drawn("polygon", { points: outline(0), class: "column" }, svg));
  const cap = single ? null : drawn("rect", { ...beam, y: -height - depth, class: "beam" }, svg);
  const arrow = drawn("path", { class: "push" }, svg);
  const level = 0.14 * height;

  function pose(theta, push) {
    const side = theta < 0 ? -1 : 1;
    const degrees = (theta * 180) / Math.PI;
    columns.forEach((column, i) => {
      const pivot = `${(side * width) / 2} 0`;
      column.setAttribute("transform", `translate(${places[i]} 0) rotate(${degrees} ${pivot})`);
    });
    const [right, up] = moved(height, (width + seat) / 2, theta);
    if (cap) cap.setAttribute("transform", `translate(${right} ${-up})`);
    svg.dataset.right = right;
    svg.dataset.up = up;
    const length = 0.9 * reach * push;
    const head = Math.sign(push) * Math.min(0.06 * height, Math.abs(length));
    arrow.setAttribute("d", `M0 ${level}H${length}m${-head} ${-0.6 * Math.abs(head)}l${head} ` +
      `${0.6 * Math.abs(head)}l${-head} ${0.6 * Math.abs(head)}`);
  }
  return pose;
}
