"""A problem's exact functions at a point, read by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """What the exact functions say of a point."""

    cost: float  #: what is minimised
    violation: float  #: in total
    g: Array  #: (m,) values of the rows, between lower and upper (m,) where they hold
    lower: Array
    upper: Array
    metrics: Mapping[str, float]  #: by name
    row_names: tuple[str, ...]  #: (m,)

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
