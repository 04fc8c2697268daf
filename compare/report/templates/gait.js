"use strict";
// Gaits in 3-D on a canvas: play, scrub, turn; a second gait over the first one; a line in the charts over time.
const SIDES = { left: "#7A5CC0", right: "#A07D1C", trunk: "#000000" };
const SUPPORT = "#909090", ZMP = "#C03A3A";

const mix = (a, b, share) => (Array.isArray(a) ? a.map((value, i) => mix(value, b[i], share)) : a + (b - a) * share);

// The frame of a gait at a time, between two stored ones.
function frameAt(gait, time) {
  const last = gait.t.length - 1;
  const k = Math.max(0, Math.min(last - 1, gait.t.findIndex((t) => t > time) - 1 + (time >= gait.t[last] ? last + 1 : 0)));
  const next = Math.min(k + 1, last), span = gait.t[next] - gait.t[k];
  const share = span ? Math.min(1, Math.max(0, (time - gait.t[k]) / span)) : 0;
  const at = (values) => values && mix(values[k], values[next], share);
  const parts = (list) => list.map((part) => ({ side: part.side, points: at(part.points), supports: part.supports && part.supports[k] }));
  return { limbs: parts(gait.limbs), soles: parts(gait.soles), com: at(gait.com), zmp: at(gait.zmp) };
}

// Convex hull of points, seen from above (Andrew's monotone chain).
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  const half = (list) => {
    const chain = [];
    for (const point of list) {
      while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], point) <= 0) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

class GaitView {
  constructor(figure, data) {
    Object.assign(this, { gaits: data.gaits, time: 0, playing: !matchMedia("(prefers-reduced-motion: reduce)").matches,
      yaw: data.gaits[0].planar ? 0 : -0.6, pitch: data.gaits[0].planar ? 0 : 0.25, speed: data.speed ?? 1, over: data.over, visible: true });
    const parent = figure.interactive;
    this.canvas = element("canvas", { tabindex: "0", role: "img",
      "aria-label": "Gait in 3-D. Drag or use arrow keys to turn it, the space bar plays and pauses." }, parent);
    this.addControls(element("div", { class: "controls gait" }, parent));
    this.canvas.addEventListener("pointerdown", (event) => { this.grip = [event.clientX, event.clientY, this.yaw, this.pitch]; this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!this.grip) return;
      this.turn(this.grip[2] + (event.clientX - this.grip[0]) * 0.01, this.grip[3] + (event.clientY - this.grip[1]) * 0.01);
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => { this.grip = null; });
    this.canvas.addEventListener("keydown", (event) => this.press(event));
    // A line in each chart over time, which moves with the gait.
    this.cursors = [...figure.querySelectorAll("svg[data-time]")].map((svg) => {
      const [start, end, from, to] = svg.dataset.time.split(" ").map(Number);
      return { line: element("svg:line", { y1: 8, y2: svg.viewBox.baseVal.height - 40, class: "cursor" }, svg), at: (t) => start + ((t - from) / (to - from)) * (end - start) };
    });
    new IntersectionObserver((entries) => { this.visible = entries.at(-1).isIntersecting; }).observe(this.canvas); // the last is the latest
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.select();
    requestAnimationFrame((now) => this.tick(now));
  }

  addControls(bar) {
    this.button = element("button", { type: "button", class: "play" }, bar);
    this.button.addEventListener("click", () => this.play(!this.playing));
    const label = element("div", { class: "scrub" }, bar);
    this.slider = element("input", { type: "range", "aria-label": "time", min: "0", max: "1000", value: "0" }, label);
    this.slider.addEventListener("input", () => { this.play(false); this.time = (this.slider.value / 1000) * this.duration; this.draw(); });
    this.clock = element("output", {}, bar);
    const select = (words, options, chosen, act) => {
      const made = element("select", { "aria-label": words }, bar);
      for (const [value, shown] of options) element("option", { value }, made, shown);
      made.value = chosen;
      made.addEventListener("change", () => act(made.value));
      return made;
    };
    const names = this.gaits.map((gait, i) => [i, `with ${gait.name}`]).slice(1);
    this.second = names.length ? select("gait over it", [["", "alone"], ...names], this.over ? "1" : "", () => this.select()) : { value: "" };
    select("speed", [[1, "real speed"], [0.5, "1/2"], [0.25, "1/4"], [0.1, "1/10"]], String(this.speed), (value) => { this.speed = Number(value); });
    this.play(this.playing);
  }

  play(on) {
    this.playing = on;
    this.button.textContent = on ? "Pause" : "Play";
  }

