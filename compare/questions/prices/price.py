"""Prices as data: what a change of one quantity does to an optimum, and the answer for one problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from nlp_gait.decoding import decode

# A variable that moves by less than this share of its range over a natural step stands still.
STANDS = 1e-9


@dataclass(frozen=True, kw_only=True)
class Price:
    """What a change of one quantity does to the optimum.

    Attributes:
        name: of the parameter, or of the robot's quantity.
        unit: of the quantity; ``"1"`` for a factor.
        value: its current value, 0 for what is added to a length.
        slope: change of the optimal objective for each unit.
        step: natural step [unit].
        words: the step in words, for example ``"1 mm"``.
        reach: how far the quantity may change, down and up, while x* moves along one line.
        x: change of x* for each unit, by variable name; None where dependent bounds contradict each other.
        resolved: the objective's slope by solving again a little lower and higher; None if that was not asked for.
        x_error: largest difference of ``x`` and what solving again gives, in units of the largest entry; None without one.
        one_step: change of the objective by solving again a natural step lower and higher; None where it failed.
    """

    name: str
    unit: str
    value: float
    slope: float
    step: float
    words: str
    reach: tuple[float, float]
    x: Mapping[str, float] | None
    resolved: float | None = None
    x_error: float | None = None
    one_step: tuple[float | None, float | None] | None = None

    @property
    def per_step(self) -> float:
        """Change of the objective over a natural step, by the slope."""
        return self.slope * self.step

    @property
    def error(self) -> float | None:
        """Relative difference of the slope and what solving again gives."""
        if self.resolved is None:
            return None
        return abs(self.resolved - self.slope) / max(abs(self.slope), abs(self.resolved))

    def furthest(self, ranges: Mapping[str, float]) -> tuple[str, float] | None:
        """The variable that moves furthest in units of its range, and by how much in its own unit over a natural step.

        None if there is no derivative, or nothing moves.
        """
        moves = self.x or {}
        name = max(moves, key=lambda variable: abs(moves[variable]) / ranges[variable], default="")
        still = not name or abs(moves[name] * self.step) < STANDS * ranges[name]
        return None if still else (name, moves[name] * self.step)

    def plain(self) -> dict[str, Any]:
        """As plain data that gives back every bit: JSON has no infinity, so that the reach is text."""
        return {**asdict(self), "reach": [repr(end) for end in self.reach]}


def price_from(raw: Mapping[str, Any]) -> Price:
    """The price that ``Price.plain`` was asked of."""
    return decode(Price, {**raw, "reach": [float(end) for end in raw["reach"]]})


@dataclass(frozen=True, kw_only=True)
class Prices:
    """Answer for one problem.

    Attributes:
        problem: its name.
        objective_name: for example ``"power"``.
        unit: of the objective.
        sense: in which it is optimised.
        objective: at the optimum.
        x: by variable name.
        limits: parameters with a price, dearest step first.
        free: number of parameters without one.
        robot: quantities of the robot, largest change first; empty if the problem has no robot to choose.
        weak: bounds that hold without a price, or nearly hold: beyond them a derivative is one-sided.
        dependent: active rows that follow from others.
        residual: of the first-order conditions.
        reason: why there are no derivatives; None if there are.
    """

    problem: str
    objective_name: str
    unit: str
    sense: str
    objective: float
    x: Mapping[str, float]
    limits: tuple[Price, ...]
    free: int
    robot: tuple[Price, ...]
    weak: tuple[str, ...]
    dependent: int
    residual: float
    reason: str | None
