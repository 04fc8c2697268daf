"""Runs measured against the true front, and checks of the abstract's claims, by id in ``nao_pareto_claims.toml``."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from compare.analysis.record_statistics import compute_rank_sum
from compare.papers.claims import SIGNIFICANT, Check, ClaimVerdict, decide
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS, ParetoEffort
from compare.questions.pareto.competing import CompetingObjective
from compare.questions.pareto.front import Bends, FrontPoint, find_bends
from compare.questions.pareto.pareto_front import SEARCH_NAMES
from compare.questions.pareto.searches import REFERENCE, Challenge, Scale
from metaheuristics.interface import Array
from metaheuristics.multi_objective import Snapshot
from nlp_gait.formulation import GaitProblem

EVEN_POINTS = 200  # of the true front, which distances are measured from
NAMES = {**SEARCH_NAMES, "CMOEAD": "CMOEA/D"}  # as the paper writes them
EARLY = 0.1  # share of the budget that counts as the beginning
COMPETITIVE = 0.02  # of the true front's hypervolume, behind the best
NEAR = 0.9  # share of the true front's hypervolume that counts as near it
KNEES = 2

WORDS = {"hypervolume": "hypervolume ", "igd": "distance "}  # where several measures decide
# Factor and unit in which a measure is shown.
SHOWN = {"hypervolume": (100.0, " %"), "igd": (1.0, ""), "feasible": (100.0, " %"), "time_s": (1.0, " s")}

Tested = tuple[bool, str]
"""Whether a claim holds in one phase with one budget, and the numbers."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Measures:
    """Measures of R runs of one search with one budget at L looks."""

    evaluations: Array  # (L,) before each look
    # (R, L) share of the true front's, both ranges being 1 and the reference 1.1; 0 without a feasible point
    hypervolume: Array
    # (R, L) mean distance from a point of the true front, evenly along it, to the nearest one found; infinite without one
    igd: Array
    feasible: Array  # (R,) share of the evaluated points that are feasible
    first_feasible: Array  # (R,) number of the first of these; infinite without one
    time_s: Array  # (R,) processor time [s]
    objective_time_s: Array  # (R,) of it in the objectives [s]

    def until(self, share: float) -> Array:
        """Return (R,) evaluations at the first look with at least a share of the hypervolume; infinite if never."""
        reached = self.hypervolume >= share
        at = np.where(reached.any(axis=1), self.evaluations[reached.argmax(axis=1)], np.inf)
        return np.asarray(at)

    def get_end(self, measure: str) -> Array:
        """Return (R,) a measure at the last look."""
        values: Array = getattr(self, measure)
        return values if values.ndim == 1 else values[:, -1]

    @property
    def early(self) -> int:
        """Number of the last look in the beginning of the budget, or of the first look."""
        return max(0, int(np.count_nonzero(self.evaluations <= EARLY * self.evaluations[-1])) - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseFronts:
    """Results of one support phase."""

    problem: GaitProblem  # the phase, without its constraint on the criterion
    criterion: CompetingObjective  # the second objective
    first_front: Sequence[FrontPoint]  # of the gradient method alone, whose ranges count as 1 in the searches
    answer: Challenge  # the front after solving from the searches' best points
    runs: Mapping[tuple[str, int], Sequence[Sequence[Snapshot]]]  # looks at each run by search and budget

    @property
    def front(self) -> tuple[FrontPoint, ...]:
        """The best known front."""
        return self.answer.front

    @cached_property
    def bends(self) -> Bends:
        """Knees of the front."""
        return find_bends(self.front)

    @cached_property
    def budgets(self) -> tuple[int, ...]:
        """Budgets of the runs."""
        return tuple(dict.fromkeys(budget for _, budget in self.runs))

    @cached_property
    def measures(self) -> dict[tuple[str, int], Measures]:
        """Measures by search and budget."""
        return {case: self._measure(runs) for case, runs in self.runs.items()}

    def points(self, algorithm: str, budget: int) -> tuple[Array, Array]:
        """Return criterion and power [W] of all points at the ends of all runs."""
        scale = Scale(self.first_front)
        return scale.undo(np.concatenate([run[-1].F for run in self.runs[algorithm, budget]]))

    def _measure(self, runs: Sequence[Sequence[Snapshot]]) -> Measures:
        from pymoo.indicators.hv import HV
        from pymoo.indicators.igd import IGD

        first, scale = Scale(self.first_front), Scale(self.front)
        values, powers = (np.array([getattr(p, key) for p in self.front]) for key in ("value", "power_W"))
        true = scale(values, powers)
        hypervolume, distance = HV(ref_point=np.full(2, REFERENCE)), IGD(spread_evenly(true))
        whole = float(hypervolume(true))
        fronts = [[scale(*first.undo(look.F)) for look in run] for run in runs]
        ends = [run[-1] for run in runs]
        return Measures(
            evaluations=np.array([look.evaluations for look in runs[0]], dtype=float),
            hypervolume=np.array([[float(hypervolume(F)) / whole if len(F) else 0.0 for F in row] for row in fronts]),
            igd=np.array([[float(distance(F)) if len(F) else math.inf for F in row] for row in fronts]),
            feasible=np.array([end.feasible / end.evaluations for end in ends]),
            first_feasible=np.array([math.inf if e.first_feasible is None else e.first_feasible for e in ends]),
            time_s=np.array([end.time_s for end in ends]),
            objective_time_s=np.array([end.objective_time_s for end in ends]),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ParetoFindings:
    """All results."""

    phases: tuple[PhaseFronts, ...]  # single and double support
    effort: ParetoEffort  # what was computed


def spread_evenly(front: Array) -> Array:
    """Return (EVEN_POINTS, 2) points evenly along the lines between a front's (k, 2), which crowd near the searches' best."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(front, axis=0).T))])
    places = np.linspace(0.0, along[-1], EVEN_POINTS)
    return np.column_stack([np.interp(places, along, column) for column in front.T])


def _check(is_true: Callable[[dict[str, Measures]], Tested], findings: ParetoFindings) -> Check:
    cases = {}
    for phase, budget in [(p, budget) for p in findings.phases for budget in p.budgets]:
        runs = {name: phase.measures[name, budget] for name in ALGORITHMS}
        cases[f"{phase.problem.name}, {budget:,} evaluations"] = is_true(runs)
    return _decide(cases)


def _check_extreme(findings: ParetoFindings, search: str, ends: Mapping[str, str]) -> Check:
    return _check(partial(_is_extreme_at_ends, search, ends), findings)


def _is_extreme_at_ends(search: str, ends: Mapping[str, str], runs: dict[str, Measures]) -> Tested:
    tested, best = {}, {"least": min, "greatest": max}
    for measure, end in ends.items():
        samples = {name: m.get_end(measure) for name, m in runs.items()}
        tested[measure] = _is_extreme(samples, search, best[end], *SHOWN[measure])
    numbers = "; ".join(f"{WORDS.get(measure, '')}{text}" for measure, (_, text) in tested.items())
    return all(holds for holds, _ in tested.values()), numbers


def _check_knees(findings: ParetoFindings) -> Check:
    cases = {}
    for phase in findings.phases:
        knees, unit = phase.bends.knees, phase.criterion.unit
        shown = [f"{k.value:.4f} {unit} at {k.power_W:.3f} W, {k.turn_deg:.0f} degrees" for k in knees]
        cases[phase.problem.name] = len(knees) == KNEES, f"{len(knees)} ({', '.join(shown) or 'none'})"
    return _decide(cases)


def _decide(cases: Mapping[str, Tested]) -> Check:
    held = all(holds for holds, _ in cases.values())
    verdicts = {True: ClaimVerdict.HOLDS, False: ClaimVerdict.FAILS}
    found = "; ".join(f"{case}: {numbers}: {verdicts[holds]}" for case, (holds, numbers) in cases.items())
    return decide(held, found=found, early=100 * EARLY, competitive=100 * COMPETITIVE)


def _is_moderate(runs: dict[str, Measures]) -> Tested:
    places = []
    for measure, best in (("hypervolume", True), ("igd", False)):
        medians = _find_medians(runs, measure)
        places.append(1 + sorted(medians, key=medians.__getitem__, reverse=best).index("DCNSGA3"))
    between = all(1 < place < len(runs) for place in places)
    return between, f"place {places[0]} of {len(runs)} by hypervolume, {places[1]} by distance"


def _is_faster(runs: dict[str, Measures]) -> Tested:
    early = {n: m.hypervolume[:, m.early] for n, m in runs.items()}
    leads, numbers = _is_extreme(early, "CMOPSO", max, 100.0, " %")
    at = runs["CMOPSO"].evaluations[runs["CMOPSO"].early]
    medians = {n: np.median(m.until(NEAR)) for n, m in runs.items()}
    until = ", ".join(f"{NAMES[n]} {f'{k:,.0f}' if np.isfinite(k) else 'never'}" for n, k in medians.items())
    return leads, f"after {at:,.0f} {numbers}; {100 * NEAR:.0f} % are reached after {until}"


def _is_competitive(runs: dict[str, Measures]) -> Tested:
    volume = _find_medians(runs, "hypervolume")
    behind = max(volume.values()) - volume["CMOPSO"]
    return behind <= COMPETITIVE, f"{100 * behind:.2f} % behind {NAMES[_find_first(volume, max)]}"


def _is_extreme(samples: dict[str, Array], name: str, best: Callable[..., str], factor: float, unit: str) -> Tested:
    medians = {n: float(np.median(values)) for n, values in samples.items()}
    following = _find_first({n: median for n, median in medians.items() if n != name}, best)
    p = compute_rank_sum(samples[name].tolist(), samples[following].tolist())
    shown = ", ".join(f"{NAMES[n]} {factor * median:.3g}{unit}" for n, median in medians.items())
    return _find_first(medians, best) == name and p < SIGNIFICANT, f"{shown}; against {NAMES[following]} p = {p:.2g}"


def _find_medians(runs: dict[str, Measures], measure: str) -> dict[str, float]:
    return {name: float(np.median(m.get_end(measure))) for name, m in runs.items()}


def _find_first(values: dict[str, float], best: Callable[..., str]) -> str:
    return best(values, key=lambda name: values[name])


_check_faster = partial(_check, _is_faster)
_check_competitive = partial(_check, _is_competitive)
_check_moderate = partial(_check, _is_moderate)
