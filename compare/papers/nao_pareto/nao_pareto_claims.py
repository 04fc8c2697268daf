"""Claims of the abstract, each checked in both phases with every budget."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from compare.analysis.statistics.inference import rank_sum
from compare.papers.nao_pareto.nao_pareto_findings import NAMES, Measures, ParetoFindings, PhaseFindings
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS
from compare.papers.reproduction import SIGNIFICANT, Claim, Verdict
from metaheuristics.array import Array

EARLY = 0.1  # share of the budget that counts as the beginning
COMPETITIVE = 0.02  # of the true front's hypervolume, behind the best
NEAR = 0.9  # share of the true front's hypervolume that counts as near it
KNEES = 2

Case = tuple[bool, str]
"""Whether a claim holds in one phase with one budget, and the numbers."""


def check_claims(findings: ParetoFindings) -> list[Claim]:
    """Return all claims, in the order of the abstract."""
    searches = (
        (
            "NSGA-II converges best and gives the best solutions",
            "it has the least median inverted generational distance and the greatest median hypervolume of the four",
            _is_best,
        ),
        (
            "CMOPSO is faster at first",
            f"after {100 * EARLY:.0f} % of the budget its median hypervolume is the greatest",
            _is_faster,
        ),
        (
            "CMOPSO is competitive",
            f"its median hypervolume in the end is at most {100 * COMPETITIVE:.0f} % of the front's behind the best",
            _is_competitive,
        ),
        (
            "DCNSGA-III performs moderately",
            "in the end it is neither first nor last of the four, by both medians",
            _is_moderate,
        ),
        (
            "DCNSGA-III has difficulties with the constraints",
            "the median share of feasible points is the least of the four, significantly below the next",
            _is_least_feasible,
        ),
        (
            "CMOEA/D converges poorly",
            "it has the greatest median inverted generational distance and the least median hypervolume of the four",
            _is_poor,
        ),
        (
            "CMOEA/D needs significantly more computation",
            "its median processor time is the greatest of the four, significantly above the next",
            _is_costly,
        ),
    )
    claims = [_make_claim(text, criterion, _check_cases(findings, check)) for text, criterion, check in searches]
    knees = [(phase.problem.name, _has_two_knees(phase)) for phase in findings.phases]
    return [
        *claims,
        _make_claim(
            "Two distinct knee regions emerge in single and in double support",
            "the true front of each phase has two knees: turns of at least 15 degrees within a tenth of its length",
            knees,
        ),
    ]


def _make_claim(text: str, criterion: str, cases: Sequence[tuple[str, Case]]) -> Claim:
    held = sum(holds for _, (holds, _) in cases)
    verdict, detail = (Verdict.HOLDS if held else Verdict.FAILS), ""
    if 0 < held < len(cases):
        verdict, detail = Verdict.HOLDS_IN_PART, f"({held} of {len(cases)} cases)"
    found = "; ".join(
        f"{case}: {numbers}: {Verdict.HOLDS if holds else Verdict.FAILS}" for case, (holds, numbers) in cases
    )
    return Claim(where="abstract", text=text, criterion=criterion, found=found, verdict=verdict, detail=detail)


def _check_cases(findings: ParetoFindings, check: Callable[[dict[str, Measures]], Case]) -> list[tuple[str, Case]]:
    return [
        (
            f"{phase.problem.name}, {budget:,} evaluations",
            check({name: phase.measures[name, budget] for name in ALGORITHMS}),
        )
        for phase in findings.phases
        for budget in phase.budgets
    ]


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
