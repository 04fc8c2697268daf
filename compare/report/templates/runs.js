"use strict";
// Convergence, share of solved targets and final values, drawn from the runs in the page; one choice of solvers for all charts.
const choice = { hidden: new Set(), axis: "evaluations", single: false, target: "all", budget: 1 };
const AXES = { evaluations: "equivalent evaluations", seconds: "seconds of the solve" };
const redrawn = [];

const clipped = (gap, data) => 100 * Math.max(gap, data.smallest);
const shownSolvers = (data) => data.solvers.filter((solver) => !choice.hidden.has(solver.name) && solver.known[choice.axis]);
const lastCost = (run) => run[choice.axis][run[choice.axis].length - 1] || 0;
const ofRun = (solver, run) => `${solver.name}, run ${run.run}`;

// Best gap of a run at a cost; Infinity while it has none.
function gapAt(run, cost) {
  let best = Infinity;
  run.gap.forEach((gap, i) => { if (gap !== null && run[choice.axis][i] <= cost) best = Math.min(best, gap); });
  return best;
}

function costToReach(run, target) {
  const at = run.gap.findIndex((gap) => gap !== null && gap <= target * (1 + 1e-9));
  return at < 0 ? Infinity : run[choice.axis][at];
}

function quantiles(values) {
  const sorted = [...values].sort((a, b) => a - b), n = sorted.length;
  return [sorted[0], (sorted[Math.floor((n - 1) / 2)] + sorted[Math.ceil((n - 1) / 2)]) / 2, sorted[n - 1]];
}

function convergence(data) {
  const found = [];
  for (const solver of shownSolvers(data)) {
    const searches = solver.runs.some((run) => run.gap.length > 1);
    if (!searches || choice.single)
      for (const run of solver.runs) {
        const points = run.gap.map((gap, i) => [run[choice.axis][i], gap, i]).filter(([cost, gap]) => gap !== null && cost > 0)
          .map(([cost, gap]) => [cost, clipped(gap, data), `${ofRun(solver, run)}: ${formatNumber(100 * gap)} % after ${formatNumber(cost)}`]);
        found.push({ ...solver, shape: searches ? "step" : "points", points, faint: searches });
      }
    if (!searches) continue;
    const costs = solver.runs.flatMap((run) => run[choice.axis]).filter((cost) => cost > 0);
    const [first, last] = [Math.log(Math.min(...costs)), Math.log(Math.max(...costs))];
    const grid = costs.length ? Array.from({ length: 120 }, (_, i) => Math.exp(first + ((last - first) * i) / 119) * (1 + 1e-9)) : [];
    const bands = grid.map((cost) => [cost, ...quantiles(solver.runs.map((run) => gapAt(run, cost)))]);
    if (!choice.single)
      found.push({ ...solver, shape: "band", points: bands.filter((b) => Number.isFinite(b[3])).map((b) => [b[0], clipped(b[1], data), clipped(b[3], data)]) });
    found.push({ ...solver, shape: "line", points: bands.filter((b) => Number.isFinite(b[2])).map((b) => [b[0], clipped(b[2], data),
      `${solver.name}, median of ${solver.runs.length} runs: ${formatNumber(100 * b[2])} % after ${formatNumber(b[0])}`]) });
  }
  return found;
}

function runtime(data) {
  const solvers = shownSolvers(data);
  const targets = choice.target === "all" ? data.targets : [Number(choice.target)];
  const last = Math.max(1e-3, ...solvers.flatMap((solver) => solver.runs.map(lastCost)));
  return solvers.map((solver) => {
    const pairs = solver.runs.flatMap((run) => targets.map((target) => costToReach(run, target)));
    const reached = pairs.filter(Number.isFinite).sort((a, b) => a - b);
    const points = [];
    reached.forEach((cost, i) => {
      if (reached[i + 1] === cost) return;
      const share = (i + 1) / pairs.length;
      points.push([Math.max(cost, 1e-6), share, `${solver.name}: ${(100 * share).toFixed(1)} % within ${formatNumber(cost)}`]);
    });
    if (points.length) points.unshift([points[0][0], 0]);
    if (points.length) points.push([Math.max(last, points[points.length - 1][0]), points[points.length - 1][1]]);
    return { ...solver, shape: "step", points };
  });
}

