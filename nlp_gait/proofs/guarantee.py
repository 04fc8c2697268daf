"""Guarantees: what is proven about the limits of a gait between its samples."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from nlp_gait.errors import CompilerError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs import time_search
from nlp_gait.proofs.time_search import GRAIN, TimeRows


@dataclass(frozen=True, kw_only=True)
class RowViolation:
    """A row that is violated at some time, or not proven to be satisfied at all times."""

    row: str  # its name
    unit: str  # of the row
    from_s: float  # start of the first piece of time in which it is not proven to be satisfied [s]
    to_s: float  # end of that piece [s]
    least: float  # lower bound of the largest violation over all times [unit]; 0 if none is proven
    most: float | None  # upper bound of it [unit]; None if there is none

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        when = f"from {self.from_s:.4g} to {self.to_s:.4g} s"
        if self.most is None:
            return f"{self.row} may be violated by any amount, first {when}"
        if self.least > FEASIBILITY_TOLERANCE:
            return f"{self.row} is violated by {self.least:.3g} to {self.most:.3g}{unit}, first {when}"
        return f"{self.row} may be violated by up to {self.most:.3g}{unit}, first {when}"


@dataclass(frozen=True, kw_only=True)
class Guarantee:
    """What is proven about a gait between its samples."""

    # True if all rows over time are satisfied at all times, to 1e-6 in their units; False if a violation is proven; else None
    satisfied: bool | None
    # Rows that are not proven to be satisfied, by the time at which that begins
    violations: tuple[RowViolation, ...] = ()
    sampled: tuple[str, ...] = ()  # rows that are defined on samples only; the judge checks them there
    # Bounds of true time means and integrals, by the name of the metric
    means: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    reason: str = ""  # why nothing is proven, or empty

    def __str__(self) -> str:
        if self.reason:
            return f"unknown ({self.reason})"
        sampled = f"; checked on samples only: {', '.join(self.sampled)}" if self.sampled else ""
        if self.satisfied:
            return f"all limits are satisfied at all times{sampled}"
        omitted = f"; {len(self.violations) - 1} more constraints" if len(self.violations) > 1 else ""
        return f"{self.violations[0]}{omitted}{sampled}"

    @property
    def word(self) -> str:
        """``"yes"``, ``"no"`` or ``"?"``, for tables."""
        return "?" if self.satisfied is None else "yes" if self.satisfied else "no"


def guarantee(problem: GaitProblem, x: Array) -> Guarantee:
    """Prove which rows a point x (n,) satisfies at all times; bounds of means have a relative distance.

    Rows that do not depend on time, such as those of a switch, are left to the judge.
    """
    if not problem.rows_over_time:
        return Guarantee(satisfied=None, reason="the problem defines its constraints on samples only")
    try:
        phases = [problem.build_once(time_search.make_time_functions, rows) for rows in problem.rows_over_time]
    except CompilerError as error:
        return Guarantee(satisfied=None, reason=str(error))
    results = [_search_phase(problem, phase, np.asarray(x, dtype=float)) for phase in phases]
    means: dict[str, tuple[float, float]] = {}
    for _, phase_means in results:
        for name, (low, high) in phase_means.items():
            before = means.get(name, (0.0, 0.0))
            means[name] = (before[0] + low, before[1] + high)
    violations = tuple(sorted((v for rows, _ in results for v in rows), key=lambda v: v.from_s))
    proven = any(v.least > FEASIBILITY_TOLERANCE for v in violations)
    satisfied = False if proven else None if violations else True
    sampled = tuple(dict.fromkeys(name for phase in phases for name in phase.sampled))
    return Guarantee(satisfied=satisfied, violations=violations, sampled=sampled, means=means)


def _search_phase(
    problem: GaitProblem, phase: time_search.TimeFunctions, x: Array
) -> tuple[list[RowViolation], dict[str, tuple[float, float]]]:
    """Return violations, and bounds of means by name."""
    start, end = phase.source.times({**problem.by_name(x), **problem.parameter_values})
    step = round(1.0 / phase.source.intervals / GRAIN) * GRAIN
    given = np.concatenate([x, problem.p])
    violations: list[RowViolation] = []
    means: dict[str, tuple[float, float]] = {}
    for rows, shift in ((phase.instants, None), (phase.changes, step)):
        if rows is None:
            continue
        plain, (lower, upper) = rows.plain, rows.bound(problem.p)
        search = time_search.TimeSearch(rows, given, shift, lower[:plain], upper[:plain])
        search.run(time_search.make_pieces(phase.source.kinks, shift))
        limits = np.stack([lower[plain:], upper[plain:]], axis=-1)
        search.sharpen_integrals(limits)
        for k, (a, b) in sorted(search.first.items()):
            piece = start + a * (end - start), start + b * (end - start)
            violations.append(_violation(rows, k, piece, float(search.least[k]), float(search.most[k])))
        for k, (low, high) in enumerate(zip(*search.integrals(), strict=True), start=plain):
            if not rows.units[k]:
                if np.isfinite(low) and np.isfinite(high):
                    means[rows.names[k]] = (float(low), float(high))
                continue
            most, least = (float(v) for v in time_search.bound_violation(lower[k], upper[k], low, high))
            if not most <= FEASIBILITY_TOLERANCE:
                violations.append(_violation(rows, k, (start, end), least, most))
    return violations, means


def _violation(rows: TimeRows, k: int, piece: tuple[float, float], least: float, most: float) -> RowViolation:
    finite, (from_s, to_s) = most if np.isfinite(most) else None, piece
    row, unit = rows.names[k], rows.units[k]
    return RowViolation(row=row, unit=unit, from_s=from_s, to_s=to_s, least=max(least, 0.0), most=finite)
