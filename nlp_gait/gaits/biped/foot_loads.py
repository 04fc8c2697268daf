"""Load shared freely in double support: the ground's wrench on the second foot as part of the plan.

Two standing feet make a closed chain: the motion fixes only the sum of both wrenches, and how they share it is the controller's
choice. Here the wrench on the right sole is a polynomial of the phase whose coefficients are variables; that on the left one and
the torques of both legs follow. What flat soles on a rough floor can bear limits both.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, InstantPoint, Point, Start, Variable
from nlp_gait.formulation.assembly import parameters as table
from nlp_gait.formulation.blocks import labels
from nlp_gait.gaits.biped.instant import BOTH_FEET, Loader, Loads, PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import Contribution, Part, rows
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import SOLE_FRICTION, above, below, sole_limits, zmp_of_wrench
from nlp_gait.symbolic.dynamics import Wrench, newton_euler
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

COMPONENTS = {f"{half}_{axis}": unit for half, unit in (("force", "N"), ("moment", "Nm")) for axis in "xyz"}
LARGEST_DEGREE = 12
# Part of the phase, at either end, in which a foot takes over load or hands it on: a low polynomial alone cannot begin at zero
# and be elsewhere soon after.
RAMP_SHARE = 0.05
RAMPS = 2
# Coefficients start near a load that passes evenly from foot to foot, off it by at most this share of their bounds.
START_SHARE = 0.02
CORNERS = ("+x", "-x", "+y", "-y")
TURNS = tuple(f"{sense}{first}{second}" for sense in "+-" for first in "+-" for second in "+-")


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedWrench:
    """Wrench of the ground on the right sole, about the point under its ankle: polynomials in Bernstein form, and ramps.

    Attributes:
        robot: with links welded that never move.
        weight: of the robot [N].
        degree: of the polynomials.

    Raises:
        InputError: a degree that is not allowed.
    """

    robot: Robot
    weight: float
    degree: int

    def __post_init__(self) -> None:
        """Refuse a degree that leaves no polynomial, or one beyond use."""
        if not 1 <= self.degree <= LARGEST_DEGREE:
            raise InputError(f"load_degree must be within [1, {LARGEST_DEGREE}], got {self.degree}")

    @property
    def count(self) -> int:
        """Coefficients of each component."""
        return self.degree + 1 + RAMPS

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Coefficients, component by component; bounds are wide, for coefficients may lie beyond what the curve reaches."""
        foot, weight = self.robot.feet["right"], self.weight
        along, across = max(foot.front_m, foot.back_m), max(foot.left_m, foot.right_m)
        most = dict(zip(COMPONENTS, (0.5, 0.5, 2.0, across, along, across), strict=True))
        return tuple(
            Variable(
                name=f"right_{component}_{unit}[{k}]",
                unit=unit,
                lower=-(weight if component == "force_z" else round(share * weight, 3)),
                upper=round(share * weight, 3),
                description=f"coefficient {k} of the ground's {component.replace('_', ' along ')} on the right sole",
            )
            for (component, unit), share in zip(COMPONENTS.items(), most.values(), strict=True)
            for k in range(self.count)
        )

    def planned(self, plan: Planner) -> Planner:
        """A motion with this wrench."""
        names = [variable.name for variable in self.variables]

        def both(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
            values = ca.reshape(ca.vertcat(*(at[name] for name in names)), self.count, len(COMPONENTS))
            return plan(at, phase, ops)._replace(wrench=values.T @ load_basis(self.degree, phase))

        return both

    def load_slope(self, at: InstantPoint, phase: SX) -> SX:
        """Derivative of the load on the right sole with respect to the phase [N]."""
        own = [v.name for v in self.variables if v.name.startswith("right_force_z")]
        return ca.dot(ca.vertcat(*(at[name] for name in own)), ca.jacobian(load_basis(self.degree, phase), phase))

    def start_of(self, names: Sequence[str], others: Start | None) -> Start:
        """Start points of variables: a load that passes evenly to the right foot, and the others as without it."""
        own = [variable.name for variable in self.variables]
        places = [names.index(name) for name in own]
        middle = np.zeros((len(COMPONENTS), self.count))
        middle[list(COMPONENTS).index("force_z"), :-RAMPS] = np.linspace(0.0, self.weight, self.degree + 1)

        def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
            lower, upper = (np.array([parameters[f"{name}.{end}"] for name in names]) for end in ("lower", "upper"))
            x = rng.uniform(lower, upper) if others is None else others(parameters, rng)
            width = START_SHARE * (upper - lower)[places] / 2
            x[places] = middle.ravel() + rng.uniform(-width, width)
            return x

        return start


def load_basis(degree: int, phase: SX) -> SX:
    """(degree + 3,) Bernstein polynomials of the phase, and cubic ramps down from its start and up to its end."""
    ramps = (ca.fmax(0, 1 - far / RAMP_SHARE) ** 3 for far in (phase, 1 - phase))
    return ca.vertcat(
        *(math.comb(degree, k) * phase**k * (1 - phase) ** (degree - k) for k in range(degree + 1)), *ramps
    )


def planned_loads(robot: Robot, gravity: float, upright: Collection[str]) -> Loader:
    """Torques of the whole tree from the left foot with the planned wrench on the right one, and the ZMP of both feet.

    Args:
        robot: with links welded that never move.
        gravity: [m/s^2].
        upright: links that never turn.
    """
    tree, weight = tree_from(robot, robot.feet["left"].link), robot.mass_kg * gravity
    left, right = robot.feet["left"], robot.feet["right"]

    def loads(joints: Mapping[str, Motion], hip: SX, feet: Mapping[str, SX], wrench: SX) -> Loads:
        q, qd, qdd = ({name: motion[order] for name, motion in joints.items()} for order in range(3))
        pushes = {right.link: above(wrench, right.ankle_height_m)}
        torques, at_ankle = newton_euler(tree, q, qd, qdd, gravity, upright=upright, pushes=pushes)
        own = below(at_ankle, left.ankle_height_m)
        arm = ca.vertcat(feet["R"] - feet["L"], 0)
        both = own + wrench + ca.vertcat(SX(3, 1), ca.cross(arm, wrench[:3]))
        offset = zmp_of_wrench(Wrench(both[:3], both[3:]), 0.0, weight)
        return Loads(torques, feet["L"] + offset, {"L": own, "R": wrench})

    return loads


class FootLimits(Part):
    """What both soles can bear at every sample, and how fast load may pass from the left to the right foot.

    That the ground does not pull follows from friction and pressure together.

    Args:
        planned: wrench on the right sole.
    """

    reads_wrenches = True
    parameters = table(
        ("friction_coefficient", "1", SOLE_FRICTION, "of both soles on the ground", 0.0, math.inf),
        ("load_rate_limit_1_s", "1/s", 12.5, "fastest change of a foot's load, in weights a second", 0.0, math.inf),
        (
            "switch_load_limit",
            "1",
            1.0,
            "largest load, in weights, of the foot that has just landed and of the one about to lift; all of it by default",
            0.0,
            math.inf,
        ),
    )

    def __init__(self, planned: PlannedWrench) -> None:
        self._robot, self._weight = planned.robot, planned.weight
        self.traces = {"load_slope": planned.load_slope}

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows with a lower bound for the soles, two-sided ones for the change of load, and how near all come to their limits."""
        n, mu = samples.steps + 1, at["friction_coefficient"]
        found, loads = [], {}
        for side, foot in BOTH_FEET.items():
            kinds = self._bearing(foot).map(n)(samples.wrenches[side], ca.repmat(mu, 1, n))
            for (name, unit, names), values in zip(ROWS, kinds, strict=True):
                found.append(
                    rows(f"{foot}_{name}", unit, ca.vec(values), MX(0.0), None, labels(names, range(n)), "instant")
                )
            loads[foot] = samples.wrenches[side][2, :] / self._weight
        # The right foot's load is known with its slope, the left one has the rest of a total that changes slowly.
        right = samples.traces["load_slope"] / (samples.step_s * samples.steps * self._weight)
        total = loads["left"] + loads["right"]
        changes = (total[1:] - total[:-1]) / samples.step_s
        rates = {"left": ca.horzcat(changes[0], (changes[:-1] + changes[1:]) / 2, changes[-1]) - right, "right": right}
        limit = at["load_rate_limit_1_s"]
        names = labels(tuple(rates), range(n))
        ends = ca.vertcat(loads["right"][0], loads["left"][-1])
        return Contribution(
            rows=(
                *found,
                rows("load_rate", "1/s", ca.vec(ca.vertcat(*rates.values())), -limit, limit, names, "samples"),
                rows(
                    "switch_load",
                    "1",
                    ends,
                    None,
                    at["switch_load_limit"],
                    ("right, landed", "left, lifting"),
                    over="once",
                ),
            ),
            indexes={
                "load_rate_1_s": ca.mmax(ca.fabs(ca.vertcat(*rates.values()))),
                "switch_load": ca.mmax(ends),
            },
        )

    def _bearing(self, side: str) -> ca.Function:
        foot, wrench, mu = self._robot.feet[side], SX.sym("wrench", 6), SX.sym("mu")
        limits = sole_limits(wrench, (-foot.back_m, foot.front_m), (-foot.right_m, foot.left_m), mu)
        return ca.Function("bearing", [wrench, mu], list(limits))


ROWS = (("friction", "N", CORNERS), ("pressure", "Nm", CORNERS), ("turning", "Nm", TURNS))
