"""Phases of NAO on its left foot whose joints' motion is given, so that torso and right foot follow from it."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import NumericPoint, Point
from nlp_gait.gaits.biped.phase import IN_TIME, Phase
from nlp_gait.gaits.biped.samples import Instant, Planner
from nlp_gait.gaits.nao.joints import KNEES
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.tape import simplify
from nlp_gait.symbolic.trajectories import Motion, constant_motion


@dataclass(frozen=True, kw_only=True, eq=False)
class JointPhase(Phase):
    """A phase on the left foot whose joints move along given curves.

    Quantities besides those of all phases: ``hip_rate`` (3, N + 1) [m/s]; ``along`` (1, N + 1), x of the right ankle; ``sides``
    (2, N + 1), y of the right sole's left corners; ``swing_heights`` are those of its four corners (4, N + 1) [m].
    """

    support: tuple[float, float, float]  # (3,) the left ankle, which stands [m]
    curves: Mapping[str, Sequence[str]]  # joints that each curve moves
    held: Mapping[str, float]  # angles of the joints that do not move [rad]
    other_joints: tuple[str, ...] = ()  # joints whose angles are the quantity ``other_angle`` (k, N + 1) [rad]
    plan: Planner = field(init=False)

    @abstractmethod
    def move(self, point: Any, ops: Nonsmooth, phases: MX | None = None) -> Any:
        """Return angles, velocities and accelerations of all curves (3 C, n) at the samples, or at other phases (1, n)."""

    def tie(self, values: MX, ops: Nonsmooth) -> MX:
        """Return a matrix whose entries may be variables of a gradient solver."""
        return values

    @cached_property
    def _joint_symbols(self) -> SX:
        return SX.sym("v", 3 * len(self.curves))

    @cached_property
    def _exact_now(self) -> Instant:
        v, count = self._joint_symbols, len(self.curves)
        joints = {name: constant_motion(angle) for name, angle in self.held.items()}
        for row, names in enumerate(self.curves.values()):
            joints |= dict.fromkeys(names, Motion(*(v[order * count + row] for order in range(3))))
        instant = self.loads(place_on_left_foot(self.body.robot, joints, self.support))
        return instant._replace(
            quantities={
                **instant.quantities,
                "hip_rate": ca.jtimes(instant.hip, v[:count], v[count : 2 * count]),
                "other_angle": ca.vertcat(*(joints[name].position for name in self.other_joints)),
            }
        )

    def _evaluate(self, points: Sequence[Point], ops: Nonsmooth, phases: MX | None) -> list[dict[str, Any]]:
        return [self._evaluate_names(self._names_read, point, ops, phases) for point in points]

    def _evaluate_histories(self, point: NumericPoint) -> dict[str, Any]:
        return self._evaluate_names(IN_TIME, point, Exact())

    def _evaluate_names(
        self, names: Sequence[str], point: Any, ops: Nonsmooth, phases: MX | None = None
    ) -> dict[str, Any]:
        """Return quantities by name: of single joints from the curves, all others by one function of these."""
        motions = self.tie(self.move(point, ops, phases), ops)
        n = motions.shape[1]
        q, qd, qdd = self._list_joints(motions)
        moving, joints = self.moving, self.body.joints
        values: dict[str, Any] = {
            "planned": _stack(q, self.body.planned),
            "reach": ca.cos(_stack(q, KNEES)),
            "miss": motions[:0, :],
            **{key: _stack(rows, moving) for key, rows in (("q", q), ("qd", qd), ("qdd", qdd))},
            **{key: _stack(rows, joints) for key, rows in (("all_q", q), ("all_qd", qd), ("all_qdd", qdd))},
            "other_angle": _stack(q, self.other_joints),
        }
        mapped = [name for name in names if name not in {*values, "power"}]
        outputs = [self.measure(name, self._exact_now) for name in mapped]
        if isinstance(motions, MX):  # a function that is evaluated once is not worth it
            outputs = simplify(outputs)
        columns = ca.Function("instant", [self._joint_symbols], outputs).map(n).call([motions])
        values |= {name: self.tie(column, ops) for name, column in zip(mapped, columns, strict=True)}
        values["power"] = ca.vertcat(*(qd[name] * values["torque"][joints.index(name), :] for name in moving))
        return {name: values[name] for name in names}

    def _list_joints(self, motions: Any) -> Iterator[dict[str, Any]]:
        """Return angles, velocities and accelerations (1, n) by joint from those of the curves."""
        for order, rows in enumerate(ca.vertsplit(motions, len(self.curves))):
            ones = DM.ones(1, motions.shape[1])
            held = {name: ones * (angle if order == 0 else 0.0) for name, angle in self.held.items()}
            curves = zip(self.curves.values(), ca.vertsplit(rows), strict=True)
            yield held | {name: row for names, row in curves for name in names}


def _stack(rows: Mapping[str, Any], joints: Sequence[str]) -> Any:
    return ca.vertcat(*(rows[name] for name in joints))


class FreeParts(NamedTuple):
    """Places of what does not stand."""

    torso: SX  # (3,) origin of the torso [m]
    ankle: SX  # (3,) of the right foot [m]
    corners: SX  # (3, 4) of the right sole [m]
    rotation: SX  # (3, 3) from the torso's axes


def locate_free_parts(robot: Robot, q: Mapping[str, SX], support: tuple[float, float, float]) -> FreeParts:
    """Return the places of torso and right foot of a robot with its left ankle at ``support`` [m], from joint angles [rad]."""
    tree = make_tree(robot, robot.feet["left"].link)
    poses = forward_kinematics(tree, q, SX(DM(support)))
    by_link = {body.link.name: pose for body, pose in zip(tree, poses, strict=True)}
    torso, foot = by_link[robot.root], robot.feet["right"]
    entry = next(body.joint for body in tree if body.link.name == robot.root)
    assert entry is not None  # the torso is not the fixed link; for the type checker
    ankle = by_link[foot.link]
    corners = [
        (along, across, -foot.ankle_height_m)
        for along in (-foot.back_m, foot.front_m)
        for across in (-foot.right_m, foot.left_m)
    ]
    return FreeParts(
        torso.position - torso.rotation @ DM(entry.origin_m),
        ankle.position,
        ca.repmat(ankle.position, 1, 4) + ankle.rotation @ DM(np.array(corners).T),
        torso.rotation,
    )


def place_on_left_foot(robot: Robot, joints: Mapping[str, Motion], support: tuple[float, float, float]) -> Instant:
    """Return the motion of a robot with its left ankle at ``support`` [m], from that of its joints."""
    places = locate_free_parts(robot, {name: motion.position for name, motion in joints.items()}, support)
    return Instant(
        joints=joints,
        hip=places.torso,
        ankles={"L": SX(DM(support)), "R": places.ankle},
        reach=ca.vertcat(*(ca.cos(joints[knee].position) for knee in KNEES)),
        quantities={
            "along": places.ankle[0],
            "swing_heights": places.corners[2, :].T,
            "sides": places.corners[1, 1::2].T,
        },
    )
