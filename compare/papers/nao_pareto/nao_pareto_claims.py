"""Checks of the abstract's claims in both phases with every budget, by id in ``nao_pareto_claims.toml``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from compare.analysis.statistics.inference import rank_sum
from compare.papers.claims import SIGNIFICANT, Check, Verdict, decide
from compare.papers.nao_pareto.nao_pareto_findings import NAMES, Measures, ParetoFindings, PhaseFindings
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS
from metaheuristics.array import Array

EARLY = 0.1  # share of the budget that counts as the beginning
COMPETITIVE = 0.02  # of the true front's hypervolume, behind the best
NEAR = 0.9  # share of the true front's hypervolume that counts as near it
KNEES = 2

Case = tuple[bool, str]
"""Whether a claim holds in one phase with one budget, and the numbers."""


def _check(is_true: Callable[[dict[str, Measures]], Case], findings: ParetoFindings) -> Check:
    """Check a claim about the searches in each phase with each budget."""
    return _decide(
        (
            f"{phase.problem.name}, {budget:,} evaluations",
            is_true({name: phase.measures[name, budget] for name in ALGORITHMS}),
        )
        for phase in findings.phases
        for budget in phase.budgets
    )


def _check_knees(findings: ParetoFindings) -> Check:
    return _decide((phase.problem.name, _has_two_knees(phase)) for phase in findings.phases)


def _decide(named_cases: Iterable[tuple[str, Case]]) -> Check:
    cases = dict(named_cases)
    held, verdict, detail = sum(holds for holds, _ in cases.values()), Verdict.FAILS, ""
    if held:
        verdict = Verdict.HOLDS
    if 0 < held < len(cases):
        verdict, detail = Verdict.HOLDS_IN_PART, f"({held} of {len(cases)} cases)"
    verdicts = {True: Verdict.HOLDS, False: Verdict.FAILS}
    found = "; ".join(f"{case}: {numbers}: {verdicts[holds]}" for case, (holds, numbers) in cases.items())
    return decide(verdict, found=found, detail=detail, early=100 * EARLY, competitive=100 * COMPETITIVE)


def _is_best(runs: dict[str, Measures]) -> Case:
    volume, distance = _get_ends(runs)
    return _first(volume, max) == "NSGA2" and _first(distance, min) == "NSGA2", _list_ends(runs)


def _is_poor(runs: dict[str, Measures]) -> Case:
    volume, distance = _get_ends(runs)
    return _first(volume, min) == "CMOEAD" and _first(distance, max) == "CMOEAD", _list_ends(runs)


def _is_moderate(runs: dict[str, Measures]) -> Case:
    volume, distance = _get_ends(runs)
    places = [
        1 + sorted(values, key=values.__getitem__, reverse=best).index("DCNSGA3")
        for values, best in ((volume, True), (distance, False))
    ]
    between = all(1 < place < len(runs) for place in places)
    return between, f"place {places[0]} of {len(runs)} by hypervolume, {places[1]} by distance"


def _is_faster(runs: dict[str, Measures]) -> Case:
    early = {n: float(np.median(m.hypervolume[:, m.find_look(EARLY * m.evaluations[-1])])) for n, m in runs.items()}
    cmopso = runs["CMOPSO"]
    at = cmopso.evaluations[cmopso.find_look(EARLY * cmopso.evaluations[-1])]
    until = ", ".join(f"{NAMES[n]} {_format_count(float(np.median(m.until(NEAR))))}" for n, m in runs.items())
    numbers = f"after {at:,.0f} {_list_shares(early)}; {100 * NEAR:.0f} % are reached after {until}"
    return _first(early, max) == "CMOPSO", numbers


def _is_competitive(runs: dict[str, Measures]) -> Case:
    volume, _ = _get_ends(runs)
    behind = max(volume.values()) - volume["CMOPSO"]
    return behind <= COMPETITIVE, f"{100 * behind:.2f} % behind {NAMES[_first(volume, max)]}"


def _is_least_feasible(runs: dict[str, Measures]) -> Case:
    return _is_extreme({n: m.feasible for n, m in runs.items()}, "DCNSGA3", min, 100.0, " %")


def _is_costly(runs: dict[str, Measures]) -> Case:
    return _is_extreme({n: m.time_s for n, m in runs.items()}, "CMOEAD", max, 1.0, " s")


def _is_extreme(samples: dict[str, Array], name: str, best: Callable[..., str], factor: float, unit: str) -> Case:
    """Whether a search has the least or greatest median, significantly before the next one."""
    medians = {n: float(np.median(values)) for n, values in samples.items()}
    following = _first({n: median for n, median in medians.items() if n != name}, best)
    p = rank_sum(samples[name].tolist(), samples[following].tolist())
    shown = ", ".join(f"{NAMES[n]} {factor * median:.3g}{unit}" for n, median in medians.items())
    return _first(medians, best) == name and p < SIGNIFICANT, f"{shown}; against {NAMES[following]} p = {p:.2g}"


def _has_two_knees(phase: PhaseFindings) -> Case:
    knees, unit = phase.bends.knees, phase.criterion.unit
    shown = ", ".join(f"{k.value:.4f} {unit} at {k.power_W:.3f} W, {k.turn_deg:.0f} degrees" for k in knees) or "none"
    return len(knees) == KNEES, f"{len(knees)} ({shown})"


def _get_ends(runs: dict[str, Measures]) -> tuple[dict[str, float], dict[str, float]]:
    """Median hypervolume and distance at the end of all runs."""
    volume = {name: float(np.median(m.hypervolume[:, -1])) for name, m in runs.items()}
    return volume, {name: float(np.median(m.igd[:, -1])) for name, m in runs.items()}


def _list_ends(runs: dict[str, Measures]) -> str:
    volume, distance = _get_ends(runs)
    distances = ", ".join(f"{NAMES[n]} {d:.4f}" for n, d in distance.items())
    return f"hypervolume {_list_shares(volume)}; distance {distances}"


def _list_shares(values: dict[str, float]) -> str:
    return ", ".join(f"{NAMES[n]} {100 * value:.1f} %" for n, value in values.items())


def _format_count(value: float) -> str:
    return f"{value:,.0f}" if np.isfinite(value) else "never"


def _first(values: dict[str, float], best: Callable[..., str]) -> str:
    return best(values, key=lambda name: values[name])


CHECKS: dict[str, Callable[[ParetoFindings], Check]] = {
    "best": partial(_check, _is_best),
    "faster": partial(_check, _is_faster),
    "competitive": partial(_check, _is_competitive),
    "moderate": partial(_check, _is_moderate),
    "constrained": partial(_check, _is_least_feasible),
    "poor": partial(_check, _is_poor),
    "costly": partial(_check, _is_costly),
    "knees": _check_knees,
}
