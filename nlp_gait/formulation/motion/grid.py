"""Instants at which a motion is evaluated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nlp_gait.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Instants at which a problem evaluates its motion.

    Attributes:
        intervals: equal parts over which limits on changes hold.
        samples_per_interval: above 1 for more samples than these limits need.
        refined_by: option of the problem's maker that gives a denser grid when multiplied; None if the variables depend on
            the grid, so that there is none.
    """

    intervals: int
    samples_per_interval: int = 1
    refined_by: Literal["intervals", "samples_per_interval"] | None = None

    def __post_init__(self) -> None:
        """Refuse what gives no grid."""
        for name in ("intervals", "samples_per_interval"):
            count = getattr(self, name)
            if isinstance(count, bool) or not isinstance(count, int) or count < 1:
                raise InputError(f"{name} must be a whole number >= 1, got {count!r}")

    @property
    def parts(self) -> int:
        """Equal parts between the samples."""
        return self.intervals * self.samples_per_interval
