"""Fronts that evolutionary searches find, how near they come to the true front, and whether any of their points betters it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.questions.pareto.competing import CompetingObjective
from compare.questions.pareto.front import FrontPoint, select_front, solve_point
from compare.questions.question import Work
from metaheuristics.interface import Array
from metaheuristics.multi_objective import FrontAlgorithm, make_front_algorithm, minimize_many
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.progress import Progress, ignore_progress

# Reference point of the hypervolume, with the ranges of the true front as 1: a tenth beyond its worst values.
REFERENCE = 1.1
MOST_CHALLENGES = 1000


class Scale:
    """Power and criterion as numbers to be minimised, 0 at the best and 1 at the worst value on the true front."""

    def __init__(self, front: Sequence[FrontPoint]) -> None:
        powers, values = ([getattr(p, key) for p in front] for key in ("power_W", "value"))
        self.least_power, self.power_range = min(powers), max(powers) - min(powers)
        self.largest, self.range = max(values), max(values) - min(values)

    def __call__(self, values: Array, powers: Array) -> Array:
        """Return (P, 2) from criterion (P,) and power (P,)."""
        return np.column_stack([(powers - self.least_power) / self.power_range, (self.largest - values) / self.range])

    def undo(self, F: Array) -> tuple[Array, Array]:
        """Return criterion (P,) and power (P,) of (P, 2)."""
        return self.largest - self.range * F[:, 1], self.least_power + self.power_range * F[:, 0]


class PowerAndCompeting:
    """The compiled objective with a criterion next to the power; see ``metaheuristics.multi_objective.ManyObjectives``."""

    def __init__(self, objective: CompiledObjective, criterion: CompetingObjective, scale: Scale) -> None:
        self.names, self.lower, self.upper, self.count = objective.names, objective.lower, objective.upper, 2
        self._objective, self._criterion, self._scale = objective, criterion, scale

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return objectives (P, 2) and violations (P,)."""
        power, violation = self._objective(X)
        return self._scale(self._criterion.evaluate_many(self._objective, X), power), violation


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchFront:
    """Feasible nondominated points of one run after a budget."""

    solver: str  #: name of the search
    run: int  #: number
    budget: int  #: evaluations allowed
    values: Array  #: (k,) criterion
    powers: Array  #: (k,) [W]
    X: Array  #: (k, n)


def run_searches(
    problem: GaitProblem,
    criterion: CompetingObjective,
    scale: Scale,
    *,
    searches: Mapping[str, Sequence[int]],
    runs: int,
    seed: int,
    work: Work,
) -> list[SearchFront]:
    """Return the fronts of all runs on a problem without the criterion's demand; each finished run is stored.

    The scale keeps either objective from dominating an algorithm's distances. ``searches`` maps algorithms to rising numbers of
    evaluations; run k uses seed + k.

    Raises:
        SearchError: an unknown algorithm, or a budget that is not allowed.
    """
    compiled = PowerAndCompeting(compile_objective(problem), criterion, scale)
    ranges = [scale.least_power, scale.power_range, scale.largest, scale.range]
    identity = {**fingerprint(problem), "criterion": criterion.name, "scale": ranges}
    fronts = []
    for name, budgets in searches.items():
        algorithm = make_front_algorithm(name)
        for run in range(runs):
            inputs = {**identity, "budgets": list(budgets), "algorithm": repr(algorithm), "seed": seed + run}
            compute = partial(_run_search, compiled, algorithm, budgets, seed + run)
            snapshots = work.store.compute(f"{name.lower()}-{run}-{{key}}", inputs, compute)
            for budget, snapshot in zip(budgets, snapshots, strict=True):
                values, powers = scale.undo(np.array(snapshot["F"]).reshape(-1, 2))
                X = np.array(snapshot["X"]).reshape(-1, len(problem.names))
                fronts.append(SearchFront(solver=name, run=run, budget=budget, values=values, powers=powers, X=X))
            work.progress(f"{name}, run {run}")
    return fronts


def _run_search(
    compiled: PowerAndCompeting, algorithm: FrontAlgorithm, budgets: Sequence[int], seed: int
) -> list[dict[str, Any]]:
    """What one run has found after each budget, as plain data."""
    snapshots = minimize_many(compiled, algorithm, evaluations=budgets, seed=seed)
    return [{"F": s.F.tolist(), "X": s.X.tolist()} for s in snapshots]


def select_best(fronts: Iterable[tuple[Array, Array, Array]]) -> list[FrontPoint]:
    """Return the nondominated points of all runs, given by criterion (k,), power (k,) and points (k, n).

    If none of these betters the true front, no point does.
    """
    points = [
        FrontPoint(demanded=v, value=v, power_W=w, violation=0.0, x=tuple(x))
        for values, powers, X in fronts
        for v, w, x in zip(values.tolist(), powers.tolist(), X.tolist(), strict=True)
    ]
    return select_front(points)


