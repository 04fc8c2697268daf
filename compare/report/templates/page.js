"use strict";
// Figures whose data have an entry here become interactive; others, and all without JavaScript, stay drawings.
const charts = [];
const KINDS = {
  charts: (figure, data) => { addCharts(figure, data); charts.push([figure, data]); },
  gaits: (figure, data) => {
    if (data.gaits.some((gait) => gait.power || gait.margin)) figure.classList.add("whole");
    new GaitView(figure, data);
  },
};

function makeInteractive() {
  for (const figure of document.querySelectorAll("figure")) {
    const block = figure.querySelector("script");
    const data = block && JSON.parse(block.textContent);
    if (data && KINDS[data.kind]) {
      figure.interactive = element("div", { class: "interactive" });
      figure.querySelector("figcaption").before(figure.interactive);
      figure.querySelector(".drawing").hidden = true;
      KINDS[data.kind](figure, data);
    }
    addEnlarging(figure);
  }
  addToolbar(charts);
  redraw();
}

function addEnlarging(figure) {
  const button = element("button", { type: "button", class: "enlarge", "aria-pressed": "false", "aria-label": "Enlarge", title: "Enlarge" }, figure, "\u2922");
  const toggle = (large) => {
    figure.classList.toggle("large", large);
    button.setAttribute("aria-pressed", String(large));
    button.title = large ? "Close" : "Enlarge";
    document.body.classList.toggle("covered", large);
  };
  button.addEventListener("click", () => toggle(!figure.classList.contains("large")));
  figure.querySelector(".drawing").addEventListener("click", () => toggle(!figure.classList.contains("large")));
  figure.addEventListener("keydown", (event) => { if (event.key === "Escape") toggle(false); });
}

// What scrolls within itself can be reached by keyboard.
for (const wide of document.querySelectorAll(".wide")) if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
makeInteractive();
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
