"""The nominal and the robust gait played in MuJoCo on the robots for which they differ (extra ``sim``)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.questions.robust.study import Robust
from compare.study.store import Store
from compare.study.task import ProblemSpec
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decode
from nlp_gait.files import replace_nan
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.plan import SIDES, Plan, make_plan
from nlp_gait.simulation.simulate import simulate_plan


@dataclass(frozen=True, kw_only=True)
class Played:
    """One gait on one robot, open loop.

    Attributes:
        gait: ``"nominal"`` or ``"robust"``.
        robot: its name, with its changes.
        fell_at_s: None if it stayed up.
        largest_tilt_deg: of the torso.
        margin_m: mean lateral distance of the engine's centre of pressure, averaged over one period of the set-points, to the
            nearer edge of the supporting soles.
        predicted_margin_m: the same of the planned ZMP on this robot, over the same instants.
    """

    gait: str
    robot: str
    fell_at_s: float | None
    largest_tilt_deg: float
    margin_m: float
    predicted_margin_m: float


def played(
    spec: ProblemSpec, found: Robust, store: Store | None = None, progress: Progress = ignore_progress
) -> tuple[Played, ...]:
    """Both gaits on every robot of the scenario problem; ``progress`` is told of each. What is finished is not played again.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    runs = []
    for robot in found.robots:
        for gait, x in (("nominal", found.nominal_x), ("robust", found.x)):
            problem = spec.with_options(robot=robot).load()
            inputs = {**fingerprint(problem), "gait": gait, "x": dict(x)}
            kept = (store or Store()).compute("play-{key}", inputs, partial(_play, problem, robot, gait, x))
            runs.append(decode(Played, kept))
            progress(f"{gait} gait on {robot[:40]}")
    return tuple(runs)


def _play(problem: GaitProblem, robot: str, gait: str, x: Mapping[str, float]) -> dict[str, Any]:
    """What was measured, as plain data."""
    point = problem.check_x(x)
    plan, drive = make_plan(Result(problem=problem, x=point)), Drive()
    trace = simulate_plan(plan, drive=drive)
    during = trace.t <= plan.duration_s
    run = Played(
        gait=gait,
        robot=robot,
        fell_at_s=trace.fell_at_s,
        largest_tilt_deg=math.degrees(float(trace.tilt.max())),
        margin_m=lateral_margin(plan, average_pressure(trace, drive.period_s)[during, 1]),
        predicted_margin_m=lateral_margin(plan, plan.at("zmp", trace.t[during])[:, 1]),
    )
    return dict(replace_nan(asdict(run)))


def lateral_margin(plan: Plan, y: Array) -> float:
    """Mean distance of lateral positions (T,) [m] to the nearer side of the supporting soles [m]."""
    feet = [
        (plan.at(f"{side}_foot", np.zeros(1))[0, 1], plan.robot.feet[side]) for side in SIDES if side in plan.supports
    ]
    left, right = max(y + foot.left_m for y, foot in feet), min(y - foot.right_m for y, foot in feet)
    return float(np.nanmean(np.minimum(left - y, y - right)))
