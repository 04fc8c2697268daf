"""A problem with all robots of a box of uncertain masses and soles, and the worst corners of that box for a gait."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.questions.other_robot import present_value, robot_name, with_robot
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

# Limits for which a round looks for the worst corner: the largest violations, one of each group of rows.
CORNERS_IN_ROUND = 3
# A corner costs more than the worst known one if it does so by more than this share.
COST_TOLERANCE = 1e-6

Box = Mapping[str, float]  # half-widths by the robot's quantity
Corner = tuple[int, ...]  # +1 or -1 for each quantity of the box


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The worst that a gait meets in a set of robots.

    Attributes:
        violation: largest, of one row, in its unit; 0 if all limits hold.
        row: whose it is.
        unit: of the violation.
        corner: changes of the quantities of the robot for which it happens.
        power_W: largest over all robots of the set.
    """

    violation: float
    row: str
    unit: str
    corner: Mapping[str, float]
    power_W: float


class Family:
    """A problem with all robots of a box, under the same limits; each is built once."""

    def __init__(self, spec: ProblemSpec, box: Box) -> None:
        self._spec, self._box = spec, box
        self.nominal = spec.load()
        self._problems: dict[Corner, GaitProblem] = {}

    @property
    def centre(self) -> Corner:
        """The corner without a change."""
        return (0,) * len(self._box)

    def changes(self, corner: Corner) -> dict[str, float]:
        """Changes of the robot's quantities, shares of masses and lengths."""
        return {name: sign * half for (name, half), sign in zip(self._box.items(), corner, strict=True) if sign}

    def robot(self, corner: Corner) -> str:
        """Name of a corner's robot."""
        return robot_name(self.nominal, self._values(corner))

    def values(self, corner: Corner, x: Array) -> ExactValues:
        """Exact values at x (n,) with a corner's robot."""
        return build_exact_model(self.problem(corner)).at(x, self.nominal.p)

    def problem(self, corner: Corner) -> GaitProblem:
        """The problem with a corner's robot."""
        if not any(corner):
            return self.nominal
        if corner not in self._problems:
            self._problems[corner] = with_robot(self._spec, self._values(corner))
        return self._problems[corner]

    def _values(self, corner: Corner) -> dict[str, float]:
        return {name: present_value(self.nominal, name) + by for name, by in self.changes(corner).items()}

    def worst(self, x: Array, corners: Sequence[Corner]) -> Worst:
        """The worst that a gait meets in some corners; rows are compared in units of their scales."""
        model = build_exact_model(self.nominal)
        largest = (-np.inf, 0, 0.0, self.centre)
        power = -np.inf
        for corner in corners:
            at = self.values(corner, x)
            power = max(power, at.cost)
            excess = np.maximum(np.maximum(at.lower - at.g, at.g - at.upper), 0.0)
            i = int(np.argmax(excess / model.row_scales))
            largest = max(largest, (float(excess[i] / model.row_scales[i]), i, float(excess[i]), corner))
        _, i, violation, corner = largest
        return Worst(
            violation=violation,
            row=model.row_names[i] if violation > 0.0 else "",
            unit=model.row_units[i],
            corner=self.changes(corner),
            power_W=power,
        )

    def worst_corners(self, x: Array, known: Sequence[Corner], cost: float) -> list[Corner]:
        """New corners that break a limit at x, or cost more than is known: the worst by the rows' derivatives."""
        model = build_exact_model(self.nominal)
        own = self.values(self.centre, x)
        slopes, cost_slopes = [], []
        for k in range(len(self._box)):
            high, low = (self.values(tuple(sign * (i == k) for i in range(len(self._box))), x) for sign in (1, -1))
            slopes.append((high.g - low.g) / 2)
            cost_slopes.append((high.cost - low.cost) / 2)
        slope = np.array(slopes)
        reach = np.abs(slope).sum(axis=0)
        short = (own.lower - own.g + reach) / model.row_scales
        long = (own.g + reach - own.upper) / model.row_scales
        candidates = [tuple(np.where(np.array(cost_slopes) >= 0.0, 1, -1).tolist())]
        groups: set[str] = set()
        for i in np.argsort(-np.maximum(short, long)):
            group = model.row_names[i].partition("[")[0]
            if max(short[i], long[i]) <= FEASIBILITY_TOLERANCE or len(groups) == CORNERS_IN_ROUND:
                break
            if group not in groups:
                groups.add(group)
                sign = 1 if long[i] >= short[i] else -1
                candidates.append(tuple(np.where(sign * slope[:, i] >= 0.0, 1, -1).tolist()))
        return [corner for corner in dict.fromkeys(candidates) if corner not in known and self._worse(corner, x, cost)]

    def _worse(self, corner: Corner, x: Array, cost: float) -> bool:
        at = self.values(corner, x)
        return not at.violation <= FEASIBILITY_TOLERANCE or at.cost > cost * (1.0 + COST_TOLERANCE)
