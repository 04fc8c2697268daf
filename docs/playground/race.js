"use strict";
// Searches race within the page: a slice of work at a time, so that the page stays responsive.
const SLICE_MS = 12, REDRAW_MS = 250;
const LEAST_GAP = 0.0001; // per cent; smaller ones are not distinguished

class Race {
  // show(x, name) is called with the best point so far, in the problem's units, at most every REDRAW_MS; choose(x) when a user picks it.
  constructor(parent, model, { show, choose }) {
    Object.assign(this, { model, show, choose, seed: 0, running: false });
    this.addControls(element("div", { class: "controls" }, parent));
    this.chart = new Chart(parent, { label: "race", x: "evaluations", y: "power [W]", log: [true, false], height: 320 });
    this.addTable(element("div", { class: "wide" }, parent));
    this.verdict = element("p", { class: "verdict", role: "status" }, parent);
    this.turn = new MessageChannel(); // unlike timers it does not wait between slices
    this.turn.port1.onmessage = () => this.work();
    this.restart();
  }

  addControls(bar) {
    this.button = element("button", { type: "button", class: "start" }, bar, "Start");
    this.button.addEventListener("click", () => (this.running ? this.pause() : this.start()));
    element("button", { type: "button", class: "again" }, bar, "New race").addEventListener("click", () => { this.restart(); this.start(); });
    const select = (words, options, act) => {
      const made = element("select", {}, element("label", {}, bar, `${words} `));
      for (const [value, shown] of options) element("option", { value }, made, shown);
      made.addEventListener("change", act);
      return made;
    };
    this.budget = select("evaluations each", [[10000, "10,000"], [50000, "50,000"], [250000, "250,000"]], () => this.draw());
    this.budget.value = "50000";
    this.axis = select("shown as", [["power", "power"], ["gap", "gap [%]"]], () => this.draw());
    this.speed = element("output", { class: "speed" }, bar);
  }

  addTable(parent) {
    const table = element("table", { class: "race" }, parent);
    const head = element("tr", {}, element("thead", {}, table));
    for (const words of ["search", "evaluations", "power [W]", "above the optimum", "gait"]) element("th", { scope: "col" }, head, words);
    const body = element("tbody", {}, table);
    this.cells = SEARCHES.map(({ name, words, colour }) => {
      const row = element("tr", {}, body);
      const first = element("th", { scope: "row" }, row);
      element("span", { class: "swatch", style: `background: ${colour}` }, first);
      element("abbr", { title: words }, first, name);
      const cells = [1, 2, 3].map(() => element("td", {}, row));
      const button = element("button", { type: "button", "aria-label": `Put the sliders to the best gait of ${name}` }, element("td", {}, row), "Take");
      button.addEventListener("click", () => this.choose(this.leader(name).x));
      return { cells, button };
    });
    const row = element("tr", { class: "optimum" }, body);
    for (const words of ["proven optimum", "", this.model.optimum.power.toFixed(6), "0 %"]) element("td", {}, row, words);
    const take = element("button", { type: "button", "aria-label": "Put the sliders to the proven optimum" }, element("td", {}, row), "Take");
    take.addEventListener("click", () => this.choose(this.model.optimum.x));
  }

  restart() {
    this.seed += 1;
    this.running = false;
    this.evaluations = this.elapsed = 0;
    this.runs = SEARCHES.map(({ make, ...about }, k) => ({ ...about, evaluations: 0, best: null, history: [],
      search: new make(this.model.variables.length, new Random(1000 * this.seed + k)) }));
    this.draw();
  }

  start() {
    if (this.unfinished().length === 0) this.restart();
    this.running = true;
    this.before = performance.now();
    this.drawn = 0;
    this.turn.port2.postMessage(null);
    this.draw();
  }

  pause() {
    this.running = false;
    this.draw();
  }

  unfinished() {
    return this.runs.filter((run) => run.evaluations < Number(this.budget.value));
  }