@dataclass(frozen=True, kw_only=True)
class Quality:
    """All runs of one search with one budget; medians with the extremes over runs."""

    solver: str  #: name of the search
    budget: int  #: evaluations
    runs: int  #: number
    empty: int  #: runs without a feasible point; they count as hypervolume 0 and are left out of what follows
    #: (least, median, greatest) share of the true front's, with both ranges as 1 and the reference 1.1
    hypervolume: tuple[float, float, float]
    #: (least, median, greatest) mean distance from a point of the true front to the nearest one found
    igd: tuple[float, float, float] | None
    #: (least, median, greatest) over runs of the mean power above the true front's at an equal criterion, relative
    gap: tuple[float, float, float] | None


@dataclass(frozen=True, kw_only=True)
class Challenge:
    """The best points of all searches, compared with the least power at their own criterion."""

    points: int  #: number of nondominated points
    solved: int  #: for how many of these, the lowest, the least power was solved for
    infeasible: int  #: how many of these the exact functions find infeasible
    #: smallest power above the least one at an equal criterion, relative; negative if a point is better
    least_gap: float
    median_gap: float  #: likewise
    moved: int  #: number of points at which the front itself was improved by more than a millionth
    front: tuple[FrontPoint, ...]  #: the front with all solved points


def compute_qualities(front: Sequence[FrontPoint], fronts: Sequence[SearchFront]) -> list[Quality]:
    """Return a row for each search and budget."""
    if not fronts:
        return []
    from pymoo.indicators.hv import HV
    from pymoo.indicators.igd import IGD

    scale = Scale(front)
    values, powers = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
    true = scale(values, powers)
    hypervolume, distance = HV(ref_point=np.full(2, REFERENCE)), IGD(true)
    whole = float(hypervolume(true))
    rows = []
    for solver, budget in dict.fromkeys((f.solver, f.budget) for f in fronts):
        chosen = [f for f in fronts if (f.solver, f.budget) == (solver, budget)]
        found = [f for f in chosen if len(f.values)]
        scaled = [scale(f.values, f.powers) for f in found]
        shares = [float(hypervolume(F)) / whole for F in scaled] + [0.0] * (len(chosen) - len(found))
        above = [float(np.mean(f.powers / np.interp(f.values, values, powers) - 1.0)) for f in found]
        rows.append(
            Quality(
                solver=solver,
                budget=budget,
                runs=len(chosen),
                empty=len(chosen) - len(found),
                hypervolume=_compute_spread(shares),
                igd=_compute_spread([float(distance(F)) for F in scaled]) if found else None,
                gap=_compute_spread(above) if found else None,
            )
        )
    return rows


def challenge_front(
    problem: GaitProblem,
    criterion: CompetingObjective,
    front: Sequence[FrontPoint],
    points: Sequence[FrontPoint],
    solver: Solver | None = None,
    progress: Progress = ignore_progress,
) -> Challenge:
    """Find the least power at the criterion of each point, from the point itself and from the nearest point of the front.

    Of more than a thousand points, those are taken that are lowest above the straight lines between the front's points. The
    problem has no demand on the criterion; the solver is IPOPT with its defaults if it is None.
    """
    values, powers = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
    lowest = sorted(points, key=lambda p: p.power_W / float(np.interp(p.value, values, powers)))[:MOST_CHALLENGES]
    solved: list[FrontPoint] = []
    gaps: list[float] = []
    infeasible = moved = 0
    for point in lowest:
        exact = build_exact_model(problem).at(point.x, problem.p)
        if not exact.violation <= FEASIBILITY_TOLERANCE:
            infeasible += 1
            continue
        near = front[int(np.argmin(np.abs(values - point.value)))]
        at = min(point.value, front[-1].value)
        of_front, of_search = (
            solve_point(problem, criterion, at, np.array(start.x), solver) for start in (near, point)
        )
        candidates = [p for p in (of_front, of_search) if p is not None]
        if not candidates:
            gaps.append(exact.cost / near.power_W - 1.0 if near.value >= point.value else -np.inf)
            continue
        best = min(candidates, key=lambda p: p.power_W)
        moved += of_front is None or best.power_W < of_front.power_W * (1.0 - 1e-6)
        solved.append(best)
        gaps.append(exact.cost / best.power_W - 1.0)
        progress(f"{criterion.name} {point.value:.5g} {criterion.unit}")
    return Challenge(
        points=len(points),
        solved=len(solved),
        infeasible=infeasible,
        least_gap=min(gaps, default=np.inf),
        median_gap=float(np.median(gaps)) if gaps else np.inf,
        moved=moved,
        front=tuple(select_front([*front, *solved])),
    )


def _compute_spread(numbers: Sequence[float]) -> tuple[float, float, float]:
    sample: Array = np.array(numbers)
    return float(sample.min()), float(np.median(sample)), float(sample.max())
