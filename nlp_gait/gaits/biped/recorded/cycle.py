"""A walking cycle whose motion is given: judged by the limits of the planned one; its times and its step are its variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from casadi import MX

from nlp_gait.formulation import Array, GaitProblem, Grid, Result, Variable
from nlp_gait.gaits.biped.cycle import WalkingCycle, cycle_problem
from nlp_gait.gaits.biped.cycle_motion import LIFT, STEP, SWITCHES, TIMES
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.instant import Loader, Planner
from nlp_gait.gaits.biped.parts import Part
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.recorded.limits import HipLimits, StandingLimits, SwingLimits
from nlp_gait.gaits.biped.recorded.motion import Motion
from nlp_gait.gaits.biped.recorded.phase import RecordedPhase
from nlp_gait.gaits.biped.recorded.stance import Stance
from nlp_gait.robots import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Half:
    """What a phase of a cycle is judged by.

    Attributes:
        plan: of the planned phase.
        loads: of any motion.
        parts: limits of the planned phase.
    """

    plan: Planner
    loads: Loader
    parts: tuple[Part, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Judge:
    """A planned walking cycle as the judge of motions.

    Attributes:
        owner: whose cycle it is, for the title.
        robot: with links welded that never move.
        joints: those whose torques and rates count.
        planned: those whose angles are limited.
        variables: of the planned cycle, in whose ranges a motion has to be.
        halves: ``"ssp"`` and ``"dsp"``.
        goal: of the planned cycle.
        cosines: of both knees, see ``RecordedPhase``.
        joined: the cycle of the times, the step length and both phases.
    """

    owner: str
    robot: Robot
    joints: tuple[str, ...]
    planned: tuple[str, ...]
    variables: Sequence[Variable]
    halves: Mapping[str, Half]
    goal: Goal
    cosines: Callable[[MX], MX]
    joined: Callable[[tuple[Variable, ...], Mapping[str, Phase]], WalkingCycle]

    def problem(self, motions: Mapping[str, Motion], grid: Grid) -> GaitProblem:
        """Both phases of a motion and the rows that join them, without what drawing and playing need."""
        known = {variable.name: variable for variable in self.variables}
        own_variables = (known[TIMES["ssp"]], known[TIMES["dsp"]], known[STEP])
        at_ends = HipLimits([self._hip(known, switch) for switch in SWITCHES], SWITCHES)
        own: dict[str, tuple[Part, ...]] = {
            "ssp": (at_ends, SwingLimits(motions["ssp"], known[LIFT])),
            "dsp": (StandingLimits(),),
        }
        phases = {
            name: RecordedPhase(
                robot=self.robot,
                joints=self.joints,
                planned=self.planned,
                variables=own_variables,
                duration=TIMES[name],
                plan=half.plan,
                loads=half.loads,
                grid=grid,
                parts=(*half.parts, *own[name]),
                goal=self.goal,
                recorded=motions[name],
                cosines=self.cosines,
            )
            for name, half in self.halves.items()
        }
        problem = cycle_problem("recorded-cycle", self.owner, self.joined(own_variables, phases))
        return replace(problem, title=f"A recorded gait of {self.owner}, a walking cycle")

    def _hip(self, known: Mapping[str, Variable], switch: str) -> dict[str, Variable]:
        """Where the hip may be at a switch, and how fast."""
        places = {axis: known[f"hip_{axis}_{switch}_m"] for axis in "xz"}
        return places | {f"v{axis}": known[f"hip_v{axis}_{switch}_m_s"] for axis in "xyz"}


def on_grids(
    build: Callable[[Grid], GaitProblem], intervals: int, options: Mapping[str, str | int | float | bool]
) -> GaitProblem:
    """A problem on the planned one's samples, which can be refined.

    Args:
        build: the problem on a grid.
        intervals: of each phase.
        options: of the problem.
    """

    def built(factor: int) -> GaitProblem:
        grid = Grid(intervals=intervals, samples_per_interval=factor, refined_by="samples_per_interval")
        return replace(build(grid), options=dict(options), refine=lambda by: built(factor * by))

    return built(1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Cycles:
    """Judges one robot's cycles that begin where the right foot leaves the ground.

    Attributes:
        judge: planned cycle.
        stance: the robot.
        intervals: of each phase, as in the planned problem.
        options: of the problem that judges.
        dressed: that problem with what drawing and playing need; whether another step can follow.
    """

    judge: Judge
    stance: Stance
    intervals: int
    options: Mapping[str, str | int | float | bool]
    dressed: Callable[[GaitProblem, bool], GaitProblem]

    def judged(self, t: Array, q: Array, touch_down_s: float) -> Result:
        """A cycle with its own times and step.

        Args:
            t: (T,) from zero [s].
            q: (T, J) angles of the stance's joints [rad].
            touch_down_s: when the right foot lands.

        Raises:
            InputError: a phase has too few samples.
        """
        motion = Motion(stance=self.stance, t=t, q=q)
        parts = {name: motion.part(*span) for name, span in motion.phases(touch_down_s).items()}

        def built(grid: Grid) -> GaitProblem:
            return self.dressed(self.judge.problem(parts, grid), motion.repeats)

        step_m = float(motion.right_foot(t[-1:])[0, 0])
        x = np.array([*(part.duration_s for part in parts.values()), step_m])
        return Result(problem=on_grids(built, self.intervals, self.options), x=x)
