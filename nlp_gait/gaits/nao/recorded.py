"""Joint angles of NAO over time from any source, as a problem whose only variables are its times."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.gaits.biped.body import Body, PhaseName
from nlp_gait.gaits.biped.recorded_cycle import (
    RecordedCycles,
    RecordedGait,
    make_recorded_phase_problem,
    make_refinable,
)
from nlp_gait.gaits.biped.recorded_motion import FINE, LEAST_ROWS, LIFTED, Motion, make_places_function
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.gaits.nao.joints import JOINTS, RESTING_ARM_ANGLES

GAITS = ("nao-ssp", "nao-dsp", "nao-cycle")


def of_all_joints(angles: JointAngles) -> Array:
    """Return (T, 22) columns as ``JOINTS``; joints of the arms that are missing are held [rad]."""
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    return np.column_stack(
        [columns.get(name, np.full(len(angles.t), RESTING_ARM_ANGLES.get(name, 0.0))) for name in JOINTS]
    )


def motion_of(angles: JointAngles, body: Body) -> Motion:
    """Return the motion of a robot on its left foot; mirrored if the right one stands. Joints of the arms may be missing.

    Raises:
        InputError: a joint of the legs is missing, or times or angles are missing or out of order.
    """
    missing = [name for name in JOINTS if name not in angles.joints]
    needed = [name for name in missing if name not in RESTING_ARM_ANGLES]
    if needed:
        raise InputError(f"{angles.owner} has no angles of {', '.join(needed)}")
    if len(angles.t) < LEAST_ROWS:
        raise InputError(f"{angles.owner} has {len(angles.t)} rows; a motion needs {LEAST_ROWS}")
    if not (np.isfinite(angles.t).all() and np.diff(angles.t).min() > 0.0):
        raise InputError(f"{angles.owner}: times must ascend")
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    for name in JOINTS:
        if name in columns and not np.isfinite(columns[name]).all():
            raise InputError(f"{angles.owner}: an angle of {name} is missing")
    motion = Motion(body=body, t=angles.t - angles.t[0], q=of_all_joints(angles), held=tuple(missing))
    heights = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))[:, 2]
    return motion.mirror_image() if -heights.min() > max(heights.max(), LIFTED) else motion


def make_nao_cycles(robot: str = "nao-v5", intervals: int = 10) -> RecordedCycles:
    """Return NAO, or a robot of its build, and the limits of ``nao-cycle``, by which its recorded cycles are judged.

    Raises:
        InputError: the robot has other legs.
    """
    options: dict[str, str | int | float | bool] = {"robot": robot, "intervals": intervals}
    return RecordedCycles(body=make_nao(robot), intervals=intervals, options=options)


def make_recorded_gait(
    angles: JointAngles,
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    gait: str | None = None,
    touch_down_s: float | None = None,
) -> RecordedGait:
    """Make a gait from angles over time; their last instant is its end.

    Without ``gait``, the problem with whose limits it is judged, and without ``touch_down_s``, where single support ends in a
    cycle, both are detected.

    Raises:
        InputError: angles that are not a gait, or another gait than named.
    """
    if gait is not None and gait not in GAITS:
        raise InputError(f"a motion is judged by the limits of {', '.join(GAITS)}, got {gait!r}")
    cycles = make_nao_cycles(robot, intervals)
    body = cycles.body
    motion = motion_of(angles, body)
    phases: dict[PhaseName, tuple[float, float]]
    if touch_down_s is None and gait in ("nao-ssp", "nao-dsp"):
        phases = {"ssp" if gait == "nao-ssp" else "dsp": (0.0, motion.duration_s)}
    else:
        phases = motion.phases(touch_down_s)
    found = "nao-cycle" if len(phases) > 1 else "nao-ssp" if "ssp" in phases else "nao-dsp"
    if gait not in (None, found):
        raise InputError(
            f"{angles.owner} shows {found}, not {gait}: the right foot lands at no time before the end; name it with --touch-down"
        )
    foot = motion.right_foot(np.array([0.0, motion.duration_s]))
    step = float(foot[1, 0])
    if found == "nao-cycle":
        judged = cycles.judge(motion.t, motion.q, phases["ssp"][1])
        problem, x = judged.problem, tuple(judged.x.tolist())
    else:
        (name,) = phases
        problem = make_refinable(
            lambda grid: make_recorded_phase_problem(body, name, motion, grid), intervals, cycles.options
        )
        x = (motion.duration_s,)
        step = float(foot[1, 0] - foot[0, 0]) / 2 if name == "ssp" else step
    cosine = float(make_places_function(body)(motion.q[0])[4])
    return RecordedGait(
        gait=found,
        problem=problem,
        x=x,
        motion=motion,
        step_m=step,
        lean_deg=float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))),
        make_planned=partial(_planned_problem, found, problem, x, step),
    )


def _planned_problem(gait: str, recorded: GaitProblem, x: Sequence[float], step_m: float) -> GaitProblem:
    options = {key: recorded.options[key] for key in ("robot", "intervals")}
    problem = load(gait, **options) if gait == "nao-cycle" else load(gait, step_length_m=step_m, **options)
    fixed = dict(zip(recorded.names, x, strict=True))
    wider: dict[str, float] = {}
    for name, value in fixed.items():  # a recorded duration may violate its bounds; the optimum has the same duration
        low, high = problem.value(f"{name}.lower"), problem.value(f"{name}.upper")
        wider |= {f"{name}.lower": min(low, value), f"{name}.upper": max(high, value)}
    return problem.with_values(**wider).fix(**fixed)
