"""A humanoid's cycle that is given as angles over time, judged by the limits of ``humanoid-cycle``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.problem import Array, GaitProblem, Grid, Result
from nlp_gait.problems.biped.goals import Goal
from nlp_gait.problems.biped.recorded.cycle import Half, Judge, on_grids
from nlp_gait.problems.biped.recorded.motion import Motion
from nlp_gait.problems.biped.recorded.stance import Stance
from nlp_gait.problems.biped.single_support import loads_on_left
from nlp_gait.problems.humanoid.body import GRAVITY, Humanoid
from nlp_gait.problems.humanoid.cycle import (
    cycle_margins,
    double_support_planner,
    humanoid_cycle_of,
    humanoid_cycle_variables,
    single_support_planner,
)
from nlp_gait.problems.humanoid.double_support import standing
from nlp_gait.problems.humanoid.problem import parts_of, with_body
from nlp_gait.robots.leg import LEG_JOINT_COUNT
from nlp_gait.symbolic.general_leg import reach_of


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedCycles:
    """Judges cycles of one humanoid, whose torso is upright.

    Attributes:
        body: the humanoid.
        robot: its name or file.
        intervals: of each phase, as in the planned problem.
        drive_limits: whether torques and speeds must be within what the robot's file says.
    """

    body: Humanoid
    robot: str
    intervals: int
    drive_limits: bool

    def judged(self, t: Array, q: Array, touch_down_s: float) -> Result:
        """A cycle that begins where the right foot leaves the ground.

        Args:
            t: (T,) from zero [s].
            q: (T, 12) angles of the left leg, then of the right one [rad].
            touch_down_s: when the right foot lands.

        Raises:
            InputError: a phase has too few samples.
        """
        motion = Motion(stance=self._stance, t=t, q=q)
        parts = {name: motion.part(*span) for name, span in motion.phases(touch_down_s).items()}
        armatures = self.body.biped.model.armatures_kgm2

        def built(grid: Grid) -> GaitProblem:
            return with_body(self._judge.problem(parts, grid), self.body, armatures, repeats=motion.repeats)

        options: dict[str, str | int | float | bool] = {
            "robot": self.robot,
            "intervals": self.intervals,
            "drive_limits": self.drive_limits,
        }
        step_m = float(motion.right_foot(t[-1:])[0, 0])
        x = np.array([*(part.duration_s for part in parts.values()), step_m])
        return Result(problem=on_grids(built, self.intervals, options), x=x)

    @cached_property
    def _stance(self) -> Stance:
        body = self.body
        return Stance(
            robot=body.biped.model,
            joints=body.biped.joints,
            images=body.images,
            support=(0.0, body.foot_y("left"), body.ankle_height("left")),
            hip_m=tuple(body.middle_m.tolist()),
        )

    @cached_property
    def _judge(self) -> Judge:
        return _judge(self.body, self.drive_limits)


def _judge(body: Humanoid, drive_limits: bool) -> Judge:
    """The planned cycle as the judge."""
    model, margins = body.biped.model, cycle_margins(body)
    loads = {"ssp": loads_on_left(model, GRAVITY, ()), "dsp": standing(body, model, ()).loads("lever")}
    plans = {"ssp": single_support_planner(body), "dsp": double_support_planner(body)}
    halves = {
        name: Half(
            plan=plans[name],
            loads=loads[name],
            parts=parts_of(body, *margins[name], drive_limits=drive_limits, solved=False),
        )
        for name in plans
    }
    return Judge(
        owner=body.biped.full.name,
        robot=model,
        joints=body.biped.joints,
        planned=body.biped.joints,
        variables=humanoid_cycle_variables(body),
        halves=halves,
        goal=Goal(heat=body.heat),
        cosines=partial(_cosines, body),
        joined=partial(humanoid_cycle_of, body, model, at_given_speed=False),
    )


def _cosines(body: Humanoid, q: MX) -> MX:
    """Of both knees (2, N + 1), from all angles (12, N + 1)."""
    angles = SX.sym("q", len(body.biped.joints))
    legs = zip(body.biped.legs.values(), ca.vertsplit(angles, LEG_JOINT_COUNT), strict=True)
    reach = ca.Function("reach", [angles], [ca.vertcat(*(reach_of(leg, own) for leg, own in legs))])
    return reach.map(q.shape[1])(q)