// Final gaps, a row for each solver: the gap of every run within the chosen share of the largest budget.
function final(data) {
  const solvers = shownSolvers(data);
  const budget = choice.budget * Math.max(1e-9, ...solvers.flatMap((solver) => solver.runs.map(lastCost)));
  return solvers.flatMap((solver, row) => {
    const gaps = solver.runs.map((run) => gapAt(run, budget * (1 + 1e-9)));
    const points = solver.runs.map((run, i) => [clipped(gaps[i], data), solvers.length - row,
      `${ofRun(solver, run)}: ${formatNumber(100 * gaps[i])} %` + (choice.budget === 1 && run.value !== null ? `, ${data.objective} ${run.value}` : "")])
      .filter(([gap]) => Number.isFinite(gap));
    const middle = quantiles(gaps)[1];
    const bar = Number.isFinite(middle) ? [[clipped(middle, data), solvers.length - row - 0.35], [clipped(middle, data), solvers.length - row + 0.35]] : [];
    return [{ ...solver, shape: "points", points }, { ...solver, shape: "line", points: bar }];
  });
}

const KINDS = {
  convergence: { series: convergence, log: [true, true], y: "gap to the best known [%]", label: "Convergence" },
  runtime: { series: runtime, log: [true, false], y: "share of runs and targets", range: [0, 1.03], label: "Share of solved targets" },
  final: { series: final, log: [true, false], y: "", label: "Gap of every run", x: "gap to the best known [%]" },
};

function addRuns(figure, data) {
  const { series, log, y, label, x, range } = KINDS[data.kind];
  const runs = data.of ? JSON.parse(document.querySelector(`#figure-${CSS.escape(data.of)} script`).textContent) : data;
  const chart = new Chart(figure.interactive, { label, x: x || AXES.evaluations, y, log, range });
  redrawn.push(() => {
    const rows = shownSolvers(runs).map((solver, row, all) => [all.length - row, solver.name.slice(0, 16)]);
    const labels = data.kind === "final" ? { names: rows, range: [0.4, rows.length + 0.6] } : {};
    chart.show(series(runs), { x: x || AXES[choice.axis], ...labels });
  });
  return runs;
}

const redraw = () => redrawn.forEach((draw) => draw());

// One toolbar for all charts of the page.
function addToolbar(before, all) {
  const bar = element("div", { class: "controls", role: "toolbar", "aria-label": "All charts" });
  before.before(bar);
  const solvers = new Map(all.flatMap((data) => data.solvers.map((solver) => [solver.name, solver])));
  for (const [name, solver] of solvers) {
    const button = element("button", { type: "button", "aria-pressed": "true", "data-solver": name }, bar);
    element("span", { class: "swatch", "aria-hidden": "true" }, button).style.background = inkOf(solver.colour);
    button.append(name);
    button.addEventListener("click", () => {
      if (!choice.hidden.delete(name)) choice.hidden.add(name);
      button.setAttribute("aria-pressed", String(!choice.hidden.has(name)));
      redraw();
    });
  }
  const select = (words, options, act) => {
    const label = element("label", {}, bar, `${words} `);
    const made = element("select", {}, label);
    for (const [value, shown] of options) element("option", { value }, made, shown);
    made.addEventListener("change", () => { act(made.value); redraw(); });
  };
  select("cost in", Object.keys(AXES).map((axis) => [axis, axis]), (value) => { choice.axis = value; });
  const targets = all[0].targets.filter((_, i) => i % 5 === 0);
  select("target", [["all", "all 31"], ...targets.map((target) => [target, `${formatNumber(100 * target)} %`])], (value) => { choice.target = value; });
  select("budget", [["1", "whole"], ...[0.5, 0.2, 0.1, 0.05, 0.02, 0.01].map((share) => [share, `${100 * share} %`])], (value) => { choice.budget = Number(value); });
  const label = element("label", {}, bar);
  const single = element("input", { type: "checkbox" }, label);
  label.append(" single runs");
  single.addEventListener("change", () => { choice.single = single.checked; redraw(); });
}
