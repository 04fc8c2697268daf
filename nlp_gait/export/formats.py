"""Export formats by name."""

from __future__ import annotations

from pathlib import Path

from nlp_gait.errors import InputError, unknown
from nlp_gait.export.naoqi import COUPLED, write_naoqi
from nlp_gait.export.setpoints import SetPoints, set_points
from nlp_gait.export.tables import write_csv, write_json
from nlp_gait.export.webots import write_motion
from nlp_gait.files import write_text
from nlp_gait.formulation import Result, sample_signals
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import make_plan_model
from nlp_gait.simulation.plan import make_plan

# Usual ending of a file by format.
FORMATS = {"webots": ".motion", "csv": ".csv", "json": ".signals.json", "mjcf": ".xml", "naoqi": ".naoqi.json"}


def write_as(name: str, path: Path, result: Result, period_ms: int) -> None:
    """Write a gait in a format.

    Args:
        name: one of FORMATS.
        path: file to be written.
        result: the gait.
        period_ms: between rows of ``webots`` and ``naoqi``; the longest between those of ``csv`` and ``json``, which keep the
            problem's own samples and refine them.

    Raises:
        UnknownNameError: no such format.
        InputError: the gait cannot be expressed in it.
        OutputError: the file cannot be written.
    """
    if name not in FORMATS:
        raise unknown("format", name, FORMATS)
    if name == "webots":
        write_motion(path, _motor_set_points(result, period_ms))
    elif name == "naoqi":
        points = _motor_set_points(result, period_ms)
        if not set(COUPLED) <= set(points.joints):
            owner = (
                "the robot" if result.problem.display.robot is None else f"robot {result.problem.display.robot.name!r}"
            )
            raise InputError(
                f"only NAO has NAOqi, which commands joints such as {COUPLED[0]!r}; {owner} has none of that name: export as "
                "csv, json, webots or mjcf"
            )
        write_naoqi(path, points)
    elif name == "mjcf":
        plan = make_plan(result)
        write_text(path, make_plan_model(plan, Drive()))
    elif name == "csv":
        write_csv(path, sample_signals(result, period_ms / 1000.0))
    else:
        write_json(path, result, sample_signals(result, period_ms / 1000.0))


def _motor_set_points(result: Result, period_ms: int) -> SetPoints:
    """Set-points, if their joints are those of a robot."""
    robot = result.problem.display.robot
    if robot is None:
        raise InputError(f"problem {result.problem.name!r} has no robot with motors; export it as csv or json")
    points = set_points(result, period_ms)
    for joint in points.joints:
        robot.joint(joint)
    return points
