"use strict";
// Drawings zoom and pan; everything in them was drawn before.
function element(name, attributes = {}, parent = null, text = null) {
  const made = name.startsWith("svg:") ? document.createElementNS("http://www.w3.org/2000/svg", name.slice(4)) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

const inkOf = (colour) => (colour === "#000000" || colour === "#404040" ? "currentColor" : colour);

function makeZoomable(svg) {
  const whole = svg.viewBox.baseVal, [fullWidth, fullHeight] = [whole.width, whole.height];
  let view = [0, 0, fullWidth, fullHeight], grip = null;
  const show = ([x, y, width]) => {
    const share = Math.min(1, Math.max(0.05, width / fullWidth)), [w, h] = [fullWidth * share, fullHeight * share];
    view = [Math.min(Math.max(0, x), fullWidth - w), Math.min(Math.max(0, y), fullHeight - h), w, h];
    svg.setAttribute("viewBox", view.join(" "));
    svg.classList.toggle("zoomed", share < 1);
  };
  const zoom = (factor, px = view[0] + view[2] / 2, py = view[1] + view[3] / 2) =>
    show([px - (px - view[0]) * factor, py - (py - view[1]) * factor, view[2] * factor]);
  const keys = { "+": () => zoom(0.7), "=": () => zoom(0.7), "-": () => zoom(1 / 0.7), 0: () => show([0, 0, fullWidth]),
    ArrowLeft: () => show([view[0] - view[2] / 10, view[1], view[2]]), ArrowRight: () => show([view[0] + view[2] / 10, view[1], view[2]]),
    ArrowUp: () => show([view[0], view[1] - view[3] / 10, view[2]]), ArrowDown: () => show([view[0], view[1] + view[3] / 10, view[2]]) };
  svg.tabIndex = 0;
  svg.addEventListener("keydown", (event) => {
    if (!keys[event.key]) return;
    keys[event.key]();
    event.preventDefault();
  });
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && view[2] === fullWidth) return; // the page scrolls
    const box = svg.getBoundingClientRect();
    zoom(event.deltaY < 0 ? 0.8 : 1.25, view[0] + ((event.clientX - box.left) / box.width) * view[2], view[1] + ((event.clientY - box.top) / box.height) * view[3]);
    event.preventDefault();
  }, { passive: false });
  svg.addEventListener("pointerdown", (event) => { grip = [event.clientX, event.clientY, ...view]; });
  svg.addEventListener("pointermove", (event) => {
    if (!grip || view[2] === fullWidth || !event.buttons) return;
    const pixels = view[2] / svg.clientWidth;
    show([grip[2] - (event.clientX - grip[0]) * pixels, grip[3] - (event.clientY - grip[1]) * pixels, view[2]]);
  });
  svg.addEventListener("dblclick", () => (view[2] < fullWidth ? show([0, 0, fullWidth]) : zoom(0.5)));
}
