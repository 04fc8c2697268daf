"""A gait from elsewhere: what it needs, which limits it breaks, whether the engine confirms it, and what it could have cost."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import nlp_gait
from compare.judge import Evaluation, evaluate
from nlp_gait.errors import GaitError
from nlp_gait.files import without_nan
from nlp_gait.formulation import Result
from nlp_gait.formulation.solution import Solution
from nlp_gait.gaits.nao.recorded.problem import Recorded
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Measurements, measure
from nlp_gait.simulation.plan import plan_of
from nlp_gait.simulation.playback import play

STARTS = 5  # of the optimum at the same step and times
MOST_LEAN_DEG = 1.0  # the engine starts a gait with an upright torso


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedGait:
    """A recorded gait beside the optimum.

    Attributes:
        recorded: the gait.
        evaluation: of the gait, on the samples of the planned problem and between them.
        optimum: of the planned problem at the same step and times; None where there is none.
        planned: evaluation of the optimum.
        engine: what the engine measured; None where it was not played.
        remarks: what the reader must know: joints left out, sides exchanged, why something is missing.
    """

    recorded: Recorded
    evaluation: Evaluation
    optimum: Solution | None
    planned: Evaluation | None
    engine: Measurements | None
    remarks: tuple[str, ...]

    def rows(self) -> list[tuple[str, float, float]]:
        """Indexes of the gait and of the optimum, NaN where that has none."""
        other: Mapping[str, float] = {} if self.planned is None else self.planned.indexes
        return [(name, value, other.get(name, math.nan)) for name, value in self.evaluation.indexes.items()]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        motion = self.recorded.motion
        data = {
            "schema": 1,
            "gait": self.recorded.gait,
            "step_m": self.recorded.step_m,
            "mirrored": motion.mirrored,
            "held_joints": list(motion.held),
            "recorded": self.evaluation.to_json(),
            "optimum": None if self.planned is None else self.planned.to_json(),
            "engine": None if self.engine is None else asdict(self.engine),
            "remarks": list(self.remarks),
        }
        plain: dict[str, Any] = without_nan(data)
        return plain


def judge_gait(gait: Recorded, *, in_engine: bool = True, seed: int = 0) -> JudgedGait:
    """Judge a gait as every other, solve for the optimum beside it, and play it.

    Args:
        gait: with its limits.
        in_engine: False to leave the engine out.
        seed: of the optimum's starts.
    """
    remarks = []
    if gait.motion.mirrored:
        remarks.append("the right foot stands: left and right are exchanged in all that follows")
    if gait.motion.held:
        remarks.append(f"held, because the file says nothing of them: {', '.join(gait.motion.held)}")
    x = np.array(gait.x)
    optimum, planned = None, None
    try:
        problem = gait.planned()
        optimum = nlp_gait.solve(problem, starts=STARTS, seed=seed)
        if optimum.success:
            planned = evaluate(problem, problem.check_x(optimum.x))
        else:
            remarks.append(f"no optimum of {gait.gait} at this step and time: {optimum.status}")
    except GaitError as error:
        remarks.append(f"no optimum of {gait.gait} at this step and time: {error}")
    engine = None
    if in_engine and gait.lean_deg > MOST_LEAN_DEG:
        remarks.append(
            f"not played: the torso leans by {gait.lean_deg:.1f} degrees at the beginning, and the engine starts upright"
        )
    elif in_engine:
        try:
            plan = plan_of(Result(problem=gait.problem, x=x))
            drive = Drive()
            engine = measure(plan, play(plan, drive=drive), drive)
        except GaitError as error:
            remarks.append(f"not played: {error}")
    return JudgedGait(
        recorded=gait,
        evaluation=evaluate(gait.problem, x),
        optimum=optimum,
        planned=planned,
        engine=engine,
        remarks=tuple(remarks),
    )
