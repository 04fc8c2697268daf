"use strict";
// Particle swarm, genetic algorithm and ant colony with the package's default settings, in the unit cube. Formulas and sources are
// those of metaheuristics/algorithms. A search has `points` to evaluate; `tell` takes them as [{ x, f, violation }] and moves on.

class Random {
  constructor(seed) {
    this.state = seed >>> 0;
  }

  // Uniform in [0, 1): mulberry32.
  uniform() {
    this.state = (this.state + 0x6d2b79f5) >>> 0;
    let bits = Math.imul(this.state ^ (this.state >>> 15), this.state | 1);
    bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  }

  // Standard normal: Box and Muller.
  normal() {
    return Math.sqrt(-2 * Math.log(1 - this.uniform())) * Math.cos(2 * Math.PI * this.uniform());
  }

  point(dimension) {
    return Array.from({ length: dimension }, () => this.uniform());
  }

  points(count, dimension) {
    return Array.from({ length: count }, () => this.point(dimension));
  }

  // The indices 0 to count - 1 in random order: Fisher and Yates.
  shuffle(count) {
    const order = [...Array(count).keys()];
    for (let i = count - 1; i > 0; i -= 1) {
      const j = Math.floor(this.uniform() * (i + 1));
      [order[i], order[j]] = [order[j], order[i]];
    }
    return order;
  }
}

const clip = (value, low = 0, high = 1) => Math.min(high, Math.max(low, value));

// Deb's feasibility rules: a negative number where a is better than b.
const compare = (a, b) => a.violation - b.violation || a.f - b.f;
const findBest = (points) => points.reduce((best, point) => (compare(point, best) < 0 ? point : best));

class ParticleSwarm {
  constructor(dimension, random) {
    Object.assign(this, { random, population: 50, inertia: 1, damping: 0.99, cognitive: 1.5, social: 2, limit: 0.1 });
    this.points = random.points(this.population, dimension);
    this.velocities = this.points.map((x) => x.map(() => 0));
  }

  tell(found) {
    this.own = found.map((point, i) => (this.own && compare(point, this.own[i]) >= 0 ? this.own[i] : point));
    const leader = findBest(this.own);
    this.points = this.points.map((x, i) => x.map((value, j) => this.move(value, i, j, leader.x[j])));
    this.inertia *= this.damping;
  }

  move(value, i, j, leader) {
    const toOwn = this.cognitive * this.random.uniform() * (this.own[i].x[j] - value);
    const toLeader = this.social * this.random.uniform() * (leader - value);
    const velocity = clip(this.inertia * this.velocities[i][j] + toOwn + toLeader, -this.limit, this.limit);
    const inside = clip(value + velocity);
    this.velocities[i][j] = inside === value + velocity ? velocity : -velocity;
    return inside;
  }
}

class GeneticAlgorithm {
  constructor(dimension, random) {
    Object.assign(this, { random, population: 50, tournament: 2, crossover: { index: 2, probability: 0.9, each: 0.5 },
      mutation: { index: 20, probability: 1 / dimension }, parents: [] });
    this.points = random.points(this.population, dimension);
  }

  tell(found) {
    this.parents = this.survive([...this.parents, ...found].sort(compare));
    const mating = this.select(), children = [];
    for (let i = 0; i < mating.length; i += 2) children.push(...this.cross(mating[i], mating[i + 1]));
    this.points = children.slice(0, this.population).map((x) => x.map((value) => this.mutate(value)));
  }

  // The best of parents and children; copies of a point only where there is nothing else.
  survive(sorted) {
    const isCopy = sorted.map(({ x }, i) => i > 0 && x.every((value, j) => value === sorted[i - 1].x[j]));
    return [...sorted.filter((_, i) => !isCopy[i]), ...sorted.filter((_, i) => isCopy[i])].slice(0, this.population);
  }

  // Winners of tournaments among the parents, which are sorted; each competes equally often.
  select() {
    const places = 2 * Math.ceil(this.population / 2), order = [];
    while (order.length < places * this.tournament) order.push(...this.random.shuffle(this.parents.length));
    return Array.from({ length: places }, (_, k) =>
      this.parents[Math.min(...order.slice(k * this.tournament, (k + 1) * this.tournament))].x);
  }

  // Simulated binary crossover of two parents.
  cross(a, b) {
    const first = [...a], second = [...b], { index, probability, each } = this.crossover;
    if (this.random.uniform() >= probability) return [first, second];
    for (let j = 0; j < a.length; j += 1) {
      const [u, choice, side] = this.random.point(3);
      const low = Math.min(a[j], b[j]), high = Math.max(a[j], b[j]), gap = high - low;
      if (choice >= each) continue;
      const spread = (room) => {
        const inner = u * (2 - (1 + (2 * room) / gap) ** -(index + 1));
        return (inner <= 1 ? inner : 1 / (2 - inner)) ** (1 / (index + 1));
      };
      const middle = (low + high) / 2, apart = gap > 1e-14;
      const lower = apart ? clip(middle - 0.5 * spread(low) * gap) : low;
      const upper = apart ? clip(middle + 0.5 * spread(1 - high) * gap) : high;
      [first[j], second[j]] = side < 0.5 ? [lower, upper] : [upper, lower];
    }
    return [first, second];
  }

  // Polynomial mutation.
  mutate(value) {
    const [choice, u] = this.random.point(2), power = this.mutation.index + 1;
    if (choice >= this.mutation.probability) return value;
    const down = u <= 0.5, room = down ? value : 1 - value, half = down ? u : 1 - u;
    const step = 1 - (2 * half + (1 - 2 * half) * (1 - room) ** power) ** (1 / power);
    return clip(value + (down ? -step : step));
  }
}

class AntColony {
  constructor(dimension, random) {
    Object.assign(this, { random, population: 30, size: 50, locality: 0.1, spread: 0.85, archive: [] });
    this.points = random.points(this.population, dimension);
  }

  tell(found) {
    this.archive = [...this.archive, ...found].sort(compare).slice(0, this.size);
    const weights = this.archive.map((_, rank) => Math.exp(-0.5 * (rank / (this.locality * this.archive.length)) ** 2));
    const total = weights.reduce((sum, weight) => sum + weight, 0);
    this.points = Array.from({ length: this.population }, () => this.sample(this.pick(weights, total).x));
  }

  pick(weights, total) {
    let left = this.random.uniform() * total;
    return this.archive[weights.findIndex((weight, k) => (left -= weight) < 0 || k === weights.length - 1)];
  }

  // A point around one of the archive, with deviations by its mean distance from the others.
  sample(centre) {
    return centre.map((value, j) => {
      const distance = this.archive.reduce((sum, { x }) => sum + Math.abs(x[j] - value), 0) / (this.archive.length - 1);
      return clip(value + this.spread * distance * this.random.normal());
    });
  }
}

const SEARCHES = [
  { name: "PSO", words: "particle swarm", colour: "#0072B2", line: "-", make: ParticleSwarm },
  { name: "GA", words: "genetic algorithm", colour: "#D55E00", line: "--", make: GeneticAlgorithm },
  { name: "ACO", words: "ant colony", colour: "#009E73", line: "-.", make: AntColony },
];
