"""Problems of recorded motions: judged by the limits of the planned phases; their times and their step are the variables."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.formulation import Array, Constraint, GaitProblem, Grid, Parameter, Point, Result, Signals
from nlp_gait.formulation.assembly import NumericPoint, RowsOverTime, Variable
from nlp_gait.formulation.blocks import make_labels
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, Support
from nlp_gait.gaits.biped.cycle import WalkingCycle, make_cycle_margins, make_cycle_problem
from nlp_gait.gaits.biped.cycle_motion import STEP, SWITCHES, make_cycle_variables
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes, make_rows
from nlp_gait.gaits.biped.load_sharing import Division, make_divided_loads
from nlp_gait.gaits.biped.phase import COLUMNS, WRENCHES, Phase
from nlp_gait.gaits.biped.phase_problem import make_phase_limits, make_phase_problem
from nlp_gait.gaits.biped.recorded_motion import FINE, RecordedMotion, make_instant_function
from nlp_gait.gaits.biped.samples import CORNERS, LEAST_DURATION, Loader, Planner, Samples
from nlp_gait.gaits.biped.support_phases import limit_to_box, limit_to_sole, make_single_support_loads, make_support_box
from nlp_gait.symbolic.nonsmooth import Nonsmooth

MOVES = 1e-9  # [rad]; a joint that turns by less is held


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPhase(Phase):
    """A phase whose angles over time are given, so that it has no plan."""

    recorded: RecordedMotion  # the motion, of the same joints
    plan: Planner = field(init=False)

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        turned = np.ptp(self.recorded.q, axis=0)
        return tuple(name for name, range_rad in zip(self.body.joints, turned, strict=True) if range_rad > MOVES)

    def rows_over_time(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[RowsOverTime, ...]:
        """Return nothing: a recording says nothing about the time between its samples."""
        return ()

    def sample_several(self, ats: Sequence[Point], ops: Nonsmooth, phases: MX | None = None) -> list[Samples]:
        """Evaluate the phase at N + 1 equidistant samples, at each of several points.

        Quantities besides those of all phases: ``hip_rate`` (3, N + 1) [m/s], ``sides`` (4, N + 1), y of the right sole's
        corners, and ``ground`` (2, N + 1), its place [m].
        """
        return [self._sample(at) for at in ats]

    def _sample(self, at: Point) -> Samples:
        q, qd, qdd = (MX(part) for part in self._angles(at))
        instant = make_instant_function(self.body, self.loads).map(self.grid.parts + 1)
        torque, zmp, _, hip, hip_rate, ankle, corners, _, left, right = instant(q, qd, qdd)
        rows_of = [self.body.joints.index(name) for name in self.moving]
        planned = [self.body.joints.index(name) for name in self.body.planned]
        return Samples(
            joints=self.body.joints,
            moving=self.moving,
            standing=self.standing,
            grid=self.grid,
            duration=at[self.duration],
            progress=self.grid.progress,
            values={
                "planned": q[planned, :],
                "reach": self.body.compute_cosines(q),
                "torque": torque,
                "power": qd[rows_of, :] * torque[rows_of, :],
                "zmp": zmp,
                "q": q[rows_of, :],
                "qd": qd[rows_of, :],
                "qdd": qdd[rows_of, :],
                "hip": hip,
                "hip_rate": hip_rate,
                "swing_heights": corners[2::3, :],
                "sides": corners[1::3, :],
                "ground": ankle[:2, :],
                "wrench_L": left,
                "wrench_R": right,
            },
        )

    def signals(self, at: NumericPoint) -> Signals:
        """Return time histories at a point of numbers; a sole within the tolerance from the ground is on it."""
        q, qd, qdd = self._angles(at)
        n = self.grid.parts + 1
        torque, zmp, torso, _, _, ankle, _, com, *wrenches = (
            np.asarray(DM(part).full().T) for part in make_instant_function(self.body, self.loads).map(n)(q, qd, qdd)
        )
        support, right = np.array(self.body.support), self.body.robot.feet["right"]
        left_foot = np.tile(support * (1.0, 1.0, 0.0), (n, 1))
        right_foot = ankle - (0.0, 0.0, right.ankle_height_m)
        right_foot[np.abs(right_foot[:, 2]) < GROUND_TOLERANCE.default, 2] = 0.0
        arrays = {
            "t": np.asarray(DM(at[self.duration]).full())[0, 0] * np.linspace(0.0, 1.0, n),
            **{name: np.asarray(DM(part).full().T) for name, part in (("q", q), ("qd", qd), ("qdd", qdd))},
            "tau": torque,
            "zmp": zmp,
            "hip": torso,
            "com": com,
            "left_foot": left_foot,
            "right_foot": right_foot,
            **dict(zip(WRENCHES, (half for wrench in wrenches for half in np.hsplit(wrench, 2)), strict=True)),
        }
        return Signals(joints=self.body.joints, arrays=arrays, columns=COLUMNS)

    def _angles(self, at: Any) -> tuple[Any, Any, Any]:
        """Angles (J, N + 1) and their derivatives, stretched to the phase's duration."""
        recorded, n = self.recorded, self.grid.parts + 1
        times = np.linspace(0.0, recorded.duration_s, n)
        speed = recorded.duration_s / ca.fmax(at[self.duration], LEAST_DURATION)
        q, qd, qdd = (DM(recorded.spline(times, order).T) for order in range(3))
        return q, qd * speed, qdd * speed**2


