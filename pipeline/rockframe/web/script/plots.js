// Four plots over one time axis, with common zoom and cursor.
// Rotations are drawn up to this multiple of the slenderness: the fall would flatten the rest.
const DRAWN_TO = 1.3;
const VISIBLE = 0.005;
const MARGIN = 3;
// In print: width on A4 beside the frame [px], and height relative to the screen.
const SHEET_WIDTH = 450;
const SHEET_HEIGHT = 0.72;

const colour = (name) => () =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const ratios = (values, structure) => Array.from(values, (value) =>
  (Number.isNaN(value) ? null : value / balanceAt(structure, value)));
const scaled = (values, factor) =>
  Array.from(values, (value) => (Number.isNaN(value) ? null : value * factor));

// A direction in degrees; the line is broken where it passes 180 degrees.
const turned = (values) => {
  const degrees = scaled(values, 180 / Math.PI);
  return degrees.map((value, i) =>
    (i > 0 && value !== null && Math.abs(value - (degrees[i - 1] ?? value)) > 180 ? null : value));
};

// The envelope of an ensemble, to be drawn beside theta/alpha; empty without an ensemble.
const enveloped = (values, structure, time) => (values?.length ? ratios(values, structure)
  .map((value) => (value === null ? null : Math.max(-3, Math.min(3, value))))
  : new Array(time.length).fill(null));

function largest(values, among = () => true) {
  let found = 0;
  values.forEach((value, i) => {
    if (value !== null && among(i)) found = Math.max(found, Math.abs(value));
  });
  return found;
}

function motionWindow(motion, ratio) {
  const moving = (value) => value !== null && Math.abs(value) > VISIBLE;
  const first = ratio.findIndex(moving);
  const end = motion.time[motion.time.length - 1];
  if (first < 0) return [0, end];
  const last = motion.time[ratio.findLastIndex(moving)];
  return [Math.max(0, motion.time[first] - MARGIN), Math.min(end, last + MARGIN)];
}

function panels(motion) {
  const ratio = ratios(motion.theta, motion.structure);
  const standing = (i) => ratio[i] !== null && Math.abs(ratio[i]) <= DRAWN_TO;
  const acceleration = scaled(motion.acceleration, 1 / motion.gravity);
  const pulse = scaled(motion.pulse, 1 / motion.gravity);
  const u = scaled(motion.u, 100);
  const v = scaled(motion.v, 100);
  const even = (limit) => [-1.08 * limit || -1, 1.08 * limit || 1];
  const low = enveloped(motion.low, motion.structure, motion.time);
  const high = enveloped(motion.high, motion.structure, motion.time);
  const reach = Math.max(largest(ratio), largest(low), largest(high));
  const tilt = Math.max(0.02, Math.min(reach, DRAWN_TO));
  const lift = largest(v, standing) || 0.01;
  return {
    ratio,
    list: [
      { id: "ground", series: [[acceleration, "ground", 1], [pulse, "pulse", 2]],
        range: even(Math.max(largest(acceleration), largest(pulse))), height: 130 },
      { id: "ratio", series: [[ratio, "line", 1.4], [low, "band", 0], [high, "band", 0]],
        bands: [{ series: [3, 2], fill: colour("band") }], range: even(tilt), height: 150, limit: 1 },
      ...(motion.phi ? [{ id: "phi", series: [[turned(motion.phi), "line", 1.2]], range: [-190, 190], height: 110 }] : []),
      { id: "u", series: [[u, "line", 1.4]], range: even(largest(u, standing)), height: 120 },
      { id: "v", series: [[v, "line", 1.4]], range: [-0.08 * lift, 1.08 * lift], height: 150,
        axis: true },
    ],
  };
}

