// What the page carries: facts as JSON, samples as float32, deflated, in base64.
const facts = JSON.parse(document.getElementById("facts").textContent);

async function inflated(key) {
  const text = document.getElementById(`data-${key}`).textContent;
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
  const [acceleration, pulse, theta, u, v] = await Promise.all(
    [`g${pair.ground}`, `p${pair.ground}`, `theta${index}`, `u${index}`, `v${index}`].map(samples),
  );
  const time = Float64Array.from(acceleration, (_, i) => i * ground.step);
  // The structure has overturned where its history ends; it stays as it lay then.
  const ended = theta.findIndex(Number.isNaN);
  return {
    pair, ground, acceleration, pulse, theta, u, v, time,
    structure: facts.structures[pair.structure],
    last: ended < 0 ? theta.length - 1 : Math.max(0, ended - 1),
  };
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function save(name, text) {
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv;charset=utf-8" }));
  element("a", { href: address, download: name.replace(/[^\w.-]+/g, "_") }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
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