# Largest distance of a recorded sole from its place: rounding, and the spline between samples.
GROUND_TOLERANCE = Parameter(
    name="ground_tolerance_m",
    unit="m",
    default=5e-4,
    description="a sole nearer than this to the ground and to its place stands",
    minimum=0.0,
)


class HipLimits(Limit):
    """The hip at both ends within the ranges of planned variables, by what they limit: ``x``, ``z``, ``vx``, ``vy``, ``vz``."""

    def __init__(self, variables: Sequence[Mapping[str, Variable]], labels: Sequence[str]) -> None:
        self._variables, self._labels = variables, labels
        unique = {v.name: v for limits in variables for v in limits.values()}
        self.parameters = make_bound_parameters(tuple(unique.values()))

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        hip, rate = samples.read("hip"), samples.read("hip_rate")
        found = []
        for end, limits, label in zip((0, hip.shape[1] - 1), self._variables, self._labels, strict=False):
            values = {axis: hip[k, end] for k, axis in enumerate("xyz")}
            values |= {f"v{axis}": rate[k, end] for k, axis in enumerate("xyz")}
            for key, variable in limits.items():
                low, high = at[f"{variable.name}.lower"], at[f"{variable.name}.upper"]
                scale = variable.upper - variable.lower  # as a bound of the variable itself
                row = Constraint(
                    name=f"hip_{key}_{label}", unit=variable.unit, scale=scale, value=values[key], lower=low, upper=high
                )
                found.append(row)
        return found, {}


class SwingLimits(Limit):
    """A swinging right foot: on the ground at both ends, above it and next to the other one in between, lifted high enough."""

    def __init__(self, motion: RecordedMotion, lift: Variable) -> None:
        self._motion, self._lift = motion, lift
        self.parameters = (GROUND_TOLERANCE, *make_bound_parameters((lift,)))
        self._inner_edge = motion.body.support[1] - motion.body.robot.feet["left"].right_m

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        heights, sides, tolerance = samples.swing_heights, samples.read("sides"), at[GROUND_TOLERANCE.name]
        inside = range(1, samples.steps)
        # Of the whole motion, not of the samples alone.
        highest = MX(float(self._motion.right_foot(np.linspace(0.0, self._motion.duration_s, FINE))[:, 2].max()))
        ends = ca.horzcat(heights[:, 0], heights[:, -1])
        lift = self._lift.name
        apart = self._inner_edge - ca.vec(sides[1::2, 1:-1])
        return (
            make_rows(
                "foot_stands", "m", ca.vec(ends), -tolerance, tolerance, make_labels(CORNERS, (0, samples.steps))
            ),
            make_rows("foot_height", "m", ca.vec(heights[:, 1:-1]), -tolerance, labels=make_labels(CORNERS, inside)),
            make_rows("feet_apart", "m", apart, MX(0.0), labels=make_labels(CORNERS[1::2], inside)),
            make_rows("swing_height", "m", highest, at[f"{lift}.lower"], at[f"{lift}.upper"]),
        ), {"swing_height_m": highest}


class StandingLimits(Limit):
    """A right foot that stands: its sole on the ground, and at its mean place."""

    parameters = (GROUND_TOLERANCE,)

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        heights, ground, tolerance = samples.swing_heights, samples.read("ground"), at[GROUND_TOLERANCE.name]
        n = samples.steps + 1
        drift = ground - ca.repmat(ca.sum2(ground) / n, 1, n)
        every = range(n)
        return (
            make_rows("foot_stands", "m", ca.vec(heights), -tolerance, tolerance, make_labels(CORNERS, every)),
            make_rows("foot_still", "m", ca.vec(drift), -tolerance, tolerance, make_labels(("x", "y"), every)),
        ), {}


def make_bound_parameters(variables: Sequence[Variable]) -> tuple[Parameter, ...]:
    """Return the bounds of a planned motion's variables as parameters."""
    return tuple(bound for v in variables for bound in (v.bound("lower"), v.bound("upper")))


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedGait:
    """A gait from elsewhere, as a problem whose only variables are its times."""

    gait: str  # name of the problem with whose limits it is judged
    # The recorded gait; its variables are the durations of its phases, and of a cycle the step length
    problem: GaitProblem
    x: tuple[float, ...]  # (n,) its own durations and step
    motion: RecordedMotion  # on the left foot
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