  turn(yaw, pitch) {
    this.yaw = yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, pitch));
    this.draw();
  }

  press(event) {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (turns) this.turn(this.yaw + turns[0], this.pitch + turns[1]);
    else if (event.key === " ") this.play(!this.playing);
    else return;
    event.preventDefault();
  }

  select() {
    this.shown = [this.gaits[0], ...(this.second.value === "" ? [] : [this.gaits[this.second.value]])];
    this.duration = Math.max(...this.shown.map((gait) => gait.t[gait.t.length - 1]));
    const all = this.shown.flatMap((gait) => [...gait.limbs, ...gait.soles].flatMap((part) => part.points.flat()));
    this.box = [0, 1, 2].map((i) => [all.reduce((m, p) => Math.min(m, p[i]), Infinity), all.reduce((m, p) => Math.max(m, p[i]), -Infinity)]);
    this.draw();
  }

  tick(now) {
    const passed = now - (this.before || now);
    this.before = now;
    if (this.playing && this.visible) {
      this.time += passed * this.speed;
      if (this.time > this.duration + 300 * this.speed) this.time = 0;
      this.draw();
    }
    requestAnimationFrame((later) => this.tick(later));
  }

  draw() {
    const canvas = this.canvas, width = canvas.clientWidth, height = canvas.clientHeight, ratio = devicePixelRatio || 1;
    if (!width) return;
    const time = Math.min(this.time, this.duration);
    this.slider.value = String(Math.round((1000 * time) / this.duration));
    this.clock.value = `${(time / 1000).toFixed(2)} s`;
    for (const { line, at } of this.cursors) for (const end of ["x1", "x2"]) line.setAttribute(end, at(time / 1000));
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    this.ink = getComputedStyle(canvas).color;
    const frames = this.shown.map((gait) => frameAt(gait, time));
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const middle = this.box.map(([low, high]) => (low + high) / 2), [dx, dy, dz] = this.box.map(([low, high]) => high - low);
    const follow = dx > 2 * dz; // a long walk: the robot stays in the middle
    if (follow) middle[0] = frames[0].limbs[0].points[0][0];
    const long = follow ? 2 * dz : dx;
    const across = long * Math.abs(cy) + dy * Math.abs(sy), up = dz * cp + (long * Math.abs(sy) + dy * Math.abs(cy)) * Math.abs(sp);
    const scale = Math.min((0.95 * width) / across, (height - 50) / up);
    // Seen from the right: x to the right, z up; yaw turns about z, pitch tilts towards the viewer.
    this.project = (point) => {
      const [x, y, z] = point.map((value, i) => value - middle[i]);
      const right = x * cy - y * sy, deep = x * sy + y * cy;
      return [width / 2 + scale * right, height / 2 + 12 - scale * (z * cp + deep * sp)];
    };
    this.drawGround(pen);
    for (const i of this.shown.keys()) this.drawGait(pen, this.shown[i], frames[i], i === 0);
    this.drawLegend(pen);
    canvas.dataset.time = String(Math.round(time));
  }

  line(pen, points, colour, thickness, close = false) {
    pen.beginPath();
    points.map(this.project).forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    if (close) pen.closePath();
    pen.strokeStyle = colour === "#000000" || colour === "#404040" ? this.ink : colour;
    pen.lineWidth = thickness;
    pen.stroke();
  }

  drawLegend(pen) {
    const [first, second] = this.shown, point = (name) => first[name] && name;
    const entries = [["left leg", SIDES.left], ["right leg", SIDES.right], second && [`${second.name}, dashed`, second.colour],
      point("com") && ["centre of mass", "#000000"], point("zmp") && ["ZMP", ZMP], first.soles.length && point("zmp") && ["support", SUPPORT]];
    let x = 8, y = 16;
    pen.font = "12px system-ui, sans-serif";
    for (const [words, colour] of entries.filter(Boolean)) {
      const width = pen.measureText(words).width + 28;
      if (x + width > this.canvas.clientWidth && x > 8) [x, y] = [8, y + 16];
      pen.fillStyle = colour === "#000000" ? this.ink : colour;
      pen.fillRect(x, y - 8, 10, 8);
      pen.fillStyle = this.ink;
      pen.fillText(words, x + 14, y);
      x += width;
    }
  }

  drawGround(pen) {
    const [low, high] = this.box[1].map((y, i) => y + (i ? 40 : -40));
    const ground = this.shown[0].ground;
    pen.globalAlpha = 0.5;
    for (const y of [low, high]) this.line(pen, ground.map(([x, z]) => [x, y, z]), "#909090", 1);
    for (const [x, z] of ground) this.line(pen, [[x, low, z], [x, high, z]], "#909090", 1);
    pen.globalAlpha = 1;
  }

  drawGait(pen, gait, frame, first) {
    pen.globalAlpha = first ? 1 : 0.6;
    const loaded = frame.soles.filter((sole) => sole.supports).flatMap((sole) => sole.points);
    if (first && loaded.length > 2) {
      pen.beginPath();
      hull(loaded).map(this.project).forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      pen.closePath();
      pen.fillStyle = SUPPORT + "50";
      pen.fill();
    }
    pen.setLineDash(first ? [] : [5, 3]);
    for (const sole of frame.soles) {
      const colour = first ? SIDES[sole.side] : gait.colour, leg = frame.limbs.find((limb) => limb.side === sole.side);
      this.line(pen, sole.points, colour, 1.5, true);
      if (leg) for (const corner of sole.points) this.line(pen, [leg.points.at(-1), corner], colour, 1);
    }
    for (const limb of frame.limbs) this.line(pen, limb.points, first ? SIDES[limb.side] : gait.colour, first ? 3 : 2);
    pen.setLineDash([]);
    for (const [point, colour, size] of [[frame.com, this.ink, 4], [frame.zmp, ZMP, 5]]) {
      if (!point) continue;
      const [x, y] = this.project(point);
      pen.beginPath();
      pen.arc(x, y, size, 0, 7);
      pen.fillStyle = colour;
      pen.fill();
    }
    pen.globalAlpha = 1;
  }
}
