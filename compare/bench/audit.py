"""Bias audit of a search: the same problems in other places of the box, and a problem that tells nothing.

A search must not gain from where the box is. Each problem is an instance whose best point is known, in a box of twice its width:
with the best point anywhere but in the middle (the reference), shifted to another such place or to the middle, mirrored, scaled,
rotated, and with permuted variables. Random search has the same distribution of results on all of these but the rotated one.
On noise, an objective without information, the final points of an unbiased search are anywhere in the box with equal probability.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

import metaheuristics
from compare.analysis.record_statistics import compute_a12, correct_by_holm
from metaheuristics.interface import Algorithm
from nlp_gait import gaitbench
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.instance import Instance
from nlp_gait.gaitbench.transform import AffineMap, rotate_pairs
from nlp_gait.progress import Progress, ignore_progress

INSTANCES = ("gb2:walk12-long:0", "gb2:walk12-stable:1", "gb2:walk12-long:2", "gb2:walk12-stable:3", "gb2:dsp-timed:0")
CENTRE = "shifted to the middle"
CHANGES = ("shifted", CENTRE, "mirrored", "scaled", "rotated", "permuted")
WIDTH = 2.0  # of the box, in units of the instance's
OFF_CENTRE = 0.15  # least distance of the best point from the middle in the reference, as a share of the box
ANGLE = math.radians(25.0)
NOISE_VARIABLES, NOISE_EVALUATIONS = 10, 300
MIDDLE = 0.1  # part of the range that is watched on noise
CLIPPED = 0.02  # share of the final points' variables on noise exactly at a bound that counts as clipping
SIGNIFICANT = 0.01  # p-value, Holm-corrected, below which a difference is real
LARGE = 0.64  # A12 of an effect that Vargha and Delaney call medium
EXCESS = 2.0  # times the share of a uniform distribution that counts as a bias


@dataclass(frozen=True, kw_only=True)
class Effect:
    """What one change of the problems does to a search."""

    change: str
    a12: float  #: probability that a run is better than one on the reference; 0.5 if they are alike
    p: float  #: of the rank-sum test stratified by instance, Holm-corrected over the changes

    @property
    def result(self) -> str:
        """Invariant, better or worse."""
        return "invariant" if self.p >= SIGNIFICANT else "better" if self.a12 > 0.5 else "worse"


@dataclass(frozen=True, kw_only=True)
class Audit:
    """What the audit of a search found."""

    algorithm: str
    effects: tuple[Effect, ...]
    edge: float  #: share of the final points' variables on noise that are exactly at a bound; 0 is unbiased
    middle: float  #: share within the middle 10 % of their ranges; 10 % is unbiased
    runs: int  #: on noise
    evaluations: int  #: of a run on a gait problem

    @property
    def biases(self) -> tuple[str, ...]:
        """Biases that were found, in words; empty for none."""
        from scipy.stats import binomtest

        centre = next(effect for effect in self.effects if effect.change == CENTRE)
        gain = f"gains where the optimum is in the middle of the box (A12 {centre.a12:.2f}, p {centre.p:.1g})"
        clip = f"clips: on noise, {100 * self.edge:.1f} % of the variables end exactly at a bound"
        lean = f"on noise, {100 * self.middle:.1f} % of the variables end in the middle 10 % of their ranges"
        values = self.runs * NOISE_VARIABLES
        test = binomtest(round(self.middle * values), values, MIDDLE, "greater")
        biases = {
            gain: centre.result == "better" and centre.a12 >= LARGE,
            clip: self.edge > CLIPPED,
            lean: self.middle > EXCESS * MIDDLE and test.pvalue < SIGNIFICANT,
        }
        return tuple(words for words, is_biased in biases.items() if is_biased)


class MovedProblem:
    """An instance in other variables y; outside its own box, the distance to it is a violation."""

    def __init__(self, instance: Instance, affine: AffineMap) -> None:
        """Take the box of the affine map."""
        self._instance, self._affine = instance, affine
        self.names, self.lower, self.upper = instance.names, affine.lower, affine.upper

    def __call__(self, Y: Array) -> tuple[Array, Array]:
        """Return costs (P,) and violations (P,) of points Y (P, n)."""
        z = self._affine.forward(Y)
        inside = np.clip(z, self._instance.lower, self._instance.upper)
        f, violation = self._instance(inside)
        return f, violation + np.abs(z - inside).sum(axis=1)


class Noise:
    """An objective that tells nothing: a hash of the point."""

    names = tuple(f"x{k}" for k in range(NOISE_VARIABLES))
    lower, upper = np.zeros(NOISE_VARIABLES), np.ones(NOISE_VARIABLES)

    def __init__(self, seed: int) -> None:
        """Make a noise of its own for each seed."""
        draw = np.random.default_rng(seed).integers(0, 2**63, NOISE_VARIABLES, dtype=np.uint64)
        self._factors = 2 * draw + np.uint64(1)

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return costs (P,) and no violation."""
        bits = (np.ascontiguousarray(X).view(np.uint64) * self._factors).sum(axis=1, dtype=np.uint64)
        bits = (bits ^ (bits >> np.uint64(31))) * np.uint64(0x9E3779B97F4A7C15)
        return (bits >> np.uint64(11)) / 2**53, np.zeros(len(X))


