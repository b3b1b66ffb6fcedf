// The settings: each has a slider for the usual range and a field for any value.
const facts = JSON.parse(at("facts").textContent);
// A kind of structure has some of these; the others are hidden.
const NUMBERS = [...document.querySelectorAll(".setting input[type=text]")].map(({ id }) => id);
const numbersOf = (structure) => NUMBERS.filter((name) => name === "scale" || name in structure);
const OWN = "own";

class Settings {
  constructor(onChange) {
    this.onChange = onChange;
    at("record").replaceChildren(...facts.records.map((record) =>
      element("option", { value: record.id }, record.title ? `${record.id}: ${record.title}` : record.id)));
    const named = facts.structures.map(({ name }) => element("option", { value: name }, name));
    at("structure").replaceChildren(...named, element("option", { value: OWN }, "own dimensions"));
    for (const name of NUMBERS) this.couple(name);
    at("section").addEventListener("change", () => this.changed("section"));
    at("vertical").addEventListener("change", () => onChange(false));
    at("pulse").addEventListener("change", () => onChange(true));
    at("record").addEventListener("change", () => {
      this.record();
      onChange(true);
    });
    at("structure").addEventListener("change", () => this.begin(at("structure").value));
    this.record();
    this.write(facts.structures[0]);
  }

  couple(name) {
    const slider = at(`${name}-slider`);
    const field = at(name);
    slider.addEventListener("input", () => {
      field.value = slider.value;
      this.changed(name);
    });
    field.addEventListener("input", () => {
      slider.value = field.value;
      this.changed(name);
    });
  }

  changed(name) {
    if (name !== "scale") at("structure").value = OWN;
    this.onChange(false);
  }

  begin(name) {
    const chosen = facts.structures.find((structure) => structure.name === name);
    if (!chosen) return;
    this.write(chosen);
    this.onChange(true);
  }

  write(structure) {
    this.written = structure;
    for (const name of [...NUMBERS, "section"]) {
      at(name).parentElement.hidden = name !== "scale" && !(name in structure);
    }
    for (const name of numbersOf(structure)) {
      const value = structure[name] ?? at(name).value;
      at(name).value = value;
      at(`${name}-slider`).value = value;
    }
    at("structure").value = structure.name;
    if (!structure.section) return;
    const known = [...at("section").options].some(({ value }) => value === structure.section);
    if (!known) {
      at("section").append(element("option", { value: structure.section },
        `inertia ratio ${Number(structure.section).toPrecision(5)}`));
    }
    at("section").value = structure.section;
  }

  record() {
    this.chosen = facts.records.find(({ id }) => id === at("record").value);
    const { vertical, both } = this.chosen;
    at("section").disabled = both;
    at("section-why").hidden = !both;
    at("pulse").disabled = both;
    at("pulse-why").hidden = !both;
    if (both) at("pulse").checked = false;
    at("vertical").disabled = !vertical;
    if (!vertical) at("vertical").checked = false;
    at("vertical-why").hidden = vertical;
  }

  // Columns are round under both components of a station.
  get section() {
    return this.chosen.both ? "circular" : at("section").value;
  }

  stated([from, to]) {
    const numbers = Object.fromEntries(numbersOf(this.written).map((name) => [name, at(name).value.trim()]));
    const section = this.written.section ? { section: this.section } : {};
    return new URLSearchParams({
      ...numbers, ...section, kind: this.written.kind, record: at("record").value,
      vertical: at("vertical").checked ? "1" : "0", pulse: at("pulse").checked ? "1" : "0", from, to,
    });
  }

  // Find the field that an error names.
  blame(error) {
    const name = (/^Invalid (\w+)/.exec(error ?? "") ?? [])[1];
    const pair = name?.replace(/s$/, ""); // heights and widths have a field for each column
    const named = [name, `${pair}_left`, `${pair}_right`];
    for (const field of NUMBERS) at(field).setAttribute("aria-invalid", String(named.includes(field)));
  }
}
