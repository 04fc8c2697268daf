"""How searches' fronts compare with the true one, and whether any of their points betters it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.questions.pareto.competing import CompetingObjective
from compare.questions.pareto.front import FrontPoint, nondominated, point_at
from compare.questions.pareto.search import REFERENCE, Scale, SearchFront
from metaheuristics.array import Array
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.progress import Progress, ignore_progress

MOST_CHALLENGES = 1000


@dataclass(frozen=True, kw_only=True)
class Quality:
    """All runs of one algorithm at one budget; medians with the extremes over runs.

    Attributes:
        algorithm: its name.
        budget: evaluations.
        runs: number.
        empty: runs without a feasible point; they count as hypervolume 0 and are left out of what follows.
        hypervolume: (least, median, greatest) share of the true front's, with both ranges as 1 and the reference 1.1.
        igd: (least, median, greatest) mean distance from a point of the true front to the nearest one found.
        excess: (least, median, greatest) over runs of the mean power above the true front's at an equal criterion, relative.
    """

    algorithm: str
    budget: int
    runs: int
    empty: int
    hypervolume: tuple[float, float, float]
    igd: tuple[float, float, float] | None
    excess: tuple[float, float, float] | None


@dataclass(frozen=True, kw_only=True)
class Challenge:
    """The best points of all runs, those nearest to the front compared with the least power at their own criterion.

    Attributes:
        points: how many are bettered by no other.
        solved: for how many of these the least power was solved for.
        infeasible: of these, by the judge's exact functions.
        least_excess: smallest power above the least one found at an equal criterion, relative; negative if a point betters it.
        median_excess: likewise.
        moved: points at which the front itself was improved, by more than a millionth.
        front: the front with all these points on it.
    """

    points: int
    solved: int
    infeasible: int
    least_excess: float
    median_excess: float
    moved: int
    front: tuple[FrontPoint, ...]


def quality(front: Sequence[FrontPoint], fronts: Sequence[SearchFront]) -> list[Quality]:
    """One row for each algorithm and budget."""
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
    for algorithm, budget in dict.fromkeys((f.algorithm, f.budget) for f in fronts):
        chosen = [f for f in fronts if (f.algorithm, f.budget) == (algorithm, budget)]
        found = [f for f in chosen if len(f.values)]
        scaled = [scale(f.values, f.powers) for f in found]
        shares = [float(hypervolume(F)) / whole for F in scaled] + [0.0] * (len(chosen) - len(found))
        above = [float(np.mean(f.powers / np.interp(f.values, values, powers) - 1.0)) for f in found]
        rows.append(
            Quality(
                algorithm=algorithm,
                budget=budget,
                runs=len(chosen),
                empty=len(chosen) - len(found),
                hypervolume=_spread(shares),
                igd=_spread([float(distance(F)) for F in scaled]) if found else None,
                excess=_spread(above) if found else None,
            )
        )
    return rows


def challenge(
    free: GaitProblem,
    criterion: CompetingObjective,
    front: Sequence[FrontPoint],
    points: Sequence[FrontPoint],
    solver: Solver | None = None,
    progress: Progress = ignore_progress,
) -> Challenge:
    """Find the least power at the criterion of each point, from the point itself and from the nearest point of the front.

    Of more than a thousand points, those are taken that lie lowest over the straight lines between the front's points.

    Args:
        free: the problem without a demand on the criterion.
        criterion: beside power.
        front: the true one, as far as it is known.
        points: of searches.
        solver: with its settings; None for IPOPT with its defaults.
        progress: told the point.
    """
    values, powers = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
    lowest = sorted(points, key=lambda p: p.power_W / float(np.interp(p.value, values, powers)))[:MOST_CHALLENGES]
    solved: list[FrontPoint] = []
    excess: list[float] = []
    infeasible = moved = 0
    for point in lowest:
        exact = build_exact_model(free).at(point.x, free.p)
        if not exact.violation <= FEASIBILITY_TOLERANCE:
            infeasible += 1
            continue
        near = front[int(np.argmin(np.abs(values - point.value)))]
        at = min(point.value, front[-1].value)
        of_front, of_search = (point_at(free, criterion, at, np.array(start.x), solver) for start in (near, point))
        candidates = [p for p in (of_front, of_search) if p is not None]
        if not candidates:
            excess.append(exact.cost / near.power_W - 1.0 if near.value >= point.value else -np.inf)
            continue
        best = min(candidates, key=lambda p: p.power_W)
        moved += of_front is None or best.power_W < of_front.power_W * (1.0 - 1e-6)
        solved.append(best)
        excess.append(exact.cost / best.power_W - 1.0)
        progress(f"{criterion.name} {point.value:.5g} {criterion.unit}")
    return Challenge(
        points=len(points),
        solved=len(solved),
        infeasible=infeasible,
        least_excess=min(excess, default=np.inf),
        median_excess=float(np.median(excess)) if excess else np.inf,
        moved=moved,
        front=tuple(nondominated([*front, *solved])),
    )


def _spread(numbers: Sequence[float]) -> tuple[float, float, float]:
    sample: Array = np.array(numbers)
    return float(sample.min()), float(np.median(sample)), float(sample.max())