  // One slice: the search with the fewest evaluations is next.
  work() {
    if (!this.running) return;
    const end = performance.now() + SLICE_MS;
    let left = this.unfinished();
    while (left.length && performance.now() < end) {
      this.advance(left.reduce((a, b) => (b.evaluations < a.evaluations ? b : a)));
      left = this.unfinished();
    }
    const now = performance.now();
    this.elapsed += now - this.before;
    this.before = now;
    if (left.length) this.turn.port2.postMessage(null);
    else this.running = false;
    if (now - this.drawn > REDRAW_MS || !left.length) {
      this.drawn = now;
      this.draw();
    }
  }

  // One generation of a search, at most what is left of its budget.
  advance(run) {
    const found = this.model.evaluate(run.search.points.map((unit) => this.model.scale(unit)));
    found.slice(0, Number(this.budget.value) - run.evaluations).forEach((point) => {
      run.evaluations += 1;
      this.evaluations += 1;
      if (run.best && compare(point, run.best) >= 0) return;
      run.best = point;
      if (point.violation === 0) run.history.push([run.evaluations, point.f]);
    });
    run.search.tell(found.map((point, i) => ({ ...point, x: run.search.points[i] })));
  }

  leader(name = null) {
    const known = this.runs.filter((run) => run.best && (name === null || run.name === name));
    return known.length ? findBest(known.map((run) => ({ ...run.best, name: run.name }))) : null;
  }

  // Per cent above the optimum, which is proven to six digits.
  gap(power) {
    return 100 * (power / this.model.optimum.power - 1);
  }

  draw() {
    const fresh = this.evaluations === 0, left = this.unfinished();
    this.button.textContent = this.running ? "Pause" : fresh ? "Start" : left.length ? "Continue" : "Race again";
    this.speed.value = this.elapsed > 0 ? `${Math.round((1000 * this.evaluations) / this.elapsed).toLocaleString("en")} candidates per second` : "";
    this.speed.dataset.perSecond = this.elapsed > 0 ? String((1000 * this.evaluations) / this.elapsed) : "";
    this.runs.forEach((run, k) => this.fill(run, this.cells[k]));
    this.drawChart();
    const leader = this.leader();
    this.verdict.textContent = this.running ? "" : this.describe(fresh, left.length === 0, leader);
    if (leader) this.show(leader.x, `${leader.name}, best so far`);
  }

  fill(run, { cells, button }) {
    const feasible = run.best && run.best.violation === 0;
    cells[0].textContent = run.evaluations.toLocaleString("en");
    cells[1].textContent = feasible ? run.best.f.toFixed(6) : run.best ? "none feasible yet" : "";
    cells[2].textContent = feasible ? formatGap(this.gap(run.best.f)) : "";
    button.disabled = !run.best;
  }

  drawChart() {
    const asGap = this.axis.value === "gap", value = (power) => (asGap ? Math.max(this.gap(power), LEAST_GAP) : power), unit = asGap ? "%" : "W";
    const most = Number(this.budget.value);
    const series = this.runs.filter((run) => run.history.length).map(({ name, colour, line, history, evaluations, best }) => ({ name, colour, line, shape: "step",
      points: [...history, [evaluations, best.f]].map(([at, power]) => [at, value(power), `${name}: ${formatNumber(value(power))} ${unit} after ${at.toLocaleString("en")}`]) }));
    const mark = { name: "proven optimum", colour: "#000000", line: ":", shape: "line", points: [10, most].map((at) => [at, this.model.optimum.power]) };
    this.chart.show(asGap ? series : [mark, ...series], { y: asGap ? "gap to the optimum [%]" : "power [W]", log: [true, asGap] });
  }

  describe(fresh, finished, leader) {
    if (fresh) return `The mark to beat: ${this.model.optimum.power.toFixed(6)} W.`;
    if (!leader || leader.violation > 0) return "No search has found a feasible gait yet.";
    const gap = this.gap(leader.f), words = gap < LEAST_GAP ? "the proven optimum to six digits" : `${formatGap(gap)} above the proven optimum`;
    return `${finished ? "Closest" : "Closest so far"}: ${leader.name} with ${leader.f.toFixed(6)} W, ${words}.`;
  }
}

const formatGap = (percent) => (percent < LEAST_GAP ? `< ${LEAST_GAP} %` : `${Number(percent.toFixed(Math.max(0, 2 - Math.floor(Math.log10(percent)))))} %`);
