"""Tables III and IV of Goswami, Vadakkepat, Phung (2008), as printed (``walk12_paper.toml``)."""

from collections.abc import Mapping
from dataclasses import dataclass

from compare.papers.claims import read_printed

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk12Paper:
    """Content of ``walk12_paper.toml``."""

    table_3: tuple[PaperRow, ...]
    table_4: tuple[PaperRow, ...]
    table_4_digits: tuple[float, float, float, float]  # half the last printed digit of x [m]
    hip_miss_mm: int  # ours: of the angles of (2), where all four variables are at their upper bounds
    # Ours, by what is read in another way: changes of f1 [%], errors of the ZMP by moments of the links [mm]
    changes: Mapping[str, tuple[float, float]]
    shares: Mapping[str, float]  # ours: of the gaits within the bounds (7) [%]


PAPER = read_printed(Walk12Paper, "walk12/walk12_paper.toml")
TABLE_3, TABLE_4, TABLE_4_DIGITS = PAPER.table_3, PAPER.table_4, PAPER.table_4_digits
CHANGES, SHARES = PAPER.changes, PAPER.shares


def find_row(weight: float) -> PaperRow:
    """Return the row of Table III with a lambda."""
    return next(row for row in TABLE_3 if row.weight == weight)
