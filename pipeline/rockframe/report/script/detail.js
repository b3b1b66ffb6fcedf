// One history of the run: the player with its motion, and what is said of it.
function said({ pair }) {
  if (pair.verdict === "overturned") return `overturns at ${pair.overturning.toFixed(1)} s`;
  if (pair.verdict === "no_uplift") return "does not uplift";
  const fell = pair.overturning !== null;
  const fate = fell ? `overturns at ${pair.overturning.toFixed(1)} s` : `rocks to ${pair.peak.toFixed(3)} of its slenderness and stands`;
  return pair.verdict === "undecided" ? `${fate}, but a small change turns that: undecided` : fate;
}

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
    const line = `${event}The structure ${said(motion)}.`;
    at("verdict-line").textContent = line;
    at("verdict-line").className = `verdict-line ${pair.verdict}`;
    this.player.describe(`${pair.structure} under ${pair.record}`, line);
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
