// The player: frame, plots and readout at one time. A motion has arrays of equal length: time [s],
// acceleration and pulse [m/s2], theta [rad], u and v [m], NaN where undefined; and step [s],
// gravity [m/s2], peak of theta/alpha, and the structure with its dimensions.
class Player {
  constructor() {
    this.index = 0;
    this.motion = null;
    this.playing = 0;
    this.connect();
  }

  connect() {
    at("play").addEventListener("click", () => this.toggle());
    at("scrub").addEventListener("input", (event) => this.move(Number(event.target.value)));
    at("exaggeration").addEventListener("change", () => {
      this.stand();
      this.move(this.index);
    });
    at("zoom-in").addEventListener("click", () => this.plots.zoom(0.5));
    at("zoom-out").addEventListener("click", () => this.plots.zoom(2));
    at("zoom-all").addEventListener("click", () => this.plots.all());
    at("zoom-motion").addEventListener("click", () => this.plots.showRocking());
    at("graphs").addEventListener("keydown", (event) => this.key(event));
    const redraw = () => this.plots?.redraw();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    for (const [name, printing] of [["beforeprint", true], ["afterprint", false]]) {
      addEventListener(name, () => {
        document.documentElement.classList.toggle("printing", printing);
        this.plots?.print(printing);
      });
    }
  }

  key(event) {
    if (event.target !== event.currentTarget || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = (side) => (event.shiftKey ? this.seek(this.motion.time[this.index] + 0.5 * side)
      : this.move(this.index + side));
    const actions = {
      ArrowLeft: () => step(-1),
      ArrowRight: () => step(1),
      "+": () => this.plots.zoom(0.5),
      "-": () => this.plots.zoom(2),
      0: () => this.plots.all(),
      " ": () => this.toggle(),
    };
    if (!(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }

  // Show another motion, at its largest rotation.
  show(motion) {
    this.stop();
    this.take(motion);
    this.plots?.destroy();
    this.plots = linkedPlots(motion, (index) => { if (!this.playing) this.move(index); });
    this.move(this.telling());
  }

  // Show another response to the same motion; time and zoom stay.
  update(motion) {
    const now = this.motion.time[this.index];
    this.take(motion);
    this.plots.update(motion);
    this.seek(now);
  }

  take(motion) {
    this.motion = motion;
    at("band-key").hidden = !motion.low?.length;
    at("phi").hidden = !motion.phi;
    at("phi-value").hidden = !motion.phi;
    this.largest = motion.acceleration.reduce((most, a) => Math.max(most, Math.abs(a)), 0);
    // The history of a structure that overturns ends early; then show its last rotation.
    const ended = motion.theta.findIndex(Number.isNaN);
    this.last = ended < 0 ? motion.theta.length - 1 : Math.max(0, ended - 1);
    at("scrub").max = motion.time.length - 1;
    this.stand();
  }

  describe(title, line) {
    const kind = drawnWords(this.motion.structure);
    at("frame-caption").textContent = this.motion.pair?.path
      ? `${kind}, in the vertical plane of their tilt, which turns; dotted the place at rest; the arrow is ` +
        "the length of the ground acceleration."
      : `${kind}; dotted the place at rest; the arrow is the ground acceleration. Right is positive.`;
    at("pulse-key").hidden = this.motion.pulse.every(Number.isNaN);
    const named = { ground: "Ground acceleration and pulse", ratio: "Rotation over slenderness",
      phi: "Direction of the tilt", u: "Drift u", v: "Uplift v" };
    for (const [id, name] of Object.entries(named)) {
      at(`plot-${id}`).setAttribute("role", "img");
      at(`plot-${id}`).setAttribute("aria-label", `${name}, ${title}. ${line}`);
    }
  }

  stand() {
    const { peak, structure } = this.motion;
    const balance = Math.max(balanceAt(structure, 1), balanceAt(structure, -1));
    const lean = Number(at("exaggeration").value) * peak * balance;
    at("frame").replaceChildren();
    this.pose = rockingFrame(at("frame"), structure, lean);
  }

  // Time of the largest rotation before overturning, which is shown first.
  telling() {
    const { theta, structure } = this.motion;
    let best = 0;
    theta.forEach((value, i) => {
      const tilt = Math.abs(value);
      if (tilt <= balanceAt(structure, value) && tilt > Math.abs(theta[best])) best = i;
    });
    return best;
  }

  seek(time) {
    this.move(nearest(this.motion.time, time));
  }

  move(index) {
    const { motion } = this;
    this.index = Math.max(0, Math.min(motion.time.length - 1, index));
    const i = this.index;
    const lying = Math.min(i, this.last);
    const wanted = Number(at("exaggeration").value) * motion.theta[lying];
    const shown = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, wanted));
    this.pose(shown, motion.acceleration[i] / (this.largest || 1));
    at("scrub").value = i;
    at("scrub").setAttribute("aria-valuetext", `${motion.time[i].toFixed(2)} seconds`);
    this.plots.move(i);
    this.read("time", motion.time[i], 1, 3, "s");
    this.read("ground", motion.acceleration[i], 1 / motion.gravity, 3, "g");
    this.read("theta", motion.theta[i], 1, 6, "rad");
    this.read("ratio", motion.theta[i], 1 / balanceAt(motion.structure, motion.theta[i]), 3, "");
    if (motion.phi) this.read("phi", motion.phi[i], 180 / Math.PI, 1, "°", "upright");
    this.read("u", motion.u[i], 100, 2, "cm");
    this.read("v", motion.v[i], 100, 2, "cm");
  }

  // Keep the full value with the element, for all its digits.
  read(name, value, factor, digits, unit, unknown = "fallen") {
    const host = at(`at-${name}`);
    host.dataset.value = value;
    host.textContent = Number.isNaN(value) ? unknown : `${signed(value * factor, digits)} ${unit}`.trim();
  }

  toggle() {
    if (this.playing) this.stop();
    else this.play();
  }

  play() {
    const [from, to] = this.plots.window();
    let now = this.motion.time[this.index];
    if (now < from || now >= to - this.motion.step) now = from;
    let before = performance.now();
    const step = (stamp) => {
      now += Number(at("speed").value) * Math.max(0, stamp - before) / 1000;
      before = stamp;
      this.seek(Math.min(now, to));
      if (now >= to) this.stop();
      else this.playing = requestAnimationFrame(step);
    };
    this.playing = requestAnimationFrame(step);
    at("play").textContent = "Pause";
  }

  stop() {
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    at("play").textContent = "Play";
  }
}

// What is drawn of a structure, in words.
function drawnWords({ height, width, heights, widths, mass_ratio: mass }) {
  if (heights) {
    const [left, right] = heights.map((tall, i) => `${tall} m by ${widths[i]} m`);
    return `Both columns, ${left} and ${right}, to scale, and the beam, which turns`;
  }
  const size = `${height} m by ${width} m`;
  return mass === 0 ? `The column, ${size}, to scale`
    : `Two of the columns, ${size}, to scale, and the beam`;
}