@lru_cache(maxsize=8)  # as many as those of ``make_instant_function``, which finds them again by these loads
def make_recorded_loads(body: Body, rule: Division) -> dict[Support, Loader]:
    """Return the loads of both phases for any angles, at which no link stays upright."""
    freed = replace(body, upright=frozenset())
    return {Support.SINGLE: make_single_support_loads(freed), Support.DOUBLE: make_divided_loads(freed, rule)}


def make_recorded_phase_problem(body: Body, name: Support, motion: RecordedMotion, grid: Grid) -> GaitProblem:
    """Return the problem of one recorded phase, whose time is its variable."""
    height, vz0, vz1, vx0, vx1, vy0, vy1 = body.hip_variables
    ends = ({"z": height, "vx": vx0, "vy": vy0, "vz": vz0}, {"z": height, "vx": vx1, "vy": vy1, "vz": vz1})
    left = body.support[:2]
    own: Limit
    if name == Support.SINGLE:
        balance, own = limit_to_sole(body, left), SwingLimits(motion, body.lift_variable)
    else:
        foot = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))
        x, y = (foot[:, :2].mean(axis=0) + (0.0, left[1])).tolist()
        balance = limit_to_box(make_support_box(body.robot, {"L": left, "R": (x, y)}))
        own = StandingLimits()
    phase = RecordedPhase(
        body=body,
        variables=(body.make_time_variable(name),),
        duration=TIMES[name],
        loads=make_recorded_loads(body, "printed")[name],
        grid=grid,
        limits=(*make_phase_limits(body, balance, solved=False), HipLimits(ends, ("start", "end")), own),
        goal=Goal(heat=body.heat),
        standing=name.standing,
        recorded=motion,
    )
    problem = make_phase_problem(name, "", phase)
    title = f"A recorded gait of {body.title}, {'single' if name == Support.SINGLE else 'double'} support"
    return replace(problem, name=f"recorded-{name}", title=title)


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedCycles:
    """Recorded cycles of one robot that begin where the right foot leaves the ground, judged by the planned one's limits."""

    body: Body
    intervals: int  # of each phase, as in the planned problem
    options: Mapping[str, str | int | float | bool]  # of the problem that judges

    def judge(self, t: Array, q: Array, touch_down_s: float) -> Result:
        """Return a cycle with its own times and step, as a result of the problem that judges it; raises InputError as ``cut``.

        Angles (T, J) of the body's joints [rad] are at times (T,) from zero [s]; the right foot lands at ``touch_down_s``.
        """
        motion = RecordedMotion(body=self.body, t=t, q=q)
        parts = {name: motion.cut(*span) for name, span in motion.phases(touch_down_s).items()}
        step_m = float(motion.right_foot(t[-1:])[0, 0])
        x = np.array([*(part.duration_s for part in parts.values()), step_m])
        problem = make_refinable(
            lambda grid: self.make_problem(parts, grid, motion.repeats), self.intervals, self.options
        )
        return Result(problem=problem, x=x)

    def make_problem(self, motions: Mapping[Support, RecordedMotion], grid: Grid, repeats: bool) -> GaitProblem:
        """Return the problem of both phases of a motion and the rows that join them; if it repeats, another step can follow."""
        body, margins = self.body, make_cycle_margins(self.body)
        known = {variable.name: variable for variable in make_cycle_variables(body)}
        variables = (known[TIMES[Support.SINGLE]], known[TIMES[Support.DOUBLE]], known[STEP])
        places = [{axis: known[f"hip_{axis}_{switch}_m"] for axis in "xz"} for switch in SWITCHES]
        rates = [{f"v{axis}": known[f"hip_v{axis}_{switch}_m_s"] for axis in "xyz"} for switch in SWITCHES]
        hip = HipLimits([place | rate for place, rate in zip(places, rates, strict=True)], SWITCHES)
        own: dict[Support, tuple[Limit, ...]] = {
            Support.SINGLE: (hip, SwingLimits(motions[Support.SINGLE], known[LIFT])),
            Support.DOUBLE: (StandingLimits(),),
        }
        phases: dict[Support, Phase] = {
            name: RecordedPhase(
                body=body,
                variables=variables,
                duration=TIMES[name],
                loads=loads,
                grid=grid,
                limits=(*make_phase_limits(body, margins[name], solved=False), *own[name]),
                goal=Goal(heat=body.heat),
                standing=name.standing,
                recorded=motions[name],
            )
            for name, loads in make_recorded_loads(body, "lever").items()
        }
        cycle = WalkingCycle(body=body, variables=variables, phases=phases, at_given_speed=False)
        problem = make_cycle_problem("recorded-cycle", cycle, rows_over_time=False, repeats=repeats)
        return replace(problem, title=f"A recorded gait of {body.title}, a walking cycle")
