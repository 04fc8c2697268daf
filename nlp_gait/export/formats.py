"""Gaits in formats of other programs."""

import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.errors import InputError, unknown
from nlp_gait.files import format_csv, replace_file, write_json, write_text
from nlp_gait.formulation import Array, Result, Signals, sample_at_period, sample_signals
from nlp_gait.formulation.solution import SCHEMA
from nlp_gait.robots.tree import make_tree
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.mjcf import add_bodies, make_plan_model
from nlp_gait.simulation.plan import make_plan

PERIOD_MS = 40  # as in Gupta, Pratihar, Deb (2023), and Webots' worlds for NAO
APPROACH_S = 2.0  # from the robot's current pose to the first one: a key of NAOqi needs a time > 0
LONGEST_LINE = 4095  # characters with the line's end: size of the buffer of Webots' parser
ROUNDING = 1e-9  # of a duration in periods
COUPLED = "RHipYawPitch"  # both hip yaw-pitch joints are one motor, which NAOqi commands by the left one's name
# Usual suffix of a file by format.
FORMATS = {
    "webots": ".motion",
    "csv": ".csv",
    "json": ".signals.json",
    "mjcf": ".xml",
    "naoqi": ".naoqi.json",
    "ros": ".trajectory.json",
    "npz": ".npz",
}


def write_as(name: str, path: Path, result: Result, period_ms: int = PERIOD_MS) -> None:
    """Write a gait to a file in one of FORMATS.

    Rows are exactly a period apart; the last one is that before the end, or after it where the robot is at rest.
    Raises UnknownNameError, InputError if the format cannot express the gait, or OutputError.
    """
    if name not in FORMATS:
        raise unknown("format", name, FORMATS)
    if name == "mjcf":
        write_text(path, make_plan_model(make_plan(result), Drive()))
        return
    if name in ("webots", "naoqi", "ros"):
        _check_motors(result)
    signals = sample_at_period(result, period_ms)
    if name == "webots":
        write_text(path, format_motion(signals))
    elif name == "naoqi":
        write_json(path, to_naoqi(signals, result.problem.name))
    elif name == "npz":
        write_reference(path, result, period_ms / 1000.0)
    elif name == "csv":
        write_signals_csv(path, signals)
    elif name == "ros":
        write_json(path, to_ros(signals))
    else:
        write_signals_json(path, result, signals)


def format_motion(signals: Signals) -> str:
    """Return the content of a `.motion` file of Webots; raises InputError if it cannot express the joints' names or number.

    The grammar is that of Webots' own parser (`src/controller/c/motion.c`): a header with the motors; then rows
    ``MM:SS:mmm,<pose name>,<radians>,...``, between which it interpolates linearly.
    """
    joints = signals.joints
    lines = [",".join(("#WEBOTS_MOTION", "V1.0", *joints))]
    if lines[0].count(",") != len(joints) + 1:
        raise InputError("joints of a .motion file must have names without commas; rename them in the robot's file")
    for number, (t, row) in enumerate(zip(signals.arrays["t"], signals.arrays["q"].tolist(), strict=True), start=1):
        seconds, milliseconds = divmod(round(1000.0 * t), 1000)
        values = ",".join(f"{value:.9f}" for value in row)
        lines.append(f"{seconds // 60:02d}:{seconds % 60:02d}:{milliseconds:03d},Pose{number},{values}")
    longest = max(map(len, lines))
    if longest >= LONGEST_LINE:
        raise InputError(
            f"a line of the .motion file has {longest} characters for {len(joints)} joints; Webots' parser needs fewer than "
            f"{LONGEST_LINE}: export as csv"
        )
    return "\n".join(lines) + "\n"


def to_naoqi(signals: Signals, owner: str) -> dict[str, Any]:
    """Return the arguments of ``ALMotion.angleInterpolation``: names, keys [rad] and times [s], in absolute angles."""
    if COUPLED not in signals.joints:
        raise InputError(
            f"only NAO has NAOqi, which commands joints such as {COUPLED!r}; the robot of {owner!r} has none of that name: "
            "export as csv, json, webots or mjcf"
        )
    names = [name for name in signals.joints if name != COUPLED]
    times = [round(APPROACH_S + t, 3) for t in signals.arrays["t"].tolist()]
    keys = [signals.arrays["q"][:, signals.joints.index(name)].tolist() for name in names]
    return {"names": names, "keys": keys, "times": [times for _ in names], "isAbsolute": True}