function linkedPlots(motion, onCursor) {
  let { ratio, list } = panels(motion);
  const plots = [];
  let point = 0;

  function place() {
    for (const plot of plots) {
      const left = plot.valToPos(motion.time[point], "x");
      const inside = left >= 0 && left <= plot.over.clientWidth;
      plot.setCursor({ left: inside ? left : -10, top: inside ? 0 : -10 }, false);
    }
  }

  function options(panel, number, width) {
    const axis = { stroke: colour("ink-soft"), font: "12px system-ui, sans-serif" };
    const grid = { stroke: colour("grid"), width: 1 };
    const ticks = { stroke: colour("grid"), width: 1, size: 4 };
    return {
      width, height: panel.height, legend: { show: false }, padding: [6, 10, panel.axis ? 0 : 6, 0],
      scales: { x: { time: false }, y: { range: () => list[number].range } },
      axes: [
        { ...axis, grid, ticks, size: panel.axis ? 30 : 0,
          values: panel.axis ? undefined : (_, splits) => splits.map(() => null) },
        { ...axis, grid, ticks, size: 52, space: 26 },
      ],
      bands: panel.bands ?? [],
      series: [{}, ...panel.series.map(([, name, thick]) =>
        ({ stroke: colour(name), width: thick, points: { show: false } }))],
      cursor: { y: false, drag: { x: true, y: false }, points: { size: 6 } },
      hooks: {
        setCursor: [(plot) => {
          if (plot.cursor.left < 0) queueMicrotask(place);
          else if (plot.cursor.idx !== null) onCursor(plot.cursor.idx);
        }],
        setScale: [(plot, key) => {
          if (key !== "x") return;
          const { min, max } = plot.scales.x;
          Object.assign(document.getElementById("graphs").dataset, { from: min, to: max });
          for (const other of plots) {
            const there = other.scales.x;
            if (there.min !== min || there.max !== max) other.setScale("x", { min, max });
          }
          queueMicrotask(place);
        }],
        draw: [(plot) => { if (panel.limit) drawLimits(plot, panel.limit); }],
      },
    };
  }

  const dataOf = (panel) => [motion.time, ...panel.series.map(([values]) => values)];
  list.forEach((panel, number) => {
    const host = document.getElementById(`plot-${panel.id}`);
    host.replaceChildren();
    host.plot = new uPlot(options(panel, number, host.clientWidth), dataOf(panel), host);
    plots.push(host.plot);
  });
  let printing = false;
  function fit() {
    plots.forEach((plot, number) => {
      const width = printing ? SHEET_WIDTH : plot.root.parentElement.clientWidth;
      const height = (printing ? SHEET_HEIGHT : 1) * list[number].height;
      if (width > 0 && (width !== plot.width || height !== plot.height)) plot.setSize({ width, height });
    });
    queueMicrotask(place);
  }
  function print(begins) {
    printing = begins;
    fit();
    plots.forEach((plot) => plot.redraw(false));
  }
  const observer = new ResizeObserver(fit);
  observer.observe(document.getElementById("graphs"));

  const end = () => motion.time[motion.time.length - 1];
  let fitted = [0, 0];
  function show([from, to]) {
    const min = Math.max(0, from);
    const max = Math.max(min + 10 * motion.step, Math.min(end(), to));
    plots[0].setScale("x", { min, max });
    return [min, max];
  }
  function zoom(factor) {
    const { min, max } = plots[0].scales.x;
    const here = motion.time[point];
    const centre = here >= min && here <= max ? here : (min + max) / 2;
    show([centre - (centre - min) * factor, centre + (max - centre) * factor]);
  }
  // Show another response to the same motion, with the same zoom; a window that was fitted to the
  // rocking, and not chosen, is fitted again if the rocking begins or ends elsewhere.
  function update(other) {
    motion = other;
    ({ ratio, list } = panels(motion));
    point = Math.min(point, motion.time.length - 1);
    plots.forEach((plot, number) => {
      const { min, max } = plot.scales.x;
      plot.batch(() => {
        plot.setData(dataOf(list[number]), false);
        plot.setScale("x", { min, max });
      });
    });
    const { min, max } = plots[0].scales.x;
    const [from, to] = motionWindow(motion, ratio);
    const moved = Math.abs(from - min) + Math.abs(to - max) > 0.1 * (to - from);
    if (min === fitted[0] && max === fitted[1] && moved) showRocking();
  }
  function showRocking() {
    fitted = show(motionWindow(motion, ratio));
  }
  showRocking();
  return {
    show, showRocking, zoom, update, print,
    all: () => show([0, end()]),
    window: () => [plots[0].scales.x.min, plots[0].scales.x.max],
    move: (index) => { point = index; place(); },
    redraw: () => plots.forEach((plot) => plot.redraw(false)),
    destroy: () => { observer.disconnect(); plots.forEach((plot) => plot.destroy()); },
  };
}

function drawLimits(plot, limit) {
  const { ctx } = plot;
  ctx.save();
  ctx.beginPath();
  for (const value of [-limit, limit]) {
    const y = plot.valToPos(value, "y", true);
    if (y < plot.bbox.top || y > plot.bbox.top + plot.bbox.height) continue;
    ctx.moveTo(plot.bbox.left, y);
    ctx.lineTo(plot.bbox.left + plot.bbox.width, y);
  }
  ctx.strokeStyle = colour("fall")();
  ctx.setLineDash([6, 5]);
  ctx.lineWidth = devicePixelRatio;
  ctx.stroke();
  ctx.restore();
}
