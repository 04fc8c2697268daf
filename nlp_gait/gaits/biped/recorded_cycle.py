"""Problems of recorded motions: judged by the limits of the planned phases; their times and their step are the variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nlp_gait.formulation import Array, GaitProblem, Grid, Result, Variable
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, PhaseName
from nlp_gait.gaits.biped.cycle import WalkingCycle, make_cycle_margins, make_cycle_problem
from nlp_gait.gaits.biped.cycle_motion import STEP, SWITCHES, make_cycle_variables
from nlp_gait.gaits.biped.double_support import (
    compute_double_support_mean_margins,
    make_double_support_margins,
    make_support_box,
)
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import Limit
from nlp_gait.gaits.biped.load_sharing import Division, make_divided_loads
from nlp_gait.gaits.biped.phase_problem import make_phase_limits, make_phase_problem
from nlp_gait.gaits.biped.recorded_motion import FINE, Motion
from nlp_gait.gaits.biped.recorded_phase import HipLimits, RecordedPhase, StandingLimits, SwingLimits
from nlp_gait.gaits.biped.samples import Loader
from nlp_gait.gaits.biped.single_support import compute_single_support_mean_margins, make_single_support_loads


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedGait:
    """A gait from elsewhere, as a problem whose only variables are its times."""

    gait: str  # name of the problem with whose limits it is judged
    # The recorded gait; its variables are the durations of its phases, and of a cycle the step length
    problem: GaitProblem
    x: tuple[float, ...]  # (n,) its own durations and step
    motion: Motion  # on the left foot
    step_m: float  # from foot to foot
    lean_deg: float  # of the torso at the beginning
    # Makes the planned problem with the same robot, step and durations; InputError if there is none
    make_planned: Callable[[], GaitProblem]


def make_refinable(
    build: Callable[[Grid], GaitProblem], intervals: int, options: Mapping[str, str | int | float | bool]
) -> GaitProblem:
    """Return a problem on the planned one's samples, which can be refined: ``build`` makes it on a grid."""

    def refine(factor: int) -> GaitProblem:
        grid = Grid(intervals=intervals, samples_per_interval=factor, refined_by="samples_per_interval")
        return replace(build(grid), options=dict(options), refine=lambda by: refine(factor * by))

    return refine(1)


def make_recorded_loads(body: Body, rule: Division) -> dict[PhaseName, Loader]:
    """Return the loads of both phases for any angles, at which no link stays upright."""
    freed = replace(body, upright=frozenset())
    return {"ssp": make_single_support_loads(freed), "dsp": make_divided_loads(freed, rule)}


def make_recorded_phase_problem(body: Body, name: PhaseName, motion: Motion, grid: Grid) -> GaitProblem:
    """Return the problem of one recorded phase, whose time is its variable."""
    height, vz0, vz1, vx0, vx1, vy0, vy1 = body.hip_variables
    ends = ({"z": height, "vx": vx0, "vy": vy0, "vz": vz0}, {"z": height, "vx": vx1, "vy": vy1, "vz": vz1})
    left = body.support[:2]
    own: Limit
    if name == "ssp":
        margins, means = body.make_sole_margins(left), compute_single_support_mean_margins(body.robot.feet["left"])
        own = SwingLimits(motion, body.lift_variable)
    else:
        foot = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))
        x, y = (foot[:, :2].mean(axis=0) + (0.0, left[1])).tolist()
        box = make_support_box(body.robot, {"L": left, "R": (x, y)})
        margins, means = make_double_support_margins(box), compute_double_support_mean_margins(box)
        own = StandingLimits()
    phase = RecordedPhase(
        body=body,
        variables=(body.make_time_variable(name),),
        duration=TIMES[name],
        loads=make_recorded_loads(body, "printed")[name],
        grid=grid,
        limits=(*make_phase_limits(body, margins, means, solved=False), HipLimits(ends, ("start", "end")), own),
        goal=Goal(heat=body.heat),
        recorded=motion,
    )
    problem = make_phase_problem(name, "", phase)
    title = f"A recorded gait of {body.title}, {'single' if name == 'ssp' else 'double'} support"
    return replace(problem, name=f"recorded-{name}", title=title)


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedCycles:
    """Recorded cycles of one robot that begin where the right foot leaves the ground, judged by the planned one's limits."""

    body: Body
    intervals: int  # of each phase, as in the planned problem
    options: Mapping[str, str | int | float | bool]  # of the problem that judges

    def judge(self, t: Array, q: Array, touch_down_s: float) -> Result:
        """Return a cycle with its own times and step, as a result of the problem that judges it.

        Angles (T, J) of the body's joints [rad] are at times (T,) from zero [s]; the right foot lands at ``touch_down_s``.

        Raises:
            InputError: a phase has too few samples.
        """
        motion = Motion(body=self.body, t=t, q=q)
        parts = {name: motion.cut(*span) for name, span in motion.phases(touch_down_s).items()}
        step_m = float(motion.right_foot(t[-1:])[0, 0])
        x = np.array([*(part.duration_s for part in parts.values()), step_m])
        problem = make_refinable(
            lambda grid: self.make_problem(parts, grid, motion.repeats), self.intervals, self.options
        )
        return Result(problem=problem, x=x)

    def make_problem(self, motions: Mapping[PhaseName, Motion], grid: Grid, repeats: bool) -> GaitProblem:
        """Return the problem of both phases of a motion and the rows that join them; if it repeats, another step can follow."""
        body, margins = self.body, make_cycle_margins(self.body)
        known = {variable.name: variable for variable in make_cycle_variables(body)}
        variables = (known[TIMES["ssp"]], known[TIMES["dsp"]], known[STEP])
        own: dict[PhaseName, tuple[Limit, ...]] = {
            "ssp": (
                HipLimits([_hip_ranges(known, switch) for switch in SWITCHES], SWITCHES),
                SwingLimits(motions["ssp"], known[LIFT]),
            ),
            "dsp": (StandingLimits(),),
        }
        phases = {
            name: RecordedPhase(
                body=body,
                variables=variables,
                duration=TIMES[name],
                loads=loads,
                grid=grid,
                limits=(*make_phase_limits(body, *margins[name], solved=False), *own[name]),
                goal=Goal(heat=body.heat),
                recorded=motions[name],
            )
            for name, loads in self._loads.items()
        }
        cycle = WalkingCycle(body=body, variables=variables, phases=phases, at_given_speed=False)
        problem = make_cycle_problem("recorded-cycle", cycle, rows_over_time=False, repeats=repeats)
        return replace(problem, title=f"A recorded gait of {body.title}, a walking cycle")

    @cached_property
    def _loads(self) -> dict[PhaseName, Loader]:
        return make_recorded_loads(self.body, "lever")


def _hip_ranges(known: Mapping[str, Variable], switch: str) -> dict[str, Variable]:
    """Variables whose ranges limit the hip at a switch."""
    places = {axis: known[f"hip_{axis}_{switch}_m"] for axis in "xz"}
    return places | {f"v{axis}": known[f"hip_v{axis}_{switch}_m_s"] for axis in "xyz"}
