"""Readable names of variables: ``hip_vx_start_m_s`` is the hip vx start in m/s."""

from __future__ import annotations

from compare.analysis.units import heading, with_unit
from nlp_gait.formulation import GaitProblem


def axis_label(name: str, unit: str) -> str:
    """Return the label of an axis, for example ``hip height [m]``."""
    return heading(name_in_words(name, unit), unit)


def quantity(name: str, unit: str, value: float) -> str:
    """Format a value with its name, for example ``hip height = 0.31 m``."""
    return f"{name_in_words(name, unit)} = {with_unit(value, unit, 'g')}"


def name_in_words(name: str, unit: str) -> str:
    """Return a name without its unit, for example ``hip height``."""
    for end in ("lower", "upper"):
        if name.endswith(f".{end}"):
            return f"{end} bound of {name_in_words(name.removesuffix(f'.{end}'), unit)}"
    return name.removesuffix("_" + unit.replace("/", "_").replace("^", "")).replace("_", " ")


def units_of(problem: GaitProblem) -> dict[str, str]:
    """Return the units of a problem's variables and parameters by name."""
    variables = {variable.name: variable.unit for variable in problem.variables}
    return variables | {parameter.name: parameter.unit for parameter in problem.parameters}
