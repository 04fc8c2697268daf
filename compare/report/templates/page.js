"use strict";
// Figures that have data become charts and gaits in 3-D; every figure can be enlarged. Without JavaScript the drawings stay.
function makeInteractive() {
  const all = [];
  for (const figure of document.querySelectorAll("figure")) {
    const block = figure.querySelector("script");
    if (block) {
      const data = JSON.parse(block.textContent);
      figure.interactive = element("div", { class: "interactive" });
      figure.querySelector("figcaption").before(figure.interactive);
      figure.querySelector(".drawing").hidden = true;
      if (data.kind === "gaits") {
        figure.classList.add("whole");
        new GaitView(figure, data);
      } else all.push([figure, addRuns(figure, data)]);
    }
    addEnlarging(figure);
  }
  if (all.length) addToolbar(all[0][0].closest("section") || all[0][0], all.map(([, data]) => data));
  redraw();
}

function addEnlarging(figure) {
  const button = element("button", { type: "button", class: "enlarge", "aria-pressed": "false" }, figure, "Enlarge");
  const toggle = (large) => {
    figure.classList.toggle("large", large);
    button.setAttribute("aria-pressed", String(large));
    button.textContent = large ? "Close" : "Enlarge";
    document.body.classList.toggle("covered", large);
  };
  button.addEventListener("click", () => toggle(!figure.classList.contains("large")));
  figure.querySelector(".drawing").addEventListener("click", () => toggle(!figure.classList.contains("large")));
  figure.addEventListener("keydown", (event) => { if (event.key === "Escape") toggle(false); });
}

// What scrolls within itself can be reached by keyboard.
for (const wide of document.querySelectorAll(".wide")) if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
makeInteractive();
