// Only one request is sent at a time; meanwhile only the newest settings are kept.
const player = new Player();
let asking = false;
let next = null;
let shown = null;
let count = 0;

function motionOf(bytes) {
  const end = new Uint8Array(bytes).indexOf(10) + 1;
  const found = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 0, end)));
  const motion = { ...found, peak: found.peak_rotation_ratio, structure: found, pair: { path: found.path } };
  found.series.forEach((name, i) => {
    motion[name] = new Float32Array(bytes, end + 4 * i * found.drawn, found.drawn);
  });
  motion.pulse = new Float32Array(found.drawn).fill(NaN);
  return motion;
}

function number(value, factor, digits, unit) {
  return value === null ? "–" : `${signed(value * factor, digits)} ${unit}`.trim();
}

function words(motion) {
  const fell = motion.verdict === "overturns";
  const { bands } = motion;
  const line = verdictLine(motion.words, fell, motion.peak, bands?.["θ/α, 16 50 84 %"], balanceName(motion));
  at("verdict-line").textContent = line;
  at("verdict-line").className = `verdict-line ${motion.tone}`;
  list(at("pair-facts"), [
    ...Object.entries(bands ?? {}),
    ...motion.peaks,
    ["first uplift", number(motion.uplift_time, 1, 3, "s")],
    ...(motion.impacts === null ? [] : [["impacts", String(motion.impacts)]]),
    ["peak ground acceleration", number(motion.pga, 1 / motion.gravity, 3, "g")],
    ...(motion.pulse_words ? [["pulse", motion.pulse_words]] : []),
  ]);
  at("pair-facts").dataset.peak = motion.peak;
  list(at("structure-facts"), motion.properties.length ? [
    ...motion.properties, ...(motion.unusual ? [["unusual", motion.unusual]] : []),
  ] : [
    ["slenderness α", `${number(motion.slenderness, 180 / Math.PI, 3, "°")}`],
    ["semi-diagonal of a column R", number(motion.size, 1, 3, "m")],
    ["frequency parameter of a column p", number(motion.frequency_parameter, 1, 4, "rad/s")],
    ["of the frame p̂", number(motion.effective_frequency_parameter, 1, 4, "rad/s")],
    ["restitution √r", number(motion.restitution, 1, 4, "")],
    ["uplift at", number(motion.uplift_acceleration, 1 / motion.gravity, 4, "g")],
    ...(motion.unusual ? [["unusual", motion.unusual]] : []),
  ]);
  at("toml").textContent = tables(motion);
  player.describe(`the structure under ${motion.pulse_words ? "the pulse of " : ""}${shown}`, line);
}

function tables(motion) {
  const name = `name = "${at("structure").value}"`;
  if (motion.heights) {
    return [
      "[[structure]]", name, 'kind = "unequal"', `heights_m = [${motion.heights.join(", ")}]`,
      `widths_m = [${motion.widths.join(", ")}]`, `spacing_m = ${motion.spacing}`,
      `beam_depth_m = ${motion.beam_depth}`, `beam_offset_m = ${motion.beam_offset}`,
      `mass_ratio = ${motion.mass_ratio}`, `restitution_factor = ${motion.restitution_factor}`,
    ].join("\n");
  }
  const { section } = settings;
  const kind = /^\d/.test(section) ? `inertia_ratio = ${section}` : `section = "${section}"`;
  return [
    "[[structure]]", name, `height_m = ${motion.height}`,
    `width_m = ${motion.width}`, `mass_ratio = ${motion.mass_ratio}`, kind,
    `restitution_factor = ${motion.restitution_factor}`,
  ].join("\n");
}

function trouble(error) {
  at("trouble").textContent = error ?? "";
  at("trouble").hidden = !error;
  // A verdict, a margin and a history beside an error would be those of other settings.
  at("verdict-line").hidden = Boolean(error);
  at("answer").hidden = Boolean(error);
  if (error) at("margin").hidden = true;
  settings.blame(error);
}

async function answered(query) {
  const response = await fetch(`response?${query}`);
  if (response.ok) return motionOf(await response.arrayBuffer());
  trouble(response.status === 400 ? (await response.json()).error
    : `The explorer answered ${response.status}.`);
  return null;
}

function draw(motion, fresh) {
  trouble(null); // plots have no size while they are hidden
  const record = at("record").value;
  if (fresh || shown !== record) {
    shown = record;
    player.show(motion);
  } else {
    player.update(motion);
  }
  words(motion);
  showPath(motion.path);
}

// The margin takes some tenths of a second, so it is requested only when the settings rest.
const REST = 400;
let resting = 0;
let known = {};
let margin = new AbortController();

function forgetMargin() {
  clearTimeout(resting);
  margin.abort();
  at("margin").classList.add("stale");
}

// The envelope is known in intervals of time; a sample has that of its interval.
function onSamples(time, starts, values) {
  let place = 0;
  return time.map((moment) => {
    while (place + 1 < starts.length && starts[place + 1] <= moment) place += 1;
    return values[place];
  });
}

function showMargin(motion, { tone, words: told, strip, bands, envelope }) {
  if (told) {
    const [low, high] = envelope ? [envelope.low, envelope.high].map((one) =>
      onSamples(motion.time, envelope.time, one)) : [[], []];
    player.update({ ...motion, low, high });
    words({ ...motion, tone, words: told, bands });
  }
  showStrip(strip ?? "");
}

function awaitRest(motion) {
  const key = settings.stated([0, 0]).toString();
  if (key === known.key) return showMargin(motion, known.found);
  resting = setTimeout(async () => {
    margin = new AbortController();
    const { signal } = margin;
    try {
      const response = await fetch(`margin?${key}`, { signal });
      const found = await response.json();
      if (signal.aborted) return;
      known = { key, found };
      showMargin(motion, found);
    } catch (error) {
      if (!(error instanceof TypeError) && error.name !== "AbortError") throw error;
    }
  }, REST);
  return undefined;
}

async function ask(fresh) {
  forgetMargin();
  next = { fresh: fresh || (next?.fresh ?? false) };
  if (asking) return;
  asking = true;
  const { dataset } = document.documentElement;
  dataset.asking = true;
  while (next) {
    const wanted = next;
    next = null;
    const began = performance.now();
    try {
      const motion = await answered(settings.stated(windowOf(wanted.fresh)));
      if (motion) draw(motion, wanted.fresh);
      if (motion && !next) awaitRest(motion);
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
      trouble("The explorer does not answer. Start it again: rockframe explore.");
    }
    await new Promise(requestAnimationFrame);
    dataset.took = performance.now() - began;
    count += 1;
    dataset.answered = count;
  }
  asking = false;
  dataset.asking = false;
}

const windowOf = (fresh) => (fresh || !player.plots ? [0, settings.chosen.duration] : player.plots.window());

// The page has only the drawn samples of a long record, so zooming fetches those of the window.
let waiting = 0;
let last = "";
new MutationObserver(() => {
  const { motion } = player;
  const window = player.plots?.window().join() ?? "";
  if (!motion || motion.drawn === motion.samples || window === last) return;
  last = window;
  clearTimeout(waiting);
  waiting = setTimeout(() => ask(false), 150);
}).observe(at("graphs"), { attributes: true, attributeFilter: ["data-from", "data-to"] });

at("save-history").addEventListener("click", async () => {
  const response = await fetch(`history.csv?${settings.stated(windowOf(false))}`);
  const text = await response.text();
  if (response.ok) save(`${at("record").value}-${at("structure").value}.csv`, text);
  else trouble(JSON.parse(text).error);
});

const settings = new Settings(ask);
ask(true);
