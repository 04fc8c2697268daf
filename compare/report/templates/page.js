"use strict";
// Without this script all drawings are shown; with it they zoom, and gaits move.
for (const figure of document.querySelectorAll("figure")) {
  const block = figure.querySelector("script");
  for (const svg of figure.querySelectorAll("svg")) makeZoomable(svg);
  if (block) {
    figure.interactive = element("div", { class: "interactive" });
    figure.prepend(figure.interactive);
    new GaitView(figure, JSON.parse(block.textContent));
    figure.querySelector(".poses").hidden = true;
  }
}

// What scrolls within itself can be reached by keyboard, and has a shade where it continues.
for (const wide of document.querySelectorAll(".wide")) {
  const shade = () => wide.classList.toggle("more", wide.scrollWidth - wide.clientWidth - wide.scrollLeft > 2);
  if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
  wide.addEventListener("scroll", shade);
  new ResizeObserver(shade).observe(wide);
}
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
