// One history looked at closely: frame, plots and readout at one time.
const at = (id) => document.getElementById(id);
const signed = (value, digits) => value.toFixed(digits).replace("-", "\u2212");

function list(host, entries) {
  host.replaceChildren(...entries.map(([label, value]) =>
    element("div", { class: value.length > 40 ? "long" : "" },
      element("dt", {}, label), element("dd", {}, value))));
}

function said({ pair, ground }) {
  const ratio = pair.peak.toFixed(3);
  if (pair.verdict === "overturned") return `overturns at ${pair.overturning.toFixed(1)} s`;
  if (pair.verdict === "no_uplift") return "does not uplift";
  return `rocks to ${ratio} of its slenderness and stands`;
}

class Detail {
  constructor(onShow) {
    this.onShow = onShow;
    this.index = 0;
    this.motion = null;
    this.playing = 0;
    this.last = 0;
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
    at("zoom-motion").addEventListener("click", () => this.plots.show(this.plots.rocking));
    at("save-history").addEventListener("click", () => {
      const { ground, pair } = this.motion;
      save(`${ground.id}-${pair.structure}.csv`, historyText(this.motion));
    });
    at("graphs").addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.target !== event.currentTarget || event.ctrlKey || event.metaKey || event.altKey) return;
    const many = event.shiftKey ? Math.round(0.5 / this.motion.ground.step) : 1;
    const actions = {
      ArrowLeft: () => this.move(this.index - many),
      ArrowRight: () => this.move(this.index + many),
      "+": () => this.plots.zoom(0.5),
      "-": () => this.plots.zoom(2),
      0: () => this.plots.all(),
      " ": () => this.toggle(),
    };
    if (!(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }

  async show(number) {
    this.stop();
    const motion = await motionOf(number);
    this.motion = motion;
    this.largest = motion.acceleration.reduce((most, a) => Math.max(most, Math.abs(a)), 0);
    at("detail").hidden = false;
    this.words(motion);
    this.stand();
    at("scrub").max = motion.time.length - 1;
    this.plots?.destroy();
    this.plots = linkedPlots(motion, (index) => { if (!this.playing) this.move(index); });
    this.move(this.telling(motion));
    this.onShow(number);
  }

  stand() {
    const { pair, structure } = this.motion;
    const lean = Number(at("exaggeration").value) * pair.peak * structure.slenderness;
    at("frame").replaceChildren();
    this.pose = rockingFrame(at("frame"), structure, lean);
  }

  // Where the frame leans most while it still stands: the picture to begin with.
  telling({ theta, structure }) {
    let best = 0;
    theta.forEach((value, i) => {
      const tilt = Math.abs(value);
      if (tilt <= structure.slenderness && tilt > Math.abs(theta[best])) best = i;
    });
    return best;
  }

  words(motion) {
    const { pair, ground, structure } = motion;
    at("detail-title").textContent = `${pair.structure} under ${pair.record}`;
    const event = pair.event ? `${pair.event}. ` : "";
    const line = `${event}The structure ${said(motion)}.`;
    at("verdict-line").textContent = line;
    at("verdict-line").className = `verdict-line ${pair.verdict}`;
    const size = `${structure.height} m by ${structure.width} m`;
    const kind = structure.mass_ratio === 0
      ? `The column, ${size}, to scale`
      : `Two of the columns, ${size}, to scale, and the beam`;
    at("frame-caption").textContent =
      `${kind}; dotted the place at rest; the arrow is the ground acceleration. Right is positive.`;
    at("pulse-key").hidden = motion.pulse.length === 0;
    const named = { ground: "Ground acceleration and pulse", ratio: "Rotation over slenderness",
      u: "Drift u", v: "Lift v" };
    for (const [id, name] of Object.entries(named)) {
      at(`plot-${id}`).setAttribute("role", "img");
      at(`plot-${id}`).setAttribute("aria-label", `${name}, ${pair.structure} under ${pair.record}. ${line}`);
    }
    list(at("pair-facts"), pair.facts);
    list(at("structure-facts"), structure.facts);
    list(at("record-facts"), ground.facts);
    at("passport-verdict").textContent = ground.passport;
    at("passport-verdict").className = `badge ${ground.passport}`;
    at("checks").replaceChildren(...ground.checks.map(([name, value, limit, verdict]) =>
      element("tr", { class: verdict }, element("th", { scope: "row" }, name),
        element("td", {}, value), element("td", {}, limit), element("td", {}, verdict))));
  }

  move(index) {
    const { motion } = this;
    this.index = Math.max(0, Math.min(motion.time.length - 1, index));
    const i = this.index;
    const lying = Math.min(i, motion.last);
    const wanted = Number(at("exaggeration").value) * motion.theta[lying];
    const shown = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, wanted));
    this.pose(shown, motion.acceleration[i] / this.largest);
    at("scrub").value = i;
    at("scrub").setAttribute("aria-valuetext", `${motion.time[i].toFixed(2)} seconds`);
    this.plots.move(i);
    this.read("time", motion.time[i], 1, 3, "s");
    this.read("ground", motion.acceleration[i], 1 / GRAVITY, 3, "g");
    this.read("theta", motion.theta[i], 1, 6, "rad");
    this.read("ratio", motion.theta[i], 1 / motion.structure.slenderness, 3, "");
    this.read("u", motion.u[i], 100, 2, "cm");
    this.read("v", motion.v[i], 100, 2, "cm");
  }

  // The value itself goes with the element, for whoever wants all its digits.
  read(name, value, factor, digits, unit) {
    const host = at(`at-${name}`);
    host.dataset.value = value;
    host.textContent = Number.isNaN(value) ? "fallen" : `${signed(value * factor, digits)} ${unit}`.trim();
  }

  toggle() {
    if (this.playing) this.stop();
    else this.play();
  }

  play() {
    const [from, to] = this.plots.window();
    const { time, ground } = this.motion;
    let now = time[this.index];
    if (now < from || now >= to - ground.step) now = from;
    let before = performance.now();
    const step = (stamp) => {
      now += Number(at("speed").value) * Math.max(0, stamp - before) / 1000;
      before = stamp;
      this.move(Math.round(Math.min(now, to) / ground.step));
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
