"use strict";
// A chart in SVG: axes, series, hover, zoom by dragging, and the same by keyboard. Its text keeps its size on any screen.
const SVG = "http://www.w3.org/2000/svg";
const DASHES = { "-": "", "--": "6 4", ":": "2 3", "-.": "7 3 2 3" };

function element(name, attributes = {}, parent = null, text = null) {
  const made = name.startsWith("svg:") ? document.createElementNS(SVG, name.slice(4)) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

const inkOf = (colour) => (colour === "#000000" || colour === "#404040" ? "currentColor" : colour);

function formatNumber(value) {
  if (value === 0 || (Math.abs(value) >= 0.01 && Math.abs(value) < 1e6)) return String(Number(value.toPrecision(5)));
  return value.toExponential(2);
}

// series: [{ name, colour, line, shape: "line" | "step" | "points" | "band", points: [[x, y, words], ...] }]; a band's points are
// [x, low, high]. Only series with words answer to the pointer.
class Chart {
  constructor(parent, { label, x, y, log = [false, false], height = 280, range = null }) {
    Object.assign(this, { x, y, log, height, range, names: null, series: [], view: null, cursor: null, chosen: null });
    this.box = element("div", { class: "chart" }, parent);
    this.svg = element("svg:svg", { tabindex: "0", role: "group", "aria-roledescription": "chart",
      "aria-label": `${label}. Arrow keys read values, plus and minus zoom, 0 shows all.` }, this.box);
    const below = element("div", { class: "below" }, this.box);
    this.note = element("output", { class: "note", "aria-live": "polite" }, below);
    for (const [sign, words, act] of [
      ["+", "Zoom in", () => this.zoom(0.5)], ["\u2212", "Zoom out", () => this.zoom(2)], ["\u21ba", "Show all", () => this.reset()],
    ]) element("button", { type: "button", "aria-label": `${words}: ${label}`, title: words }, below, sign).addEventListener("click", act);
    this.svg.addEventListener("pointermove", (event) => this.point(event));
    this.svg.addEventListener("pointerleave", () => { if (!this.drag) this.choose(null); });
    this.svg.addEventListener("pointerdown", (event) => { this.drag = this.place(event); });
    this.svg.addEventListener("pointerup", (event) => this.release(event));
    this.svg.addEventListener("pointercancel", () => { this.drag = null; this.draw(); });
    this.svg.addEventListener("dblclick", () => this.reset());
    this.svg.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.draw()).observe(this.box);
  }

  show(series, labels = {}) {
    Object.assign(this, labels, { series });
    this.chosen = null;
    this.draw();
  }

  // The extent of all data, in logarithms where the axis has them.
  extent() {
    const ends = [[Infinity, -Infinity], [Infinity, -Infinity]];
    for (const { points, shape } of this.series)
      for (const point of points)
        [[point[0]], shape === "band" ? [point[1], point[2]] : [point[1]]].forEach((values, axis) => values.forEach((value) => {
          if (!Number.isFinite(value) || (this.log[axis] && value <= 0)) return;
          const at = this.log[axis] ? Math.log10(value) : value;
          ends[axis] = [Math.min(ends[axis][0], at), Math.max(ends[axis][1], at)];
        }));
    return ends.map(([low, high], axis) => {
      if (axis && this.range) return this.range;
      if (low > high) return [0, 1];
      const room = 0.03 * (high - low) || 0.5 * (this.log[axis] ? 1 : Math.abs(high) || 1);
      return [low - room, high + room];
    });
  }

  draw() {
    const width = this.box.clientWidth;
    if (!width) return;
    const frame = { left: this.names ? 24 + 7 * Math.max(3, ...this.names.map(([, name]) => Math.min(name.length, 24))) : 56, right: width - 8, top: 8, bottom: this.height - 40 };
    const ends = this.view || this.extent();
    this.ends = ends;
    this.frame = frame;
    const across = (at) => frame.left + ((at - ends[0][0]) / (ends[0][1] - ends[0][0])) * (frame.right - frame.left);
    const up = (at) => frame.bottom - ((at - ends[1][0]) / (ends[1][1] - ends[1][0])) * (frame.bottom - frame.top);
    const scaled = (value, axis) => (this.log[axis] ? Math.log10(Math.max(value, 1e-300)) : value);
    this.pixel = (point, y = point[1]) => [across(scaled(point[0], 0)), up(scaled(y, 1))];
    this.svg.replaceChildren();
    this.svg.setAttribute("viewBox", `0 0 ${width} ${this.height}`);
    this.svg.style.height = `${this.height}px`;
    const clip = `clip-${Chart.count = (Chart.count || 0) + 1}`;
    const area = element("svg:clipPath", { id: clip }, this.svg);
    const size = { x: frame.left, y: frame.top, width: Math.max(0, frame.right - frame.left), height: frame.bottom - frame.top };
    element("svg:rect", size, area);
    this.drawAxes(width, across, up);
    if (this.mark_x) {
      const [x] = this.pixel([this.mark_x, 1]);
      element("svg:line", { x1: x, x2: x, y1: frame.top, y2: frame.bottom, class: "limit" }, this.svg);
    }
    const inside = element("svg:g", { "clip-path": `url(#${clip})` }, this.svg);
    for (const one of this.series) this.drawSeries(one, inside);
    this.over = element("svg:g", { "pointer-events": "none" }, this.svg);
    this.mark();
  }

  drawAxes(width, across, up) {
    const { left, right, top, bottom } = this.frame;
    for (const [axis, place] of [[0, across], [1, up]])
      for (const [at, words] of axis && this.names ? this.names : ticks(this.ends[axis], this.log[axis], axis ? 6 : Math.max(3, width / 110))) {
        const p = place(at);
        const line = axis ? { x1: left, x2: right, y1: p, y2: p } : { x1: p, x2: p, y1: top, y2: bottom };
        element("svg:line", { ...line, class: "grid" }, this.svg);
        const where = axis ? { x: left - 5, y: p + 4, "text-anchor": "end" } : { x: p, y: bottom + 15, "text-anchor": "middle" };
        element("svg:text", where, this.svg, words);
      }
    element("svg:text", { x: (left + right) / 2, y: this.height - 6, "text-anchor": "middle" }, this.svg, this.x);
    element("svg:text", { transform: `translate(12 ${(top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, this.svg, this.y);
  }

  drawSeries({ name, colour, line, shape, points, faint }, parent) {
    const look = { stroke: inkOf(colour), fill: "none", "data-series": name, opacity: faint ? 0.35 : 1 };
    if (shape === "points")
      for (const point of points) {
        const [cx, cy] = this.pixel(point);
        element("svg:circle", { ...look, cx, cy, r: 4, "stroke-width": 1.5 }, parent);
      }
    else if (shape === "band" && points.length) {
      const path = [...points.map((p) => this.pixel(p, p[2])), ...points.map((p) => this.pixel(p)).reverse()];
      element("svg:path", { fill: inkOf(colour), opacity: 0.15, "data-series": name, d: `M${path.map((p) => p.join(" ")).join("L")}Z` }, parent);
    } else if (points.length) {
      let path = "";
      points.forEach((point, i) => {
        const [x, y] = this.pixel(point);
        path += i === 0 ? `M${x} ${y}` : shape === "step" ? `H${x}V${y}` : `L${x} ${y}`;
      });
      element("svg:path", { ...look, "stroke-width": faint ? 1 : 2, "stroke-dasharray": DASHES[line] || "", d: path }, parent);
    }
  }

  place(event) {
    const box = this.svg.getBoundingClientRect();
    return [((event.clientX - box.left) / box.width) * this.box.clientWidth, ((event.clientY - box.top) / box.height) * this.height];
  }

  point(event) {
    const at = this.place(event);
    if (this.drag) { this.mark(at); return; }
    let best = null;
    this.series.forEach((one, s) => one.shape !== "band" && one.points.forEach((point, i) => {
      if (point[2] === undefined) return;
      const [x, y] = this.pixel(point);
      const away = Math.hypot(x - at[0], y - at[1]);
      if (!best || away < best.away) best = { away, s, i };
    }));
    this.choose(best && best.away < 60 ? [best.s, best.i] : null);
  }

  choose(chosen) {
    this.chosen = chosen;
    this.mark();
  }

  // The chosen point, the time of a playback, and the rectangle being dragged.
  mark(corner = null) {
    if (!this.over) return;
    this.over.replaceChildren();
    const { top, bottom } = this.frame;
    if (this.cursor !== null) {
      const [x] = this.pixel([this.cursor, 1]);
      element("svg:line", { x1: x, x2: x, y1: top, y2: bottom, class: "cursor" }, this.over);
    }
    if (this.drag && corner) {
      const [a, b] = [this.drag, corner];
      element("svg:rect", { x: Math.min(a[0], b[0]), y: Math.min(a[1], b[1]), width: Math.abs(a[0] - b[0]),
        height: Math.abs(a[1] - b[1]), class: "selection" }, this.over);
    }
    const one = this.chosen && this.series[this.chosen[0]];
    const point = one && one.points[this.chosen[1]];
    this.note.value = point ? point[2] : "";
    if (!point) return;
    const [cx, cy] = this.pixel(point);
    element("svg:circle", { cx, cy, r: 6, fill: "none", stroke: inkOf(one.colour), "stroke-width": 2.5 }, this.over);
  }

  value(pixel, axis) {
    const { left, right, top, bottom } = this.frame;
    const [low, high] = this.ends[axis];
    return axis ? low + ((bottom - pixel) / (bottom - top)) * (high - low) : low + ((pixel - left) / (right - left)) * (high - low);
  }

  release(event) {
    const [from, to] = [this.drag, this.place(event)];
    this.drag = null;
    if (from && Math.abs(from[0] - to[0]) > 8 && Math.abs(from[1] - to[1]) > 8)
      this.view = [0, 1].map((axis) => [from, to].map((p) => this.value(p[axis], axis)).sort((a, b) => a - b));
    this.draw();
  }

  zoom(factor) {
    this.view = this.ends.map(([low, high]) => {
      const [middle, half] = [(low + high) / 2, ((high - low) / 2) * factor];
      return [middle - half, middle + half];
    });
    this.draw();
  }

  reset() {
    this.view = null;
    this.draw();
  }

  press(event) {
    const words = (s) => (this.series[s].shape === "band" ? [] : [...this.series[s].points.keys()].filter((i) => this.series[s].points[i][2] !== undefined));
    const readable = [...this.series.keys()].filter((s) => words(s).length);
    const [s, i] = this.chosen || [readable[0], null];
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key], turn = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "+" || event.key === "=") this.zoom(0.5);
    else if (event.key === "-") this.zoom(2);
    else if (event.key === "0") this.reset();
    else if (step && readable.length) this.choose([s, words(s)[i === null ? 0 : Math.min(Math.max(words(s).indexOf(i) + step, 0), words(s).length - 1)]]);
    else if (turn && readable.length) {
      const other = readable[(readable.indexOf(s) + turn + readable.length) % readable.length];
      this.choose([other, words(other)[0]]);
    }
    else return;
    event.preventDefault();
  }
}

function ticks([low, high], log, most) {
  const found = [];
  if (log && high - low > 0.8) {
    const step = Math.max(1, Math.ceil((high - low) / most));
    for (let power = Math.ceil(low); power <= high; power += step)
      found.push([power, power > -3 && power < 4 ? String(Number((10 ** power).toPrecision(3))) : `1e${power}`]);
    if (high - low < 2.5 && step === 1)
      for (const factor of [2, 5])
        for (let power = Math.floor(low); power <= high; power += 1) {
          const at = power + Math.log10(factor);
          if (at > low && at < high) found.push([at, formatNumber(factor * 10 ** power)]);
        }
    return found;
  }
  const raw = (high - low) / most, unit = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * unit).find((k) => k >= raw);
  for (let at = Math.ceil(low / step) * step; at <= high; at += step)
    found.push([at, formatNumber(log ? 10 ** at : Number(at.toPrecision(10)))]);
  return found;
}
