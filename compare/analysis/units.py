"""Numbers with units, gaps, names of quantities, and lists in words, for tables, figures and sentences; natural steps.

The unit of a pure number is "1" and is not shown.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from compare.study.references import OWN, Reference
from nlp_gait.formulation import GaitProblem, Objective

FOUND = 1e-6  # a run with at most this gap has reached the best known value
ROUNDING = 1e-12  # a share below this is shown as zero
SIX_DECIMALS = ".6f"
LEAST_SHOWN, MOST_SHOWN = 5e-7, 1e12  # six decimals show zero for less, and digits without a meaning for more


# Names of solvers as the field writes them.
SOLVERS = {
    **{name: name.upper() for name in ("ipopt", "slsqp", "pso", "ga", "aco", "de", "abc", "sa", "es")},
    "cma": "CMA-ES",
    "random": "random search",
}


def name_solver(name: str) -> str:
    """Return the name of a solver as the field writes it: ``PSO``, ``PSO-tuned``, ``GA+IPOPT``; others as they are."""
    words = name.split("+")
    heads = [word.partition("-") for word in words]
    return "+".join(SOLVERS.get(head, head) + dash + rest for head, dash, rest in heads)


def format_number(value: float, digits: str) -> str:
    """Format a number; a value rounded to zero has no sign."""
    if isinstance(value, int):
        return format(value, digits)
    sign = digits[0] if digits[:1] in ("+", "-", " ") else ""
    return f"{value:{sign}z{digits.removeprefix(sign)}}"


def with_unit(value: float | None, unit: str, digits: str = SIX_DECIMALS) -> str:
    """Format a value with its unit, for example ``0.845868 W``; a dash for None."""
    if value is None:
        return "-"
    if digits == SIX_DECIMALS and value and math.isfinite(value) and not LEAST_SHOWN <= abs(value) < MOST_SHOWN:
        digits = ".3g"
    return format_number(value, digits) + ("" if unit == "1" else f" {unit}")


def format_percent(share: float | None) -> str:
    """Format a share in percent with two digits, in scientific notation below 0.0001 %."""
    if share is None or not math.isfinite(share):
        return "-"
    percent = 0.0 if abs(share) < ROUNDING else float(f"{100 * share:.1e}")
    if percent and not 5e-5 <= abs(percent) < 1e6:
        return f"{percent:.1e} %"
    decimals = max(0, 1 - math.floor(math.log10(abs(percent)))) if percent else 0
    return f"{percent:.{decimals}f} %"


def format_gap(gap: float) -> str:
    """Format a relative gap in percent; those below ``FOUND``, which reach the reference, are not distinguished."""
    if gap == 0.0 or not math.isfinite(gap):
        return "-" if gap else "0 %"
    return f"< {100 * FOUND:.4f} %" if abs(gap) < FOUND else format_percent(gap)


def make_heading(words: str, unit: str) -> str:
    """Return a heading with its unit, for example ``power [W]``."""
    return words if unit == "1" else f"{words} [{unit}]"


def format_millimetres(value_m: float | None, digits: str = ".1f") -> str:
    """Format a length [m] in millimetres, for example ``24.3 mm``; a dash for None."""
    return with_unit(None if value_m is None else 1000 * value_m, "mm", digits)


def join_words(parts: Iterable[str]) -> str:
    """Join words: ``a``, ``a and b``, ``a, b and c``."""
    *most, last = [*parts] or [""]
    return f"{', '.join(most)} and {last}" if most else last


def make_axis_label(name: str, unit: str) -> str:
    """Return the label of an axis, for example ``hip height [m]``."""
    return make_heading(name_in_words(name, unit), unit)


def format_quantity(name: str, unit: str, value: float) -> str:
    """Format a value with its name, for example ``hip height = 0.31 m``."""
    return f"{name_in_words(name, unit)} = {with_unit(value, unit, 'g')}"


def name_in_words(name: str, unit: str) -> str:
    """Return a name without its unit, for example ``hip height``."""
    for end in ("lower", "upper"):
        if name.endswith(f".{end}"):
            return f"{end} bound of {name_in_words(name.removesuffix(f'.{end}'), unit)}"
    return name.removesuffix("_" + unit.replace("/", "_").replace("^", "")).replace("_", " ")


def list_units(problem: GaitProblem) -> dict[str, str]:
    """Return the units of a problem's variables and parameters by name."""
    variables = {variable.name: variable.unit for variable in problem.variables}
    units = variables | {parameter.name: parameter.unit for parameter in problem.parameters}
    return {name.removesuffix(".lower"): unit for name, unit in units.items()} | units


class NaturalStep(NamedTuple):
    """A change of a quantity, in its own unit, and its description."""

    size: float
    words: str


BY_UNIT = {
    "m": NaturalStep(1e-3, "1 mm"),
    "rad": NaturalStep(math.radians(1.0), "1 degree"),
    "Nm": NaturalStep(0.1, "0.1 Nm"),
    "N": NaturalStep(1.0, "1 N"),
    "s": NaturalStep(0.1, "0.1 s"),
    "m/s": NaturalStep(1e-3, "1 mm/s"),
    "rad/s": NaturalStep(0.1, "0.1 rad/s"),
    "rad/s^2": NaturalStep(1.0, "1 rad/s^2"),
    "1": NaturalStep(0.01, "0.01"),
}
SHARE = 0.05  # of the value, where the unit has no step
MASS = NaturalStep(SHARE, f"{100 * SHARE:g} %")
LENGTH = BY_UNIT["m"]


def choose_natural_step(unit: str, value: float) -> NaturalStep:
    """Return the step of a quantity at its current value."""
    if unit in BY_UNIT:
        return BY_UNIT[unit]
    if value:
        return NaturalStep(SHARE * abs(value), MASS.words)
    return NaturalStep(SHARE, f"{SHARE:g} {unit}")


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
