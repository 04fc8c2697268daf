"""Both feet on the ground: how they share the load, and the box in which the ZMP has to be."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeAlias, TypeVar

from casadi import MX, SX

from nlp_gait.formulation import Start, Variable
from nlp_gait.gaits.biped.foot_loads import FootLimits, PlannedWrench, planned_loads
from nlp_gait.gaits.biped.instant import BOTH_FEET, Loader, Loads, Planner
from nlp_gait.gaits.biped.parts import Margins, Part
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import below, combine_zmps, ground_load, zmp_of_wrench
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

# Section 4.2: least mean margins of 0.08 m, in the box of 0.21 m by 0.18 m around NAO's soles.
MEAN_DBM_SHARES = (8 / 21, 4 / 9)

Division = Literal["printed", "lever"]
TorsoShare = Literal["printed", "lever", "free"]
LOAD_DEGREE = 4
Point2: TypeAlias = tuple[float, float]
Side = TypeVar("Side", float, MX)


class Box(NamedTuple, Generic[Side]):
    """Sides of the rectangle around both soles [m]."""

    back: Side
    front: Side
    right: float
    left: float


def support_box(robot: Robot, soles: Mapping[str, Point2]) -> Box[float]:
    """Rectangle around both soles, whose ankles stand at ``soles`` by side."""
    feet = {side: robot.feet[foot] for side, foot in BOTH_FEET.items()}
    return Box(
        back=min(soles[side][0] - foot.back_m for side, foot in feet.items()),
        front=max(soles[side][0] + foot.front_m for side, foot in feet.items()),
        right=min(soles[side][1] - foot.right_m for side, foot in feet.items()),
        left=max(soles[side][1] + foot.left_m for side, foot in feet.items()),
    )


def double_support_mean_margins(box: Box[float]) -> Point2:
    """Least mean balance margins in x and y as shares of the box, to a tenth of a millimetre [m]."""
    along, across = MEAN_DBM_SHARES
    return round(along * (box.front - box.back), 4), round(across * (box.left - box.right), 4)


def double_support_margins(box: Box[float]) -> Margins:
    """Balance margins in x and y: distances to the sides of the box around both soles.

    Source:
        Gupta, Pratihar, Deb (2023), Fig. 8 (b).
    """
    return lambda zmp, at, ops: margins_in(box, zmp, ops)


def margins_in(box: Box[float] | Box[MX], zmp: MX, ops: Nonsmooth) -> tuple[MX, MX]:
    """Distances (1, N + 1) of the ZMP (2, N + 1) to the sides of a box in x and in y [m]."""
    x, y = zmp[0, :].T, zmp[1, :].T
    return ops.min(box.front - x, x - box.back).T, ops.min(box.left - y, y - box.right).T


def torso_shares(hip_y: SX, rule: Division, feet_y: Point2 = (0.05, -0.05)) -> dict[str, SX]:
    """Share of the torso's mass that each leg carries, from the hip's distances to the feet; both add up to 1.

    With signed distances, so that a hip beyond a foot gives a share beyond 0 and 1 and no kink.

    Args:
        hip_y: position of the hip across the walking direction [m].
        rule: ``"printed"`` is proportional to the distance *from* that leg's own foot, as in the equations; ``"lever"`` to
            the distance from the other foot, as the text says: the nearer foot carries more.
        feet_y: of the left and the right foot [m]; by default those of NAO.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (28), (29).
    """
    from_left, from_right = feet_y[0] - hip_y, hip_y - feet_y[1]
    width = feet_y[0] - feet_y[1]
    left, right = from_left / width, from_right / width  # (eqs. 28, 29)
    return {"L": left, "R": right} if rule == "printed" else {"L": right, "R": left}


class Sharing(NamedTuple):
    """What sharing the load in double support adds to a problem.

    Attributes:
        variables: of the planned wrench.
        planned: adds that wrench to a motion.
        loads: torques and ZMP.
        parts: that limit it.
        start_of: start points of variables by name, from those of the others.
    """

    variables: tuple[Variable, ...]
    planned: Callable[[Planner], Planner]
    loads: Loader
    parts: tuple[Part, ...]
    start_of: Callable[[Sequence[str], Start | None], Start | None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """A robot on both feet, each half of which may be taken by itself.

    Attributes:
        robot: with links welded that never move.
        halves: joints of the left and the right half by ``"L"`` and ``"R"``; the root belongs to both.
        feet_y: of the left and the right foot [m].
        gravity: [m/s^2].
        upright: links that never turn.
    """

    robot: Robot
    halves: Mapping[str, Sequence[str]]
    feet_y: Point2
    gravity: float
    upright: Collection[str]

    def sharing(self, rule: TorsoShare, degree: int) -> Sharing:
        """By a rule of the paper, or planned freely.

        Args:
            rule: see ``torso_shares``; ``"free"`` plans the wrench on the right foot.
            degree: of that wrench over the phase.
        """
        if rule != "free":
            return Sharing((), lambda plan: plan, self.loads(rule), (), lambda _, start: start)
        wrench = PlannedWrench(robot=self.robot, weight=self.robot.mass_kg * self.gravity, degree=degree)
        loads = planned_loads(self.robot, self.gravity, self.upright)
        return Sharing(wrench.variables, wrench.planned, loads, (FootLimits(wrench),), wrench.start_of)

    def loads(self, rule: Division) -> Loader:
        """Torques of each half from its own foot, and the combined ZMP of both feet."""
        robot = self.robot
        trees = {side: tree_from(robot, robot.feet[foot].link, self.halves[side]) for side, foot in BOTH_FEET.items()}
        weight = robot.mass_kg * self.gravity

        def loads(joints: Mapping[str, Motion], hip: SX, feet: Mapping[str, SX], _: SX) -> Loads:
            q, qd, qdd = ({name: motion[order] for name, motion in joints.items()} for order in range(3))
            shares = torso_shares(hip[1], rule, self.feet_y)
            torques: dict[str, SX] = {}
            zmps, ground_loads, wrenches = [], [], {}
            for side, tree in trees.items():
                half, wrench = newton_euler(tree, q, qd, qdd, self.gravity, {robot.root: shares[side]}, self.upright)
                height = robot.feet[BOTH_FEET[side]].ankle_height_m
                offset = zmp_of_wrench(wrench, height, weight)
                wrenches[side] = below(wrench, height)
                torques |= half
                zmps.append(feet[side] + offset)
                ground_loads.append(ground_load(wrench, weight))
            return Loads(torques, combine_zmps(zmps, ground_loads), wrenches)

        return loads
