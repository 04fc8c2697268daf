"""Steps of limits and lengths for reports: one millimetre, a tenth of a newton metre, one degree."""

from __future__ import annotations

import math
from typing import NamedTuple

from nlp_gait.formulation import Parameter


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


def choose_natural_step(parameter: Parameter, value: float) -> NaturalStep:
    """Return the step of a parameter at its current value."""
    if parameter.unit in BY_UNIT:
        return BY_UNIT[parameter.unit]
    if value:
        return NaturalStep(SHARE * abs(value), MASS.words)
    return NaturalStep(SHARE, f"{SHARE:g} {parameter.unit}")
