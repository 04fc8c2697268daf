"""All robots in a box of uncertain masses and soles, and the corners of the box that are worst for a gait."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.questions.perturbed_problem import get_quantity, name_robot, perturb_robot
from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

# Number of limits for which a round looks for the worst corner: those violated most, one of each group of rows.
CORNERS_IN_ROUND = 3
# A corner costs more than the worst known one if it does so by more than this share.
COST_TOLERANCE = 1e-6

Box = Mapping[str, float]  # half-widths by the robot's quantity
Corner = tuple[int, ...]  # +1 or -1 for each quantity of the box


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The worst case of a gait over a set of robots."""

    violation: float  #: largest of one row, in its unit; 0 if all limits are satisfied
    row: str  #: its name
    unit: str  #: of the violation
    corner: Mapping[str, float]  #: changes of the quantities of that robot
    power_W: float  #: largest over all robots of the set


class RobotBox:
    """A problem with all robots in a box and the same limits; each is built once."""

    def __init__(self, nominal: GaitProblem, box: Box) -> None:
        self.nominal, self._box = nominal, box
        self.centre: Corner = (0,) * len(box)
        self._problems: dict[Corner, GaitProblem] = {self.centre: nominal}

    def changes(self, corner: Corner) -> dict[str, float]:
        """Return the changes of the robot's quantities, shares of masses and lengths."""
        return {name: sign * half for (name, half), sign in zip(self._box.items(), corner, strict=True) if sign}

    def name_robot(self, corner: Corner) -> str:
        """Return the name of a corner's robot."""
        return name_robot(self.nominal, self._values(corner))

    def evaluate(self, corner: Corner, x: Array) -> ExactValues:
        """Return the exact values at x (n,) with a corner's robot."""
        return build_exact_model(self.problem(corner)).at(x, self.nominal.p)

    def problem(self, corner: Corner) -> GaitProblem:
        """Return the problem with a corner's robot."""
        if corner not in self._problems:
            self._problems[corner] = perturb_robot(self.nominal, self._values(corner))
        return self._problems[corner]

    def _values(self, corner: Corner) -> dict[str, float]:
        return {name: get_quantity(self.nominal, name) + by for name, by in self.changes(corner).items()}

    def find_worst(self, x: Array, corners: Sequence[Corner]) -> Worst:
        """Return the worst case of a gait over some corners; rows are compared in units of their scales."""
        model = build_exact_model(self.nominal)
        largest = (-np.inf, 0, 0.0, self.centre)
        power = -np.inf
        for corner in corners:
            values = self.evaluate(corner, x)
            power = max(power, values.cost)
            violations = np.maximum(np.maximum(values.lower - values.g, values.g - values.upper), 0.0)
            i = int(np.argmax(violations / model.row_scales))
            largest = max(largest, (float(violations[i] / model.row_scales[i]), i, float(violations[i]), corner))
        _, i, violation, corner = largest
        return Worst(
            violation=violation,
            row=model.row_names[i] if violation > 0.0 else "",
            unit=model.row_units[i],
            corner=self.changes(corner),
            power_W=power,
        )

    def find_worse_corners(self, x: Array, known: Sequence[Corner], cost: float) -> list[Corner]:
        """Return new corners that violate a limit at x or cost more than is known; found by the rows' derivatives."""
        model, count = build_exact_model(self.nominal), len(self._box)
        centre = self.evaluate(self.centre, x)
        slopes, cost_slopes = [], []
        for k in range(count):
            high, low = (self.evaluate(tuple(sign * (i == k) for i in range(count)), x) for sign in (1, -1))
            slopes.append((high.g - low.g) / 2)
            cost_slopes.append((high.cost - low.cost) / 2)
        slope = np.array(slopes)
        reach = np.abs(slope).sum(axis=0)
        below = (centre.lower - centre.g + reach) / model.row_scales
        above = (centre.g + reach - centre.upper) / model.row_scales
        candidates = [tuple(np.where(np.array(cost_slopes) >= 0.0, 1, -1).tolist())]
        groups: set[str] = set()
        for i in np.argsort(-np.maximum(below, above)):
            group = model.row_names[i].partition("[")[0]
            if max(below[i], above[i]) <= FEASIBILITY_TOLERANCE or len(groups) == CORNERS_IN_ROUND:
                break
            if group not in groups:
                groups.add(group)
                sign = 1 if above[i] >= below[i] else -1
                candidates.append(tuple(np.where(sign * slope[:, i] >= 0.0, 1, -1).tolist()))
        return [corner for corner in dict.fromkeys(candidates) if corner not in known and self._worse(corner, x, cost)]

    def _worse(self, corner: Corner, x: Array, cost: float) -> bool:
        values = self.evaluate(corner, x)
        return not values.violation <= FEASIBILITY_TOLERANCE or values.cost > cost * (1.0 + COST_TOLERANCE)
