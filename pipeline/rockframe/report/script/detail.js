// One history of the run: the player, and the values of record, pulse and response.
class Detail {
  constructor(onShow) {
    this.onShow = onShow;
    this.player = new Player();
    at("save-history").addEventListener("click", () => {
      const { ground, pair } = this.player.motion;
      save(`${ground.id}-${pair.structure}.csv`, historyText(this.player.motion));
    });
  }

  async show(number) {
    this.player.stop();
    const motion = await motionOf(number);
    at("detail").hidden = false;
    this.player.show(motion);
    this.words(motion);
    this.onShow(number);
  }

  words(motion) {
    const { pair, ground, structure } = motion;
    at("detail-title").textContent = `${pair.structure} under ${pair.record}`;
    const event = pair.event ? `${pair.event}. ` : "";
    const line = `${event}${verdictLine(pair.words, pair.overturns, pair.peak, pair.band, balanceName(structure))}`;
    at("verdict-line").textContent = line;
    at("verdict-line").className = `verdict-line ${pair.tone}`;
    at("pulse-key").textContent = ground.pulse || "matched pulse";
    this.player.describe(`${pair.structure} under ${pair.record}`, line);
    showStrip(pair.strip);
    showPath(pair.path);
    at("spread-bars").innerHTML = pair.spreads;
    at("spread-words").textContent = at("spread-bars").querySelector("title")?.textContent ?? "";
    at("spreads").hidden = !pair.spreads;
    at("force-rows").replaceChildren(...pair.forces.rows.map(([name, ...values]) =>
      element("tr", {}, element("th", { scope: "row" }, name),
        ...values.map((value) => element("td", { class: "number" }, value)))));
    at("force-words").textContent = pair.forces.words;
    at("forces").hidden = !pair.forces.words;
    list(at("pair-facts"), pair.facts);
    list(at("structure-facts"), structure.facts);
    list(at("record-facts"), ground.facts);
    at("passport-verdict").textContent = ground.passport;
    at("passport-verdict").className = `badge ${ground.passport}`;
    at("checks").replaceChildren(...ground.checks.map(([name, value, limit, verdict]) =>
      element("tr", { class: verdict }, element("th", { scope: "row" }, name),
        element("td", {}, value), element("td", {}, limit),
        element("td", {}, verdict.replace("_", " ")))));
  }
}
