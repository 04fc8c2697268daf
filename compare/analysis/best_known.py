"""Gaps from the best known objective, as numbers and in words."""

import math

from compare.analysis.units import format_percent, with_unit
from compare.study.references import OWN, Reference
from nlp_gait.formulation import Objective

ZERO = 1e-8  # gaps from a smaller reference are absolute


def compute_gap(value: float, reference: float, objective: Objective) -> float:
    """Return (value - reference) / |reference|, or the difference if ``is_zero``; positive if worse, infinite for NaN."""
    if math.isnan(value) or math.isnan(reference):
        return math.inf
    return objective.sign * (value - reference) / (1.0 if is_zero(reference) else abs(reference))


def is_zero(reference: float) -> bool:
    """Return whether a reference is so near zero that gaps from it are absolute, in the unit of the objective."""
    return abs(reference) < ZERO


def describe_value(reference: Reference, value: float | None, objective: Objective, what: str = "this point") -> str:
    """Describe the shipped best known value, and the distance of a feasible objective from it; say so if none is shipped."""
    if reference.objective is None:
        return f"Best known value: {reference.source.removeprefix(OWN)[2:]}"
    best = f"{with_unit(reference.objective, objective.unit)} ({reference.source})"
    if value is None:
        return f"Best known value: {best}"
    if reference.is_beaten_by(value, objective):
        gap = -compute_gap(value, reference.objective, objective)
        return (
            f"A new best known value: {100 * gap:.2g} % better than the best known {best}; please contribute the point"
        )
    distance = format_percent(max(compute_gap(value, reference.objective, objective), 0.0))
    return f"Best known value: {best}; {what} is {distance} from it"
