// Mark tables that are wider than the screen.
const markWide = () => document.querySelectorAll(".wide").forEach((box) =>
  box.classList.toggle("scrolls", box.scrollWidth > box.clientWidth + 1));
addEventListener("resize", markWide);

// The address names the history that is shown, so that links, the back button and bookmarks work.
const mark = resultsTable();
const record = at("pick-record");
const structure = at("pick-structure");
const detail = new Detail((number) => {
  mark(number);
  const pair = facts.pairs[number];
  record.value = String(pair.ground);
  const choices = facts.pairs.flatMap((other, i) => (other.ground === pair.ground ? [[other, i]] : []));
  structure.replaceChildren(...choices.map(([other, i]) =>
    element("option", { value: String(i) }, other.structure)));
  structure.value = String(number);
  at("previous").disabled = number === 0;
  at("next").disabled = number === facts.pairs.length - 1;
});

function asked() {
  const number = Number((/^#history-(\d+)$/.exec(location.hash) ?? [])[1]);
  return number < facts.pairs.length ? number : null;
}

async function showAsked(jump) {
  const number = asked();
  if (number === null) return;
  try {
    await detail.show(number);
    document.documentElement.dataset.shown = number;
    if (jump) {
      at("detail").scrollIntoView();
      at("detail-title").focus({ preventScroll: true });
    }
  } catch (error) {
    at("trouble").textContent = `This history cannot be shown: ${error}`;
    at("trouble").hidden = false;
  }
}

function go(number) {
  location.hash = `#history-${number}`;
}

record.replaceChildren(...facts.grounds.map((ground, i) => {
  const first = facts.pairs.find((pair) => pair.ground === i);
  return element("option", { value: String(i) }, `${first.record} (${ground.id})`);
}));
record.addEventListener("change", () => {
  const wanted = facts.pairs[Number(structure.value)].structure;
  const here = (pair) => pair.ground === Number(record.value);
  const same = facts.pairs.findIndex((pair) => here(pair) && pair.structure === wanted);
  go(same >= 0 ? same : facts.pairs.findIndex(here));
});
structure.addEventListener("change", () => go(Number(structure.value)));
at("previous").addEventListener("click", () => go(asked() - 1));
at("next").addEventListener("click", () => go(asked() + 1));
// A link scrolls the page to the history; the page's own controls do not.
addEventListener("hashchange", () => showAsked(document.activeElement?.matches("a, body") ?? true));

// At first, show the history with the largest rotation without overturning.
if (asked() === null && facts.pairs.length > 0) {
  const lean = (pair) => (pair.overturns ? -1 : pair.peak);
  const best = facts.pairs.reduce((most, pair, i) => (lean(pair) > lean(facts.pairs[most]) ? i : most), 0);
  history.replaceState(null, "", `#history-${best}`);
  showAsked(false);
} else {
  showAsked(true);
}

markWide();
