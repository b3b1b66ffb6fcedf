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

// Leaves room for this rotation [rad].
function rockingFrame(host, structure, lean) {
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
