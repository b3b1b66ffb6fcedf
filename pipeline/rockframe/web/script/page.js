// Helpers for every page: elements by name, formatted numbers, files to save.
const at = (id) => document.getElementById(id);
const signed = (value, digits) => value.toFixed(digits).replace("-", "\u2212");

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// Longest value that stands beside its label, on one line [characters].
const LONGEST = 17;

function list(host, entries) {
  host.replaceChildren(...entries.map(([label, value]) =>
    element("div", { class: value.length > LONGEST ? "long" : "" },
      element("dt", {}, label), element("dd", {}, value))));
}

function save(name, text) {
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv;charset=utf-8" }));
  element("a", { href: address, download: name.replace(/[^\w.-]+/g, "_") }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

// The verdict as a sentence, with the same words as in tables and figures. A rotation is over that at
// which the structure balances: of equal columns the slenderness.
function verdictLine(words, overturns, peak, band, balance = "slenderness") {
  const start = `${words[0].toUpperCase()}${words.slice(1)}.`;
  const nominal = overturns ? "overturns" : peak.toFixed(3);
  if (band) return `${start} Largest θ/α: ${band.replaceAll(" ", ", ")} (16, 50, 84 % of the ensemble), nominal ${nominal}.`;
  return overturns || peak === 0 ? start : `${start} The largest rotation is ${nominal} of the ${balance}.`;
}

// The strip over the multiples of the motion, as the server or the run drew it; none if unknown.
// The path of the deck seen from above, of motions in both directions.
function showPath(svg) {
  at("deck-path").innerHTML = svg ?? "";
  at("deck-words").textContent = at("deck-path").querySelector("title")?.textContent ?? "";
  at("deck").hidden = !svg;
}

function showStrip(picture) {
  at("strip").innerHTML = picture;
  at("strip-words").textContent = at("strip").querySelector("title")?.textContent ?? "";
  at("margin").hidden = !picture;
  at("margin").classList.remove("stale");
}

// Index of the nearest value in ascending numbers.
function nearest(numbers, value) {
  let low = 0;
  let high = numbers.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (numbers[middle] <= value) low = middle;
    else high = middle;
  }
  return value - numbers[low] <= numbers[high] - value ? low : high;
}
