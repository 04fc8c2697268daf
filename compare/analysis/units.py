"""Format numbers with units, and lists, for tables, figures and sentences.

The unit of a pure number is "1" and is not shown.
"""

from __future__ import annotations

import math
from collections.abc import Iterable


def number(value: float, digits: str) -> str:
    """Format a number; a value rounded to zero has no sign."""
    if isinstance(value, int):
        return format(value, digits)
    sign = digits[0] if digits[:1] in ("+", "-", " ") else ""
    return f"{value:{sign}z{digits.removeprefix(sign)}}"


def with_unit(value: float | None, unit: str, digits: str = ".6f") -> str:
    """Format a value with its unit, for example ``0.845868 W``; a dash for None."""
    if value is None:
        return "-"
    return number(value, digits) + ("" if unit == "1" else f" {unit}")


def seconds(value: float, digits: str = ".3f") -> str:
    """Format a time, for example ``0.013 s``; a dash for NaN, an unknown time."""
    return "-" if math.isnan(value) else f"{number(value, digits)} s"


def heading(words: str, unit: str) -> str:
    """Return a heading with its unit, for example ``power [W]``."""
    return words if unit == "1" else f"{words} [{unit}]"


def millimetres(value_m: float | None, digits: str = ".1f") -> str:
    """Format a length [m] in millimetres, for example ``24.3 mm``; a dash for None."""
    return with_unit(None if value_m is None else 1000 * value_m, "mm", digits)


def join_words(parts: Iterable[str]) -> str:
    """Join words: ``a``, ``a and b``, ``a, b and c``."""
    *most, last = [*parts] or [""]
    return f"{', '.join(most)} and {last}" if most else last
