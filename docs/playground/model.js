"use strict";
// The problem as WebAssembly: the C++ that `nlp-gait export --to objective` writes, and the gait of the same symbolic model.
const MOST_POINTS = 256; // evaluated in one call
const DOUBLE = 8, POINTER = 4; // bytes

class Model {
  // facts: what the page says about the problem, see docs/pages/playground.py; wasm: bytes of the module.
  static async load(facts, wasm) {
    const { instance } = await WebAssembly.instantiate(wasm);
    return new Model(facts, instance.exports);
  }

  constructor(facts, exports) {
    Object.assign(this, { facts, exports, variables: facts.variables, optimum: facts.optimum });
    exports._initialize();
    const n = this.variables.length, { frames, columns } = facts.gait;
    const numbers = (count) => exports.malloc(count * DOUBLE);
    this.memory = { points: numbers(MOST_POINTS * n), f: numbers(MOST_POINTS), violation: numbers(MOST_POINTS), rows: numbers(facts.rows.length),
      x: numbers(n), phases: numbers(frames), frames: numbers(frames * columns), inputs: exports.malloc(2 * POINTER),
      shared: exports.malloc(2), outputs: exports.malloc(POINTER), work: exports.malloc(Number(exports.nlp_gait_rows_memory())) };
    // All frames of a gait have the same x, each has its own phase.
    const { inputs, outputs, shared } = this.memory;
    new Uint32Array(exports.memory.buffer, inputs, 2).set([this.memory.x, this.memory.phases]);
    new Uint32Array(exports.memory.buffer, outputs, 1).set([this.memory.frames]);
    new Uint8Array(exports.memory.buffer, shared, 2).set([1, 0]);
    this.view("phases", frames).set(Array.from({ length: frames }, (_, k) => k / (frames - 1)));
  }

  // Numbers in the module's memory; made for each use, as a growing memory detaches older ones.
  view(name, count) {
    return new Float64Array(this.exports.memory.buffer, this.memory[name], count);
  }

  // A point within the bounds from one of the unit cube.
  scale(unit) {
    return this.variables.map(({ lower, upper }, j) => Math.min(upper, Math.max(lower, lower + unit[j] * (upper - lower))));
  }

  // Objectives [W] and violations of points, each [{ x, f, violation }]; a point is feasible where its violation is zero.
  evaluate(points) {
    const found = [];
    for (let first = 0; first < points.length; first += MOST_POINTS) {
      const part = points.slice(first, first + MOST_POINTS);
      this.call(part, 0);
      const f = this.view("f", part.length), violation = this.view("violation", part.length);
      part.forEach((x, k) => found.push({ x, f: f[k], violation: violation[k] }));
    }
    return found;
  }

  // One-sided constraints at a point, met where <= 0, in units of each one's scale; facts.rows has their names.
  rows(x) {
    this.call([x], this.memory.rows);
    return [...this.view("rows", this.facts.rows.length)];
  }

  call(points, rows) {
    this.view("points", points.length * this.variables.length).set(points.flat());
    const { points: at, f, violation } = this.memory;
    if (this.exports[`${this.facts.prefix}_evaluate`](at, BigInt(points.length), f, violation, rows)) throw new Error("the module is out of memory");
  }

  // The gait at a point, as GaitView draws it: lengths in mm, times in ms.
  gait(x, name, colour) {
    const { frames, columns, lines, feet, duration } = this.facts.gait;
    const { inputs, shared, outputs, work } = this.memory;
    this.view("x", x.length).set(x);
    if (this.exports.nlp_gait_evaluate_rows(inputs, shared, outputs, BigInt(frames), work)) throw new Error("the module cannot compute the gait");
    const rows = Array.from({ length: frames }, (_, k) => [...this.view("frames", frames * columns).subarray(k * columns, (k + 1) * columns)]);
    const places = rows.map((row) => Array.from({ length: (columns - 3) / 3 }, (_, k) => row.slice(3 * k, 3 * k + 3).map((metres) => 1000 * metres)));
    let next = 0;
    const limbs = lines.map(({ side, count }) => ({ side, points: places.map((frame) => frame.slice(next, next + count)), next: (next += count) }));
    const soles = feet.map(({ side, outline }, i) => ({ side,
      points: places.map((frame) => outline.map((corner) => corner.map((length, axis) => 1000 * length + frame[next + i][axis]))),
      supports: places.map((frame) => (frame[next + i][2] <= this.facts.gait.on_ground_mm ? 1 : 0)) }));
    const com = places.map((frame) => frame[next + feet.length]);
    const zmp = rows.map((row) => [1000 * row[columns - 3], 1000 * row[columns - 2], 0]);
    const along = soles.flatMap((sole) => sole.points.flatMap((corners) => corners.map(([forward]) => forward)));
    return { name, colour, planar: false, t: rows.map((_, k) => (1000 * x[duration] * k) / (frames - 1)), limbs, soles, com, zmp,
      ground: [[Math.min(...along) - 50, 0], [Math.max(...along) + 50, 0]],
      power: rows.map((row) => row[columns - 1]), margin: zmp.map((point, k) => measureMargin(point, soles, k)) };
  }
}

// Distance of the zero-moment point from the nearest edge of the support polygon [mm], negative outside. A foot that only touches
// the ground at the first or the last instant carries no load there.
function measureMargin(zmp, soles, k) {
  const bearing = Math.min(Math.max(k, 1), soles[0].supports.length - 2);
  const corners = hull(soles.filter((sole) => sole.supports[bearing]).flatMap((sole) => sole.points[k]));
  const edges = corners.map((from, i) => [from, corners[(i + 1) % corners.length]]);
  const inside = edges.map(([[ax, ay], [bx, by]]) => ((bx - ax) * (zmp[1] - ay) - (by - ay) * (zmp[0] - ax)) / Math.hypot(bx - ax, by - ay));
  if (inside.every((distance) => distance >= 0)) return Math.min(...inside);
  return -Math.min(...edges.map(([[ax, ay], [bx, by]]) => {
    const share = ((zmp[0] - ax) * (bx - ax) + (zmp[1] - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2);
    const along = Math.min(1, Math.max(0, share));
    return Math.hypot(zmp[0] - ax - along * (bx - ax), zmp[1] - ay - along * (by - ay));
  }));
}
