"""A gait from elsewhere: its metrics and violations, its simulation, and the optimum of the same step and durations."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare.judge import Evaluation, evaluate
from nlp_gait.backends.solve import solve
from nlp_gait.errors import GaitError
from nlp_gait.files import replace_nan
from nlp_gait.formulation import Result
from nlp_gait.gaits.nao.recorded import RecordedGait
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Measurements, measure
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

STARTS = 5  # of the optimum
LARGEST_LEAN_DEG = 1.0  # the engine starts a gait with an upright torso


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedGait:
    """A recorded gait next to the optimum."""

    recorded: RecordedGait  #: the gait
    evaluation: Evaluation  #: of the gait, on the samples of the planned problem and between them
    optimum: Evaluation | None  #: evaluation of the optimum of the same step and durations; None if there is none
    engine: Measurements | None  #: measurements in the engine; None without a simulation
    notes: tuple[str, ...]  #: joints that were left out, exchanged sides, reasons for missing results

    def rows(self) -> list[tuple[str, float, float]]:
        """Return name and value of each metric, and its value at the optimum (NaN without an optimum)."""
        optimum = {} if self.optimum is None else self.optimum.metrics
        return [(name, value, optimum.get(name, math.nan)) for name, value in self.evaluation.metrics.items()]

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        motion = self.recorded.motion
        data = {
            "schema": 1,
            "gait": self.recorded.gait,
            "step_m": self.recorded.step_m,
            "mirrored": motion.mirrored,
            "held_joints": list(motion.held),
            "recorded": self.evaluation.to_json(),
            "optimum": None if self.optimum is None else self.optimum.to_json(),
            "engine": None if self.engine is None else asdict(self.engine),
            "notes": list(self.notes),
        }
        return dict(replace_nan(data))


def judge_gait(gait: RecordedGait, *, in_engine: bool = True, starts: int = STARTS) -> JudgedGait:
    """Judge a recorded gait, solve for the optimum of the same step and durations, and simulate the gait, if ``in_engine``.

    Zero starts leave the optimum out.
    """
    notes: list[str] = []
    if gait.motion.mirrored:
        notes.append("the right foot is the stance foot: left and right are exchanged in all results")
    if gait.inferred:
        notes.append(f"{describe_phases(gait)}, as its feet show; --touch-down names another landing time")
    if noise := float(gait.motion.noise_rad.max()):
        notes.append(
            f"angles are smoothed: noise or rounding of {noise:.1g} rad; torques and margins stay uncertain: 2 mrad raised the "
            "power of two cycles by up to 31 %"
        )
    if gait.motion.held:
        notes.append(f"held, because they are not in the file: {', '.join(gait.motion.held)}")
    optimum = engine = None
    try:
        optimum = _solve_optimum(gait, starts) if starts else None
    except GaitError as error:
        notes.append(f"no optimum of {gait.gait} for this step and duration: {error}")
    if in_engine:
        try:
            engine = _simulate(gait)
        except GaitError as error:
            notes.append(f"not simulated: {error}")
    return JudgedGait(
        recorded=gait, evaluation=evaluate(gait.problem, gait.x), optimum=optimum, engine=engine, notes=tuple(notes)
    )


def describe_phases(gait: RecordedGait) -> str:
    """Return the phases of a gait and their times in words."""
    if gait.gait != "nao-cycle":
        return f"{'single' if gait.gait == 'nao-ssp' else 'double'} support from 0 to {gait.motion.duration_s:.4g} s"
    landing = gait.x[0]
    return f"single support from 0 to {landing:.4g} s, double support from there to {gait.motion.duration_s:.4g} s"


def _solve_optimum(gait: RecordedGait, starts: int) -> Evaluation:
    problem = gait.make_planned()
    solution = solve(problem, starts=starts)
    if not solution.converged:
        raise GaitError(solution.status)
    return evaluate(problem, solution.x)


def _simulate(gait: RecordedGait) -> Measurements:
    if gait.lean_deg > LARGEST_LEAN_DEG:
        raise GaitError(
            f"the torso leans by {gait.lean_deg:.1f} degrees at the beginning, and the engine starts upright"
        )
    plan, drive = make_plan(Result(problem=gait.problem, x=np.array(gait.x))), Drive()
    return measure(plan, simulate_plan(plan, drive=drive), drive)
