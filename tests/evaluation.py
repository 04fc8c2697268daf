"""A problem's exact functions at a point, read by name."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem

# The same sums in another order.
ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """What the exact functions say of a point.

    Attributes:
        cost: what is minimised.
        violation: in total.
        g: (m,) values of the rows, between lower and upper (m,) where they hold.
        indexes: by name.
        row_names: (m,).
    """

    cost: float
    violation: float
    g: Array
    lower: Array
    upper: Array
    indexes: Mapping[str, float]
    row_names: tuple[str, ...]

    @property
    def rows(self) -> dict[str, float]:
        """Values of the rows by name."""
        return dict(zip(self.row_names, self.g.tolist(), strict=True))

    @property
    def broken(self) -> set[str]:
        """Names of the rows that do not hold."""
        holds = (self.lower <= self.g) & (self.g <= self.upper)
        return {name for name, kept in zip(self.row_names, holds, strict=True) if not kept}


def evaluated(problem: GaitProblem, x: Array | Sequence[float]) -> Evaluation:
    """The exact functions at x (n,) and the current parameter values."""
    model = build_exact_model(problem)
    return Evaluation(**model.at(x, problem.p)._asdict(), row_names=model.row_names)


def check_power(problem: GaitProblem, candidates: Iterable[Array]) -> None:
    """The objective is the mean power of the signals, to rounding."""
    for x in candidates:
        arrays = problem.signals(x).arrays
        tau, qd, t = (arrays[key] for key in ("tau", "qd", "t"))
        power = np.trapezoid((np.abs(tau * qd) + 0.025 * tau**2).sum(axis=1), t) / t[-1]
        assert evaluated(problem, x).cost == pytest.approx(power, rel=ROUNDING)
