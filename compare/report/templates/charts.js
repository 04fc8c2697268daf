"use strict";
// Charts of data in the page, with one choice of solvers for all of them.
const hidden = new Set();
const redrawn = [];
const redraw = () => redrawn.forEach((draw) => draw());

// Every point answers to the pointer, with its note or its numbers.
function read(series, data) {
  if (series.shape === "band") return series.points;
  return series.points.map(([x, y, note]) => [x, y, note ?? `${series.name}: ${formatNumber(y)} (${data.y}) at ${formatNumber(x)} (${data.x})`]);
}

function addCharts(figure, { charts }) {
  if (charts.length > 1) figure.classList.add("whole");
  const parent = element("div", { class: charts.length > 1 ? "curves" : "" }, figure.interactive);
  for (const data of charts) {
    const chart = new Chart(parent, { label: data.y || data.x, x: data.x, y: data.y, log: data.log, range: data.range,
      height: data.rows.length ? Math.max(70 + 30 * data.rows.length, 230) : 280 });
    chart.mark_x = data.mark;
    const names = data.rows.length ? data.rows.map((name, row) => [data.rows.length - row, name.slice(0, 24)]) : null;
    redrawn.push(() => {
      const shown = data.series.filter((series) => !hidden.has(series.name));
      chart.show(shown.map((series) => ({ ...series, points: read(series, data) })), { names });
    });
  }
}

// A button for each solver of the charts, above the first charts that are not named by rows.
function addToolbar(figures) {
  const plain = figures.filter(([, { charts }]) => charts.some((chart) => !chart.rows.length));
  const solvers = new Map(plain.flatMap(([, { charts }]) => charts.flatMap((chart) => chart.series.map((series) => [series.name, series]))));
  if (solvers.size < 2) return;
  const bar = element("div", { class: "controls", role: "toolbar", "aria-label": "Solvers in all charts" });
  const folded = plain[0][0].closest("details");
  if (folded) folded.querySelector("summary").after(bar);
  else plain[0][0].before(bar);
  for (const [name, solver] of solvers) {
    const button = element("button", { type: "button", "aria-pressed": "true", "data-solver": name }, bar);
    element("span", { class: "swatch", "aria-hidden": "true" }, button).style.background = inkOf(solver.colour);
    button.append(name);
    button.addEventListener("click", () => {
      if (!hidden.delete(name)) hidden.add(name);
      button.setAttribute("aria-pressed", String(!hidden.has(name)));
      redraw();
    });
  }
}
