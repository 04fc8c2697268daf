"use strict";
// Sliders, numbers, the gait in 3-D and the race. `playground` is for tests.
const playground = {};
const YOURS = "#0072B2", OPTIMUM = "#404040", LEADER = "#CC79A7";
// How constraints are shown: a factor on their unit, and the unit's name.
const SHOWN_UNITS = { m: [1000, "mm"], rad: [180 / Math.PI, "\u00b0"], Nm: [1, "Nm"], 1: [1, ""] };

class Sliders {
  constructor(parent, variables, change) {
    Object.assign(this, { variables });
    this.parts = variables.map((variable, j) => {
      const label = element("label", { class: "slider" }, parent);
      element("span", {}, label, variable.words);
      const value = element("output", {}, label);
      const { lower: min, upper: max } = variable;
      const input = element("input", { type: "range", min, max, step: (max - min) / 1000, "data-variable": variable.name }, label);
      input.addEventListener("input", () => change(j, Number(input.value)));
      return { input, value };
    });
  }

  set(x) {
    this.variables.forEach(({ unit }, j) => {
      const { input, value } = this.parts[j], words = `${Number(x[j].toPrecision(4))} ${unit}`;
      input.value = String(x[j]);
      input.setAttribute("aria-valuetext", words);
      value.value = words;
    });
  }
}

// Power, gap and the room that each family of constraints has left.
class Numbers {
  constructor(summary, parent, model) {
    Object.assign(this, { summary, model });
    this.power = element("strong", { class: "power" }, summary);
    this.gap = element("span", {}, summary);
    this.state = element("span", { class: "state" }, summary);
    const table = element("table", {}, parent);
    const head = element("tr", {}, element("thead", {}, table));
    for (const words of ["constraints", "violated", "least room left"]) element("th", { scope: "col" }, head, words);
    const body = element("tbody", {}, table);
    this.families = model.facts.families.map((family) => {
      const row = element("tr", {}, body);
      element("th", { scope: "row" }, row, family.words);
      return { ...family, row, cells: [element("td", {}, row), element("td", {}, row)] };
    });
  }

  set(x) {
    const [{ f, violation }] = this.model.evaluate([x]), rows = this.model.rows(x), names = this.model.facts.rows;
    const excess = (100 * (f / this.model.optimum.power - 1));
    const violated = rows.filter((row) => row > 0).length;
    this.power.textContent = `${f.toFixed(5)} W`;
    this.gap.textContent = violation > 0 ? "" : excess < LEAST_GAP ? "the proven optimum" : `${formatGap(excess)} above the optimum`;
    this.state.textContent = violation > 0 ? `not feasible: ${violated} of ${rows.length} constraints violated` : `feasible: all ${rows.length} constraints met`;
    this.summary.classList.toggle("violated", violation > 0);
    for (const { name, scale, unit, row, cells } of this.families) {
      const own = rows.filter((_, i) => names[i].split(/[[ ]/)[0] === name), worst = Math.max(...own);
      const [factor, words] = SHOWN_UNITS[unit];
      cells[0].textContent = `${own.filter((value) => value > 0).length} of ${own.length}`;
      cells[1].textContent = `${formatNumber(Number((-worst * scale * factor).toPrecision(4)))} ${words}`;
      row.classList.toggle("violated", worst > 0);
    }
  }
}

// The first feasible one of random points: always the same.
function findStart(model) {
  const random = new Random(7), found = model.evaluate(random.points(2000, model.variables.length).map((unit) => model.scale(unit)));
  return (found.find(({ violation }) => violation === 0) || found[0]).x;
}

async function openPlayground() {
  const facts = JSON.parse(document.getElementById("facts").textContent);
  const wasm = Uint8Array.from(atob(document.getElementById("module").textContent.trim()), (letter) => letter.charCodeAt(0));
  const model = await Model.load(facts, wasm);
  const at = (id) => document.getElementById(id);
  let x = findStart(model);
  const start = x;
  const sliders = new Sliders(at("sliders"), model.variables, (j, value) => move(x.map((own, k) => (k === j ? value : own))));
  const numbers = new Numbers(at("summary"), at("constraints"), model);
  const figure = at("gait");
  figure.interactive = element("div", { class: "interactive" });
  figure.querySelector("figcaption").before(figure.interactive);
  const gaits = [model.gait(x, "yours", YOURS), model.gait(model.optimum.x, "proven optimum", OPTIMUM), model.gait(x, "leader of the race", LEADER)];
  const view = new GaitView(figure, { gaits, over: true, speed: 0.25 });
  const curves = element("div", { class: "curves" }, figure.interactive);
  const charts = [["power", "mechanical power [W]"], ["margin", "balance margin [mm]"]].map(([key, y]) => [key, new Chart(curves, { label: y, x: "time [s]", y, height: 200 })]);
  const put = (i, point) => {
    view.gaits[i] = model.gait(point, gaits[i].name, gaits[i].colour);
    view.select();
    for (const [key, chart] of charts)
      chart.show(view.gaits.slice(0, 2).map((gait) => ({ name: gait.name, colour: gait.colour, line: "-", shape: "line",
        points: gait.t.map((t, k) => [t / 1000, gait[key][k], `${gait.name}: ${formatNumber(gait[key][k])} at ${formatNumber(t / 1000)} s`]) })));
  };
  const move = (point) => {
    x = [...point];
    sliders.set(x);
    numbers.set(x);
    put(0, x);
    playground.x = x;
  };
  for (const [words, point] of [["Start", () => start], ["Optimum", () => model.optimum.x], ["Random", () => model.scale(model.variables.map(Math.random))]])
    element("button", { type: "button" }, at("points"), words).addEventListener("click", () => move(point()));
  const race = new Race(at("race"), model, { show: (point) => put(2, point), choose: (point) => { move(point); at("summary").scrollIntoView({ block: "nearest" }); } });
  Object.assign(playground, { model, race, view, move });
  move(x);
  document.body.dataset.ready = "yes";
}

openPlayground().catch((error) => {
  const words = element("p", { class: "verdict", role: "alert" }, null, `This browser cannot run the page: ${error.message}. It needs WebAssembly with SIMD (since 2021; Safari since 16.4).`);
  document.querySelector("main").prepend(words);
});