def write_reference(path: Path, result: Result, period_s: float) -> None:
    """Write a gait as a reference for motion tracking: the arrays of motion files of mjlab and Isaac Lab, and names.

    All joints and bodies of the robot are in MuJoCo's order, depth first: ``joint_pos`` (T, J) [rad], ``joint_vel`` (T, J),
    ``body_pos_w`` (T, B, 3) [m], ``body_quat_w`` (T, B, 4) as w, x, y, z, ``body_lin_vel_w`` and ``body_ang_vel_w`` (T, B, 3),
    ``fps``, ``joint_names`` and ``body_names``; body frames are at the joints, with the root's axes at zero angles. Joints that
    do not move have the angles of the posture. Raises InputError for a robot that moves in a plane, OutputError.
    """
    plan, engine = make_plan(result), load_mujoco()
    if plan.planar:
        raise InputError(f"the robot of {result.problem.name!r} moves in a plane, and references are in space")
    robot = plan.full_robot
    times: Array = np.arange(int(plan.duration_s / period_s + ROUNDING) + 1) * np.float64(period_s)
    root, world = Xml.fromstring('<mujoco><compiler angle="radian"/></mujoco>'), Xml.Element("worldbody")
    root.append(world)
    add_bodies(world, make_tree(robot, robot.root), {}, root="free")
    model = engine.MjModel.from_xml_string(Xml.tostring(root, encoding="unicode"))
    joints, bodies = (
        [item(i).name for i in range(1, n)] for item, n in ((model.joint, model.njnt), (model.body, model.nbody))
    )
    driven = [joints.index(name) for name in plan.joints]
    poses, rates = np.zeros((len(times), model.nq)), np.zeros((len(times), model.nv))
    poses[:, :7] = np.hstack([plan.at("hip", times), plan.attitude(times)])
    poses[:, 7:][:, driven] = plan.at("q", times)
    for k, rate in enumerate(rates):  # the turning of the root by differences, all others as planned
        before, after = max(k - 1, 0), min(k + 1, len(times) - 1)
        engine.mj_differentiatePos(model, rate, max(after - before, 1) * period_s, poses[before], poses[after])
    rates[:, :3], rates[:, 6:][:, driven] = plan.rate("hip", times), plan.rate("q", times)
    places, turns, motions = ([] for _ in range(3))
    data, motion = engine.MjData(model), np.zeros(6)
    for data.qpos[:], data.qvel[:] in zip(poses, rates, strict=True):
        engine.mj_fwdPosition(model, data)
        engine.mj_fwdVelocity(model, data)
        places.append(data.xpos[1:].copy())
        turns.append(data.xquat[1:].copy())
        for body in range(1, model.nbody):
            engine.mj_objectVelocity(model, data, engine.mjtObj.mjOBJ_XBODY, body, motion, 0)
            motions.append(motion.copy())
    moved = np.reshape(motions, (len(times), len(bodies), 6))
    held = [0.0 if name in plan.joints else robot.posture_rad.get(name, 0.0) for name in joints]
    with replace_file(path) as temporary, open(temporary, "wb") as file:
        np.savez(
            file,
            allow_pickle=False,
            joint_pos=poses[:, 7:] + held,
            joint_vel=rates[:, 6:],
            body_pos_w=np.array(places),
            body_quat_w=np.array(turns),
            body_lin_vel_w=moved[:, :, 3:],
            body_ang_vel_w=moved[:, :, :3],
            fps=np.array(1.0 / period_s),
            joint_names=np.array(joints),
            body_names=np.array(bodies),
        )


def write_signals_csv(path: Path, signals: Signals) -> None:
    """Write one row per sample, with a header like ``q_LKneePitch_rad``; raises InputError, OutputError."""
    table = list(signals.named_columns())
    # plain headings such as ``qd_LKneePitch_rad_s``; a dimensionless column has no unit
    suffixes = ("" if unit == "1" else "_" + unit.replace("/", "_").replace("^", "") for _, unit, _ in table)
    header = [name.replace(" ", "_") + suffix for (name, _, _), suffix in zip(table, suffixes, strict=True)]
    write_text(path, format_csv([header, *zip(*(values.tolist() for _, _, values in table), strict=True)]))


def to_ros(signals: Signals) -> dict[str, Any]:
    """Return a ``trajectory_msgs/JointTrajectory``: positions [rad], velocities [rad/s], accelerations, efforts [Nm]."""
    arrays = signals.arrays
    fields = {"positions": "q", "velocities": "qd", "accelerations": "qdd", "effort": "tau"}
    points = []
    for k, t in enumerate(arrays["t"].tolist()):
        seconds, nanoseconds = divmod(round(1e9 * t), 10**9)
        values = {field: arrays[name][k].tolist() for field, name in fields.items()}
        points.append({**values, "time_from_start": {"sec": seconds, "nanosec": nanoseconds}})
    return {"header": {"frame_id": ""}, "joint_names": list(signals.joints), "points": points}


def write_signals_json(path: Path, result: Result, signals: Signals) -> None:
    """Write the gait with its problem and all columns by name, each with its unit; raises InputError, OutputError."""
    problem = result.problem
    data = {
        "schema": SCHEMA,
        "problem": problem.load_name,
        "options": dict(problem.options),
        "parameters": dict(problem.values),
        "x": problem.by_name(result.x),
        "signals": {name: {"unit": unit, "values": values.tolist()} for name, unit, values in signals.named_columns()},
    }
    write_text(path, json.dumps(data, indent=1) + "\n")


def write_npz(path: Path, signals: Signals) -> None:
    """Write all arrays and the joint names (columns of q, qd, qdd and tau) to a ``.npz`` file; raises OutputError."""
    with replace_file(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, allow_pickle=False, joints=np.array(signals.joints), **signals.arrays)


def _check_motors(result: Result) -> None:
    robot = result.problem.display.robot
    if robot is None:
        raise InputError(f"problem {result.problem.name!r} has no robot with motors; export it as csv or json")
    for joint in sample_signals(result, math.inf).joints:
        robot.joint(joint)
