"""The claims of the paper's abstract, each held against what is found here, in both phases and with every budget."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from compare.analysis.statistics.inference import rank_sum
from compare.papers.nao.nao_claims import FAILS, HOLDS, SIGNIFICANT
from compare.papers.nao_pareto.nao_pareto_findings import NAMES, Findings, Measured, PhaseFindings
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS
from metaheuristics.array import Array

EARLY = 0.1  # share of the budget that counts as the beginning
COMPETITIVE = 0.02  # of the true front's hypervolume, behind the best
NEAR = 0.9  # share of the true front's hypervolume that counts as near it
KNEES = 2

Case = tuple[bool, str]
"""Whether a claim holds in one phase with one budget, and the numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A claim of the abstract: what it says, how it is decided, the verdict over all cases, and the numbers of each."""

    text: str
    test: str
    verdict: str
    evidence: str


def claims(findings: Findings) -> list[Claim]:
    """All claims, in the order of the abstract."""
    searches = (
        (
            "NSGA-II converges best and gives the best solutions",
            "it has the least median inverted generational distance and the greatest median hypervolume of the four",
            _best,
        ),
        (
            "CMOPSO is faster at first",
            f"after {100 * EARLY:.0f} % of the budget its median hypervolume is the greatest",
            _faster,
        ),
        (
            "CMOPSO is competitive",
            f"its median hypervolume in the end is at most {100 * COMPETITIVE:.0f} % of the front's behind the best",
            _competitive,
        ),
        (
            "DCNSGA-III performs moderately",
            "in the end it is neither first nor last of the four, by both medians",
            _moderate,
        ),
        (
            "DCNSGA-III has difficulties with the constraints",
            "the median share of points that meet all constraints is the least of the four, significantly below the next",
            _constraints,
        ),
        (
            "CMOEA/D converges poorly",
            "it has the greatest median inverted generational distance and the least median hypervolume of the four",
            _poor,
        ),
        (
            "CMOEA/D needs significantly more computation",
            "its median processor time is the greatest of the four, significantly above the next",
            _costly,
        ),
    )
    found = [_claim(text, test, list(_cases(findings, decide))) for text, test, decide in searches]
    knees = [
        (f"{phase.problem.name}: {numbers}", holds) for phase in findings.phases for holds, numbers in [_knees(phase)]
    ]
    return [
        *found,
        _claim(
            "Two distinct knee regions emerge in single and in double support",
            "the true front of each phase has two knees: turns of at least 15 degrees within a tenth of its length",
            knees,
        ),
    ]


def _claim(text: str, test: str, cases: list[tuple[str, bool]]) -> Claim:
    held = sum(holds for _, holds in cases)
    verdict = (
        HOLDS if held == len(cases) else FAILS if not held else f"{FAILS} in {len(cases) - held} of {len(cases)} cases"
    )
    marked = (f"{numbers}: {HOLDS if holds else FAILS}" for numbers, holds in cases)
    return Claim(text=text, test=test, verdict=verdict, evidence="; ".join(marked))


def _cases(findings: Findings, decide: Callable[[dict[str, Measured]], Case]) -> Iterator[tuple[str, bool]]:
    for phase in findings.phases:
        for budget in phase.budgets:
            holds, numbers = decide({name: phase.measured[name, budget] for name in ALGORITHMS})
            yield f"{phase.problem.name}, {budget:,} evaluations: {numbers}", holds


def _best(runs: dict[str, Measured]) -> Case:
    volume, distance = _ends(runs)
    return _first(volume, max) == "NSGA2" and _first(distance, min) == "NSGA2", _volumes_and_distances(runs)


def _poor(runs: dict[str, Measured]) -> Case:
    volume, distance = _ends(runs)
    return _first(volume, min) == "CMOEAD" and _first(distance, max) == "CMOEAD", _volumes_and_distances(runs)


def _moderate(runs: dict[str, Measured]) -> Case:
    volume, distance = _ends(runs)
    places = [_place(volume, "DCNSGA3", best=max), _place(distance, "DCNSGA3", best=min)]
    between = all(1 < place < len(runs) for place in places)
    return between, f"place {places[0]} of {len(runs)} by hypervolume, {places[1]} by distance"


def _faster(runs: dict[str, Measured]) -> Case:
    early = {n: float(np.median(m.hypervolume[:, m.look(EARLY * m.budget)])) for n, m in runs.items()}
    at = runs["CMOPSO"].evaluations[runs["CMOPSO"].look(EARLY * runs["CMOPSO"].budget)]
    until = {n: float(np.median(m.until(NEAR))) for n, m in runs.items()}
    numbers = f"after {at:,.0f} {_shares(early)}; {100 * NEAR:.0f} % are reached after {_counts(until)}"
    return _first(early, max) == "CMOPSO", numbers


def _competitive(runs: dict[str, Measured]) -> Case:
    volume, _ = _ends(runs)
    behind = max(volume.values()) - volume["CMOPSO"]
    return behind <= COMPETITIVE, f"{100 * behind:.2f} % behind {NAMES[_first(volume, max)]}"


def _constraints(runs: dict[str, Measured]) -> Case:
    return _extreme({n: m.feasible for n, m in runs.items()}, "DCNSGA3", min, 100.0, " %")


def _costly(runs: dict[str, Measured]) -> Case:
    return _extreme({n: m.time_s for n, m in runs.items()}, "CMOEAD", max, 1.0, " s")


def _extreme(samples: dict[str, Array], name: str, best: Callable[..., str], factor: float, unit: str) -> Case:
    """Whether an algorithm has the least or greatest median, significantly before the next one."""
    medians = {n: float(np.median(values)) for n, values in samples.items()}
    others = {n: median for n, median in medians.items() if n != name}
    beside = _first(others, best)
    p = rank_sum(samples[name].tolist(), samples[beside].tolist())
    shown = ", ".join(f"{NAMES[n]} {factor * median:.3g}{unit}" for n, median in medians.items())
    numbers = f"{shown}; against {NAMES[beside]} p = {p:.2g}"
    return _first(medians, best) == name and p < SIGNIFICANT, numbers


def _knees(phase: PhaseFindings) -> Case:
    knees, unit = phase.bends.knees, phase.criterion.unit
    shown = ", ".join(f"{k.value:.4f} {unit} at {k.power_W:.3f} W, {k.turn_deg:.0f} degrees" for k in knees) or "none"
    return len(knees) == KNEES, f"{len(knees)} ({shown})"


def _ends(runs: dict[str, Measured]) -> tuple[dict[str, float], dict[str, float]]:
    """Median hypervolume and distance at the end of all runs."""
    volume = {name: float(np.median(m.hypervolume[:, -1])) for name, m in runs.items()}
    return volume, {name: float(np.median(m.igd[:, -1])) for name, m in runs.items()}


def _volumes_and_distances(runs: dict[str, Measured]) -> str:
    volume, distance = _ends(runs)
    return f"hypervolume {_shares(volume)}; distance " + ", ".join(f"{NAMES[n]} {d:.4f}" for n, d in distance.items())


def _shares(values: dict[str, float]) -> str:
    return ", ".join(f"{NAMES[n]} {100 * value:.1f} %" for n, value in values.items())


def _counts(values: dict[str, float]) -> str:
    return ", ".join(
        f"{NAMES[n]} {value:,.0f}" if np.isfinite(value) else f"{NAMES[n]} never" for n, value in values.items()
    )


def _first(values: dict[str, float], best: Callable[..., str]) -> str:
    return best(values, key=lambda name: values[name])


def _place(values: dict[str, float], name: str, best: Callable[..., str]) -> int:
    ordered = sorted(values, key=lambda n: values[n], reverse=best is max)
    return 1 + ordered.index(name)
