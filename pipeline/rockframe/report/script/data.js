// The data in the page: facts as JSON, samples as float32, deflated, in base64.
const facts = JSON.parse(at("facts").textContent);

async function inflated(key) {
  const text = at(`data-${key}`).textContent;
  const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream);
}

async function samples(key) {
  return new Float32Array(await (await inflated(key)).arrayBuffer());
}

async function motionOf(index) {
  const pair = facts.pairs[index];
  const ground = facts.grounds[pair.ground];
  const names = [`g${pair.ground}`, `p${pair.ground}`,
    ...["theta", "u", "v", "theta_low", "theta_high"].map((name) => `${name}${index}`)];
  const [acceleration, reach, theta, u, v, low, high] = await Promise.all(names.map(samples));
  const pulse = new Float32Array(acceleration.length).fill(NaN);
  pulse.set(reach, ground.pulseStart);
  return {
    pair, ground, acceleration, pulse, theta, u, v, low, high,
    time: Float64Array.from(acceleration, (_, i) => i * ground.step),
    step: ground.step, gravity: facts.gravity, peak: pair.peak,
    structure: facts.structures[pair.structure],
  };
}

function historyText(motion) {
  const lines = ["time_s,acceleration_m_s2,theta_rad,u_m,v_m"];
  const text = (value) => (Number.isNaN(value) ? "" : Number(value.toPrecision(9)).toString());
  const columns = [motion.time, motion.acceleration, motion.theta, motion.u, motion.v];
  for (let i = 0; i < motion.time.length; i += 1) {
    lines.push(columns.map((column) => text(column[i])).join(","));
  }
  return `${lines.join("\n")}\n`;
}
