"""Steps on the stairs as an engine is told to play them: the rear foot stands on the floor, the stance foot a rise above it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, NumericPoint, Signals, SimulationModel
from nlp_gait.formulation.display import SIMULATED, Tread
from nlp_gait.gaits.several_steps import walk
from nlp_gait.gaits.stairs.bodies import JOINTS, joint_angles, joint_torques, rigid_bodies, torso_lean
from nlp_gait.gaits.stairs.formulas.loads import JOINT_RATES, MOVING, link_angles, loads
from nlp_gait.gaits.stairs.formulas.planar_biped import LINKS, points
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import GRAVITY, SETBACK


class Performance(NamedTuple):
    """A step to be played; rows are instants.

    Attributes:
        t: (T,) [s].
        q: (T, 9) absolute angles of all links in the order of LINKS [rad].
        qd: (T, 9) [rad/s].
        qdd: (T, 9) [rad/s^2].
        tau: (T, 8) of the robot's joints [Nm].
        pressure: (T,) centre of pressure of everything that stands, ahead of the stance ankle [m].
        double_support_s: how long the rear foot bears, on its toe at last.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    pressure: Array
    double_support_s: float


def simulation_model(performance: Callable[[NumericPoint], Performance], *, repeats: bool = False) -> SimulationModel:
    """How a step is played.

    Args:
        performance: of a gait.
        repeats: the step ends as it began, a step further up and with the legs exchanged.
    """

    def motion(at: NumericPoint, steps: int) -> Signals:
        _, rise = _stair(at)
        return walk(_signals(performance(at), rise), rigid_bodies(), steps, rise_m=rise)

    def ground(at: NumericPoint, steps: int) -> tuple[Tread, ...]:
        tread, rise = _stair(at)
        return tuple(Tread(edge_m=k * tread - SETBACK, height_m=(k + 1) * rise) for k in range(steps + 1))

    return SimulationModel(
        robot=rigid_bodies(), gravity=GRAVITY, repeats=repeats, motion=motion, ground=ground, planar=True
    )


def standing(
    t: Array, q: Array, qd: Array, qdd: Array, toe: Array, sole: Array, double_support_s: float
) -> Performance:
    """A step over the flat stance foot.

    Args:
        t: (T,) [s].
        q: (T, 7) absolute angles of the moving links [rad].
        qd: (T, 7) [rad/s].
        qdd: (T, 7) [rad/s^2].
        toe: (T, 2) force of the ground on the rear toe [N].
        sole: (T, 2) on the rear sole joint [N].
        double_support_s: how long the rear foot bears.
    """
    torque, stance, pressure, toe_x, sole_x = (
        np.array(part).T for part in _loads().map(len(t))(q.T, qd.T, qdd.T, toe.T, sole.T)
    )
    carried = stance[:, 1] * pressure[:, 0] + toe[:, 1] * toe_x[:, 0] + sole[:, 1] * sole_x[:, 0]
    whole = stance[:, 1] + toe[:, 1] + sole[:, 1]
    flat = np.zeros((len(t), len(LINKS) - len(MOVING)))
    q, qd, qdd = (np.hstack([part, flat]) for part in (q, qd, qdd))
    return Performance(
        t,
        q,
        qd,
        qdd,
        joint_torques(torque, _standing_toe(stance[:, 1], pressure[:, 0])),
        carried / whole,
        double_support_s,
    )


def whole_force(q: Array, qd: Array, qdd: Array) -> Array:
    """(T, 2) force of the ground on the whole robot [N], from the motion of the moving links (T, 7)."""
    nothing = np.zeros((2, len(q)))
    return np.array(_loads().map(len(q))(q.T, qd.T, qdd.T, nothing, nothing)[1]).T


def driven(t: Array, state: Array, torque: Array, pressure: Array, double_support_s: float) -> Performance:
    """A step whose links were driven by torques against the world.

    A link's torque against the world cannot be built. Joints that give seven links theirs, and the toe that stands, leave over a
    moment on the stance foot: there the ground answers, not a motor.

    Args:
        t: (T,) [s].
        state: (T, 18) angles and rates of the links [rad], [rad/s].
        torque: (T, 9) on the links [Nm].
        pressure: (T,) ahead of the stance ankle [m].
        double_support_s: how long the rear foot bears.
    """
    q, qd = np.split(state, 2, axis=1)
    between = torque[:, : len(MOVING)] @ np.linalg.inv(JOINT_RATES)
    tau = joint_torques(between, torque[:, LINKS.index("S'T'")])
    return Performance(t - t[0], q, qd, np.gradient(qd, t, axis=0), tau, pressure, double_support_s - t[0])


def _signals(step: Performance, rise: float) -> Signals:
    hip, ankle, stance_ankle = (np.array(part).T for part in _places().map(len(step.t))(step.q.T))
    lean = torso_lean(step.q)
    still = np.zeros_like(lean)
    rear = (step.t <= step.double_support_s) | (step.t == step.t[-1])  # it lands at last

    def placed(point: Array) -> Array:
        """(T, 3) above the floor on which the rear foot stands."""
        return np.column_stack([point[:, 0], still, point[:, 1] + rise])

    arrays = {
        "t": step.t,
        "q": joint_angles(step.q),
        "qd": joint_angles(step.qd, rates=True),
        "qdd": joint_angles(step.qdd, rates=True),
        "tau": step.tau,
        "zmp": np.column_stack([step.pressure, still]),
        "hip": placed(hip),
        "attitude": np.column_stack([np.cos(lean / 2), still, np.sin(lean / 2), still]),
        "left_foot": placed(stance_ankle),
        "right_foot": placed(ankle),
        "left_bears": np.ones((len(step.t), 1)),
        "right_bears": rear[:, None].astype(float),
    }
    return Signals(joints=JOINTS, arrays=arrays, columns=SIMULATED)


def _standing_toe(load: Array, pressure: Array) -> Array:
    """(T,) torque of the standing toe, from the force on the whole foot [N] and its centre ahead of the ankle [m].

    Ahead of the joint, the toe alone can carry; with the pressure behind it, it lies on the ground and needs no torque.
    """
    biped = toe_foot_biped()
    weight = biped.link("ST").mass_kg * GRAVITY * biped.toe_m / 2
    return np.maximum(load * (pressure - biped.sole_m) - weight, 0.0)


def _stair(at: NumericPoint) -> tuple[float, float]:
    """Tread and rise [m]."""
    tread = float(at["stair_length_m"]) / 2
    return tread, tread * float(at["rise_run_ratio"])


@cache
def _loads() -> ca.Function:
    """One instant: loads as ``loads`` gives them, and where along x the points of the rear foot are."""
    q, qd, qdd = (SX.sym(name, len(MOVING)) for name in ("q", "qd", "qdd"))
    rear = {"T": SX.sym("toe", 2), "S": SX.sym("sole", 2)}
    found = points(toe_foot_biped().rods, link_angles(q), SX(2, 1))
    outputs = [*loads(toe_foot_biped().rods, GRAVITY, q, qd, qdd, rear), found["T"][0], found["S"][0]]
    return ca.Function("loads", [q, qd, qdd, *rear.values()], ca.cse(outputs))


@cache
def _places() -> ca.Function:
    q = SX.sym("q", len(LINKS))
    found = points(toe_foot_biped().rods, q, SX(2, 1))
    return ca.Function("places", [q], [found["H"], found["A"], found["A'"]])
