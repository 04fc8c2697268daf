"""Tables III and IV of the paper on the 12-joint walk, as printed.

Source:
    Goswami, Vadakkepat, Phung (2008), section 7.
"""

from __future__ import annotations

from dataclasses import dataclass

F1MAX = 442.522  # [1/(m^2 s)]
F2MAX = 0.13  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperRow:
    """A row of Table III (step time 1 s) or Table IV (lambda 0.15)."""

    weight: float  # lambda
    x: tuple[float, float, float, float]  # s, n, H, h [m]
    f: float  # the objective as printed
    step_time_s: float = 1.0  # T
    f1max: float = F1MAX  # f1 that counts as 1 [1/(m^2 s)]

    @property
    def implied_f1(self) -> float:
        """The f1 with which (11) gives the printed f."""
        return (self.f - (1 - self.weight) * self.x[0] / F2MAX) / self.weight * self.f1max


TABLE_3 = (
    PaperRow(weight=0.10, x=(0.125, 0.128, 0.010, 0.022), f=0.944),
    PaperRow(weight=0.15, x=(0.130, 0.109, 0.014, 0.020), f=0.965),
    PaperRow(weight=0.20, x=(0.124, 0.130, 0.006, 0.017), f=0.926),
    PaperRow(weight=0.40, x=(0.119, 0.108, 0.018, 0.016), f=0.903),
    PaperRow(weight=0.60, x=(0.104, 0.112, 0.013, 0.016), f=0.857),
    PaperRow(weight=0.90, x=(0.057, 0.127, 0.017, 0.018), f=0.939),
    PaperRow(weight=1.00, x=(0.055, 0.120, 0.026, 0.010), f=1.000),
)

TABLE_4 = (
    PaperRow(weight=0.15, step_time_s=2.0, x=(0.126, 0.12, 0.014, 0.0215), f1max=1258.90, f=0.9596),
    PaperRow(weight=0.15, step_time_s=1.5, x=(0.130, 0.11, 0.014, 0.0220), f1max=979.51, f=0.9612),
    PaperRow(weight=0.15, step_time_s=0.8, x=(0.130, 0.12, 0.014, 0.0200), f1max=382.66, f=0.9585),
    PaperRow(weight=0.15, step_time_s=0.5, x=(0.129, 0.11, 0.014, 0.0210), f1max=202.87, f=0.9645),
)


def find_row(weight: float) -> PaperRow:
    """Return the row of Table III with a lambda."""
    return next(row for row in TABLE_3 if row.weight == weight)
