// The table of all results: sorted by column, filtered by text and verdict.
function resultsTable() {
  const table = document.getElementById("results");
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  const words = document.getElementById("filter");
  const verdict = document.getElementById("filter-verdict");

  function sortBy(column) {
    const head = heads[column];
    const falls = head.getAttribute("aria-sort") === "ascending";
    const number = head.firstElementChild.dataset.kind === "number";
    const key = (row) => row.cells[column].dataset.order ?? row.cells[column].textContent;
    const compare = number
      ? (a, b) => Number(a) - Number(b) || 0
      : new Intl.Collator("en", { numeric: true }).compare;
    const rows = [...body.rows].map((row) => [key(row), row]);
    rows.sort(([a], [b]) => (falls ? compare(b, a) : compare(a, b)));
    for (const other of heads) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", falls ? "descending" : "ascending");
    body.append(...rows.map(([, row]) => row));
  }

  function filter() {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of body.rows) {
      const text = row.textContent.toLowerCase();
      const fits = wanted.every((word) => text.includes(word));
      row.hidden = !fits || (verdict.value !== "" && row.dataset.verdict !== verdict.value);
      shown += row.hidden ? 0 : 1;
    }
    document.getElementById("matches").textContent = `${shown} of ${body.rows.length}`;
  }

  heads.forEach((head, column) => {
    head.firstElementChild.addEventListener("click", () => sortBy(column));
  });
  words.addEventListener("input", filter);
  verdict.addEventListener("change", filter);
  filter();
  document.getElementById("save-table").addEventListener("click", async () => {
    save(`${facts.name}-table.csv`, await (await inflated("table")).text());
  });
  return (index) => {
    for (const row of body.rows) {
      if (row.dataset.history === String(index)) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    }
  };
}
