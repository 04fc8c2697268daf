"""Numbers with their units, and lists, as tables, figures and sentences show them.

The unit of a pure number is "1" and is not shown.
"""

from __future__ import annotations

import math
from collections.abc import Iterable


def number(value: float, digits: str) -> str:
    """A number in a format; what is rounded to zero has no sign."""
    if isinstance(value, int):
        return format(value, digits)
    sign = digits[0] if digits[:1] in ("+", "-", " ") else ""
    return f"{value:{sign}z{digits.removeprefix(sign)}}"


def with_unit(value: float | None, unit: str, digits: str = ".6f") -> str:
    """For example ``0.845868 W``; a dash for None."""
    if value is None:
        return "-"
    return number(value, digits) + ("" if unit == "1" else f" {unit}")


def seconds(value: float, digits: str = ".3f") -> str:
    """For example ``0.013 s``; a dash for NaN, a time that nobody knows."""
    return "-" if math.isnan(value) else f"{number(value, digits)} s"


def heading(words: str, unit: str) -> str:
    """For example ``power [W]``."""
    return words if unit == "1" else f"{words} [{unit}]"


def millimetres(value_m: float | None, digits: str = ".1f") -> str:
    """A length [m], for example ``24.3 mm``; a dash for None."""
    return with_unit(None if value_m is None else 1000 * value_m, "mm", digits)


def listed(parts: Iterable[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``; nothing of nothing."""
    *most, last = [*parts] or [""]
    return f"{', '.join(most)} and {last}" if most else last