def audit_search(
    algorithm: Algorithm,
    *,
    runs: int = 10,
    evaluations: int = 1500,
    instances: Sequence[str] = INSTANCES,
    progress: Progress = ignore_progress,
) -> Audit:
    """Run a search on the changed problems and on noise.

    Args:
        algorithm: settings of the search.
        runs: on each changed instance; on noise ten times as many.
        evaluations: of a run on an instance.
        instances: generated ones, whose box is the unit cube.
        progress: called after each instance and after the runs on noise.
    """
    costs: dict[str, list[list[float]]] = {change: [] for change in ("reference", *CHANGES)}
    for number, id in enumerate(instances):
        instance, seeds = gaitbench.load(id), range(1000 * number, 1000 * number + runs)
        for change, rows in costs.items():
            moved = {seed: MovedProblem(instance, make_change(instance.best_x, change, seed)) for seed in seeds}
            rows.append([run_once(algorithm, problem, evaluations, seed) for seed, problem in moved.items()])
        progress(id)
    on_noise = partial(metaheuristics.minimize, algorithm=algorithm, evaluations=NOISE_EVALUATIONS)
    ends = np.array([on_noise(Noise(seed), seed=seed).x for seed in range(10 * runs)])
    progress("noise")
    tests = [compare_stratified(costs[change], costs["reference"]) for change in CHANGES]
    corrected = correct_by_holm([p for _, p in tests])
    return Audit(
        algorithm=algorithm.name,
        effects=tuple(
            Effect(change=change, a12=effect, p=float(p))
            for change, (effect, _), p in zip(CHANGES, tests, corrected, strict=True)
        ),
        edge=float(np.mean((ends == 0.0) | (ends == 1.0))),
        middle=float(np.mean(np.abs(ends - 0.5) < MIDDLE / 2)),
        runs=10 * runs,
        evaluations=evaluations,
    )


def run_once(algorithm: Algorithm, problem: MovedProblem, evaluations: int, seed: int) -> float:
    """Return the final cost of a run; any infeasible one is above all feasible ones."""
    result = metaheuristics.minimize(problem, algorithm, evaluations=evaluations, seed=seed)
    return result.objective if result.feasible else 1e6 + min(result.violation, 1e300)


def make_change(best: Array, change: str, seed: int) -> AffineMap:
    """Return the variables y of a changed instance of the unit cube, of which z = A y + b; a seed has one reference place."""
    n = len(best)
    rng = np.random.default_rng([seed, change == "shifted"])
    place = np.full(n, 0.5)
    if change != CENTRE:  # the box holds the whole unit cube: the place is between best / 2 and (best + 1) / 2
        while (near := np.abs(place - 0.5) < OFF_CENTRE).any():
            place = np.where(near, (best + rng.random(n)) / WIDTH, place)
    lower = best - place * WIDTH
    matrix, offset, upper = np.eye(n), np.zeros(n), lower + WIDTH
    generator = np.random.default_rng([seed, 2])
    if change == "mirrored":
        matrix, offset = -np.eye(n), lower + upper
    elif change == "scaled":
        factors = 10.0 ** generator.uniform(-3.0, 3.0, n)
        matrix, lower, upper = np.diag(1.0 / factors), lower * factors, upper * factors
    elif change == "rotated":
        order = generator.permutation(n)
        matrix = rotate_pairs(order.tolist(), [ANGLE] * (n // 2))
        offset = best - matrix @ best
    elif change == "permuted":
        order = generator.permutation(n)
        matrix, lower, upper = np.eye(n)[:, order], lower[order], upper[order]
    return AffineMap(matrix=matrix, offset=offset, lower=lower, upper=upper)


def compare_stratified(a: Sequence[Sequence[float]], b: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the mean A12 of lower costs in a, and the p-value of the rank-sum test over strata (van Elteren 1960, two-sided)."""
    from scipy.stats import norm, rankdata

    score, variance = 0.0, 0.0
    for x, y in zip(a, b, strict=True):
        ranks, m, n = rankdata([*x, *y]), len(x), len(y)
        score += (ranks[:m].sum() - m * (m + n + 1) / 2) / (m + n + 1)
        variance += m * n * float(np.var(ranks, ddof=1)) / (m + n) / (m + n + 1) ** 2
    effect = float(np.mean([compute_a12(x, y) for x, y in zip(a, b, strict=True)]))
    return effect, float(2 * norm.sf(abs(score) / math.sqrt(variance))) if variance > 0.0 else 1.0
