"""Consecutive steps of the 12-joint biped with exchanged stance and swing legs, straight or in a circle, and their drawing.

The left leg (theta 1 to 6, ankle to hip) stands first. Every second step is the mirror image of the first: the legs change
roles, roll angles and the side of all positions change sign. On a circle the swing leg is yawed by K at its hip, theta 9 in
odd steps and theta 4 in even ones, and the robot heads by K further to the left after each step.

Source:
    Goswami, Vadakkepat, Phung (2008), sections 4 and 5.4.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, Columns, NumericPoint, Signals, display, make_vector_columns
from nlp_gait.gaits.walk12 import walk12_model
from nlp_gait.gaits.walk12.walk12_model import PointMassBiped
from nlp_gait.symbolic.nonsmooth import Exact

JOINTS = tuple(f"theta_{i}" for i in range(1, 13))
# Columns of a leg's joints in the order of ``LegMotion.joints``: ankle roll, ankle pitch, knee, hip pitch, hip roll.
COLUMNS = {"left": [0, 1, 2, 4, 5], "right": [11, 10, 9, 7, 6]}
YAW_COLUMN = {"left": 3, "right": 8}
LEG_POINTS = ("hip", "knee", "ankle")
COLUMNS_OF = {
    **{name: make_vector_columns("m", "xy") for name in ("zmp", "zmp_foot")},
    **{name: make_vector_columns("m") for name in ("waist", "com")},
    **{f"{side}_{joint}": make_vector_columns("m") for side in ("left", "right") for joint in LEG_POINTS},
    "left_stance": Columns(unit="1"),
}
MIRRORED_ROLLS = np.array([-1.0, 1.0, 1.0, 1.0, -1.0])


def compute_steps(
    robot: walk12_model.PointMassBiped,
    x: Array,
    *,
    step_time_s: float = 1.0,
    turn_rad: float = 0.0,
    reach_margin_rad: float = 0.05,
    steps: int = 2,
    intervals: int = 20,
    zmp: walk12_model.Zmp = "exact",
) -> Signals:
    """Compute time histories over some steps, with x (4,), T, K and kappa as in the problem.

    Where two steps meet, the sample belongs to the earlier one. The printed trajectories jump there: the hip's lateral velocity
    (by n pi / T), and with a turn also theta 4 and theta 9, which the paper takes as constant over a step. The reach margin kappa
    has an effect only where a leg is out of reach.

    Returns:
        t [s]; q, qd, qdd (columns theta_1 to theta_12); zmp, waist (between the hips), com, hip, knee and ankle of both legs in
        the world, whose origin is the first stance ankle [m]; zmp_foot, the ZMP relative to the stance ankle in the foot's
        axes [m]; left_stance, 1 where the left leg stands.
    """
    sample = _make_sample_function(robot, zmp).map(intervals + 1)
    phases = np.linspace(0.0, 1.0, intervals + 1)
    ankle, heading = np.zeros(3), 0.0
    arrays_of_steps: list[dict[str, Array]] = []
    for step in range(steps):
        side = 1.0 if step % 2 == 0 else -1.0
        settings = (step_time_s, side * turn_rad, 1 - np.cos(reach_margin_rad))
        columns = (ca.repmat(ca.DM(value), 1, intervals + 1) for value in (x, *settings))
        local = dict(
            zip(sample.name_out(), (np.array(v.full().T) for v in sample(*columns, phases[None, :])), strict=True)
        )
        arrays_of_step = _arrange_joints(local, side, turn_rad)
        arrays_of_step |= _place_in_world(local, side, ankle, heading)
        arrays_of_step |= {"t": (step + phases) * step_time_s, "left_stance": np.full(intervals + 1, 0.5 + 0.5 * side)}
        first = 0 if step == 0 else 1
        arrays_of_steps.append({name: array[first:] for name, array in arrays_of_step.items()})
        ankle, heading = arrays_of_step["right_ankle" if side > 0 else "left_ankle"][-1], heading + turn_rad
    arrays = {
        name: np.concatenate([step_arrays[name] for step_arrays in arrays_of_steps]) for name in arrays_of_steps[0]
    }
    return Signals(joints=JOINTS, arrays=arrays, columns=COLUMNS_OF)


def compute_steps_at(
    point: NumericPoint, robot: walk12_model.PointMassBiped, *, intervals: int, zmp: walk12_model.Zmp
) -> Signals:
    """Compute time histories at a point of the problem, see ``compute_steps``."""
    given: dict[str, Any] = {name: float(point[name]) for name in ("step_time_s", "turn_rad", "reach_margin_rad")}
    return compute_steps(robot, point.x.full().ravel(), intervals=intervals, zmp=zmp, **given)


def _arrange_joints(local: dict[str, Array], side: float, turn: float) -> dict[str, Array]:
    """Return q, qd, qdd (N + 1, 12) of a step; side is 1 if the left leg stands, else -1."""
    stance, swing = ("left", "right") if side > 0 else ("right", "left")
    signs = np.ones(5) if side > 0 else MIRRORED_ROLLS
    joints: dict[str, Array] = {}
    for name in ("q", "qd", "qdd"):
        table = np.zeros((len(local[f"stance_{name}"]), len(JOINTS)))
        table[:, COLUMNS[stance]] = local[f"stance_{name}"] * signs
        table[:, COLUMNS[swing]] = local[f"swing_{name}"] * signs
        joints[name] = table
    joints["q"][:, YAW_COLUMN[swing]] = turn
    return joints


def _place_in_world(local: dict[str, Array], side: float, ankle: Array, heading: float) -> dict[str, Array]:
    """Return points of a step in the world, from its stance ankle (3,) and heading."""
    mirror = np.array([1.0, side, 1.0])
    rotation = np.array(
        [[np.cos(heading), -np.sin(heading), 0.0], [np.sin(heading), np.cos(heading), 0.0], [0.0, 0.0, 1.0]]
    )
    zmp_foot = local["zmp"] * mirror[:2]
    on_ground = np.column_stack([zmp_foot, np.zeros(len(zmp_foot))])
    places = {"zmp": (ankle + on_ground @ rotation.T)[:, :2], "zmp_foot": zmp_foot}
    names = {"waist": "waist", "com": "com"}
    for leg, stands in (("left", side > 0), ("right", side < 0)):
        names |= {f"{leg}_{joint}": f"{'stance' if stands else 'swing'}_{joint}" for joint in LEG_POINTS}
    return places | {name: ankle + (local[own] * mirror) @ rotation.T for name, own in names.items()}


@cache
def _make_sample_function(robot: walk12_model.PointMassBiped, reading: walk12_model.Zmp) -> ca.Function:
    """Return the function of one sample with the left leg standing: (x, T, K, reach margin of a cosine, phase)."""
    x = SX.sym("x", 4)
    T, turn, margin, phase = (SX.sym(name) for name in ("T", "K", "margin", "phase"))
    stance, swing = walk12_model.compute_legs(x, phase, T, turn, margin, robot, Exact())
    m = walk12_model.list_masses(robot)
    masses = walk12_model.compute_mass_motion(stance, swing, robot).position
    outputs = {
        **dict(zip(("stance_q", "stance_qd", "stance_qdd"), stance.joints, strict=True)),
        **dict(zip(("swing_q", "swing_qd", "swing_qdd"), swing.joints, strict=True)),
        "zmp": walk12_model.compute_zmp(stance, swing, robot, reading),
        "com": masses @ m / float(ca.sum1(m)),  # (eq. 12)
        "waist": masses[:, 3],
        **dict(
            zip(
                ("stance_hip", "stance_knee", "stance_ankle"),
                (masses[:, 2], masses[:, 1], stance.ankle[0]),
                strict=True,
            )
        ),
        **dict(
            zip(("swing_hip", "swing_knee", "swing_ankle"), (masses[:, 4], masses[:, 5], swing.ankle[0]), strict=True)
        ),
    }
    inputs = [x, T, turn, margin, phase]
    return ca.Function(
        "step", inputs, ca.cse(list(outputs.values())), ["x", "T", "K", "margin", "phase"], list(outputs)
    )


def make_skeleton(robot: PointMassBiped, signals: Signals, parameters: Mapping[str, float]) -> display.Skeleton:
    """Return the stick figure of a motion; the robot turns to the left by ``turn_rad`` after each step."""
    arrays = signals.arrays
    waist, left_stands = arrays["waist"], arrays["left_stance"] > 0.5
    heading = np.concatenate([[0], np.cumsum(np.diff(left_stands) != 0)]) * parameters["turn_rad"]
    forward = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    across = np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=1)
    outline = display.make_rectangle(
        -robot.foot_back_m, robot.foot_front_m, -robot.foot_width_m / 2, robot.foot_width_m / 2
    )
    limbs, soles = [], []
    for side, stands in ((display.LEFT, left_stands), (display.RIGHT, ~left_stands)):
        hip, knee, ankle = (arrays[f"{side}_{joint}"] for joint in LEG_POINTS)
        limbs.append(display.Limb(side=side, points=np.stack([waist, hip, knee, ankle], axis=1)))
        corners = ankle[:, None, :] + outline[:, :1] * forward[:, None, :] + outline[:, 1:2] * across[:, None, :]
        soles.append(display.Sole(side=side, corners=corners, supports=stands))
    return display.make_flat_skeleton(signals, limbs, soles)
