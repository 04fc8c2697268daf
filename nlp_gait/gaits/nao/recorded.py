"""Problems of recorded motions: judged by the limits of the planned phases; their times and their step are the variables."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint, GaitProblem, Grid, Parameter, Point, SolverHints, load
from nlp_gait.formulation.assembly import Variable, make_labels
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.gaits.biped.body import LIFT, TIMES, Support, make_hip_variables, make_lift_variable, make_time_variable
from nlp_gait.gaits.biped.cycle import STEP, WalkingCycle, make_cycle_margins, make_cycle_variables
from nlp_gait.gaits.biped.limits import BalanceMargins, Limit, RowsAndMetrics, make_rows
from nlp_gait.gaits.biped.loads import Division, make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import make_gait_problem, make_phase, make_phase_problem
from nlp_gait.gaits.biped.samples import CORNERS, Samples
from nlp_gait.gaits.biped.sequence import SWITCHES
from nlp_gait.gaits.biped.support_phases import limit_to_box, limit_to_sole, make_support_box
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.gaits.nao.recorded_motion import FINE, RecordedMotion, make_places_function, read_motion
from nlp_gait.gaits.nao.recorded_phase import GROUND_TOLERANCE, RecordedPhase
from nlp_gait.symbolic.nonsmooth import Nonsmooth

GAITS = ("nao-ssp", "nao-dsp", "nao-cycle")


class HipLimits(Limit):
    """The hip at both ends within the ranges of planned variables, by what they limit: ``x``, ``z``, ``vx``, ``vy``, ``vz``."""

    def __init__(self, variables: Sequence[Mapping[str, Variable]], labels: Sequence[str]) -> None:
        self._variables, self._labels = variables, labels
        unique = {v.name: v for limits in variables for v in limits.values()}
        self.parameters = make_bound_parameters(tuple(unique.values()))

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        hip, rate = samples.hip, samples.hip_rate
        rows = []
        for end, limits, label in zip((0, hip.shape[1] - 1), self._variables, self._labels, strict=False):
            values = {axis: hip[k, end] for k, axis in enumerate("xyz")}
            values |= {f"v{axis}": rate[k, end] for k, axis in enumerate("xyz")}
            for key, variable in limits.items():
                low, high = point[f"{variable.name}.lower"], point[f"{variable.name}.upper"]
                scale = variable.upper - variable.lower  # as a bound of the variable itself
                row = Constraint(
                    name=f"hip_{key}_{label}", unit=variable.unit, scale=scale, value=values[key], lower=low, upper=high
                )
                rows.append(row)
        return rows, {}


class SwingLimits(Limit):
    """A swinging right foot: on the ground at both ends, above it and next to the other one in between, lifted high enough."""

    def __init__(self, motion: RecordedMotion, lift: Variable) -> None:
        self._motion, self._lift = motion, lift
        self.parameters = (GROUND_TOLERANCE, *make_bound_parameters((lift,)))
        self._inner_edge = motion.body.support[1] - motion.body.robot.feet["left"].right_m

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        heights, sides, tolerance = samples.swing_heights, samples.sides, point[GROUND_TOLERANCE.name]
        inside = range(1, samples.steps)
        # Of the whole motion, not of the samples alone.
        highest = MX(float(self._motion.right_foot(np.linspace(0.0, self._motion.duration_s, FINE))[:, 2].max()))
        ends = ca.horzcat(heights[:, 0], heights[:, -1])
        lift = self._lift.name
        apart = self._inner_edge - ca.vec(sides[:, 1:-1])
        return (
            make_rows(
                "foot_stands", "m", ca.vec(ends), -tolerance, tolerance, make_labels(CORNERS, (0, samples.steps))
            ),
            make_rows("foot_height", "m", ca.vec(heights[:, 1:-1]), -tolerance, labels=make_labels(CORNERS, inside)),
            make_rows("feet_apart", "m", apart, MX(0.0), labels=make_labels(CORNERS[1::2], inside)),
            make_rows("swing_height", "m", highest, point[f"{lift}.lower"], point[f"{lift}.upper"]),
        ), {"swing_height_m": highest}


class StandingLimits(Limit):
    """A right foot that stands: its sole on the ground, and at its mean place."""

    parameters = (GROUND_TOLERANCE,)

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        heights, ground, tolerance = (
            samples.swing_heights,
            samples.right_foot[:2, :],
            point[GROUND_TOLERANCE.name],
        )
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
    inferred: bool  # whether the phases are estimated from the motion
    # Makes the planned problem with the same robot, step and durations; raises InputError if this gait has none
    make_planned: Callable[[], GaitProblem]


def make_refinable(
    build: Callable[[Grid], GaitProblem], intervals: int, options: Mapping[str, str | int | float | bool]
) -> GaitProblem:
    """Return a problem on the planned one's samples, which can be refined: ``build`` makes it on a grid."""

    def refine(factor: int) -> GaitProblem:
        grid = Grid(intervals=intervals, samples_per_interval=factor, refined_by="samples_per_interval")
        return replace(build(grid), options=dict(options), refine=lambda by: refine(factor * by))

    return refine(1)


def make_recorded_phase(
    motion: RecordedMotion,
    kind: Support,
    variables: tuple[Variable, ...],
    grid: Grid,
    rule: Division,
    balance: BalanceMargins,
    *limits: Limit,
) -> Phase:
    """Return a phase that a motion shows, with the limits of planned ones, balance and others."""
    body = motion.body
    return make_phase(
        body,
        kind,
        balance,
        make_divided_loads(body, rule),
        limits,
        RecordedPhase,
        variables=variables,
        duration=TIMES[kind],
        grid=grid,
        recorded=motion,
    )


def make_recorded_phase_problem(kind: Support, motion: RecordedMotion, grid: Grid) -> GaitProblem:
    """Return the problem of one recorded phase, whose time is its variable."""
    body = motion.body
    height, vz0, vz1, vx0, vx1, vy0, vy1 = make_hip_variables(body)
    ends = ({"z": height, "vx": vx0, "vy": vy0, "vz": vz0}, {"z": height, "vx": vx1, "vy": vy1, "vz": vz1})
    hip, left = HipLimits(ends, ("start", "end")), body.support[:2]
    foot: Limit
    if kind is Support.SINGLE:
        balance, foot = limit_to_sole(body, left), SwingLimits(motion, make_lift_variable(body))
    else:
        places = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))
        x, y = (places[:, :2].mean(axis=0) + (0.0, left[1])).tolist()
        balance, foot = limit_to_box(make_support_box(body.robot, {"L": left, "R": (x, y)})), StandingLimits()
    variables = (make_time_variable(body, kind),)
    phase = make_recorded_phase(motion, kind, variables, grid, "printed", balance, hip, foot)
    return make_phase_problem(kind, f"{'single' if kind is Support.SINGLE else 'double'} support", phase)


def make_recorded_cycle_problem(motions: Mapping[Support, RecordedMotion], repeats: bool, grid: Grid) -> GaitProblem:
    """Return the problem of both phases of a motion and the rows that join them; if it repeats, another step can follow."""
    body = motions[Support.SINGLE].body
    margins = make_cycle_margins(body)
    planned = {variable.name: variable for variable in make_cycle_variables(body)}
    variables = (planned[TIMES[Support.SINGLE]], planned[TIMES[Support.DOUBLE]], planned[STEP])
    places = [{axis: planned[f"hip_{axis}_{switch}_m"] for axis in "xz"} for switch in SWITCHES]
    rates = [{f"v{axis}": planned[f"hip_v{axis}_{switch}_m_s"] for axis in "xyz"} for switch in SWITCHES]
    hip = HipLimits([place | rate for place, rate in zip(places, rates, strict=True)], SWITCHES)
    single = (margins[Support.SINGLE], hip, SwingLimits(motions[Support.SINGLE], planned[LIFT]))
    double = (margins[Support.DOUBLE], StandingLimits())
    phases = {
        kind: make_recorded_phase(motions[kind], kind, variables, grid, "lever", *limits)
        for kind, limits in ((Support.SINGLE, single), (Support.DOUBLE, double))
    }
    cycle = WalkingCycle(body=body, variables=variables, phases=phases, at_given_speed=False)
    return make_gait_problem(cycle, "cycle", "a walking cycle", SolverHints(), repeats=repeats)


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
    cycle, both are detected. Raises InputError for angles that are not a gait, or another gait than named.
    """
    if gait is not None and gait not in GAITS:
        raise InputError(f"a motion is judged by the limits of {', '.join(GAITS)}, got {gait!r}")
    options: Mapping[str, str | int] = {"robot": robot, "intervals": intervals}
    nao = make_nao(robot)
    # Torso and soles of a recorded motion may turn.
    body = replace(nao, family="recorded", title=f"A recorded gait of {nao.title}", upright=frozenset())
    motion = read_motion(angles, body)
    inferred = touch_down_s is None and gait not in ("nao-ssp", "nao-dsp")
    if touch_down_s is None and not inferred:
        phases = {Support.SINGLE if gait == "nao-ssp" else Support.DOUBLE: (0.0, motion.duration_s)}
    else:
        phases = motion.phases(touch_down_s)
    shown = "nao-cycle" if len(phases) > 1 else "nao-ssp" if Support.SINGLE in phases else "nao-dsp"
    if gait not in (None, shown):
        raise InputError(
            f"{angles.owner} shows {shown}, not {gait}: the right foot lands at no time before the end; name it with --touch-down"
        )
    foot = motion.right_foot(np.array([0.0, motion.duration_s]))
    step = float(foot[1, 0])
    x: tuple[float, ...] = (motion.duration_s,)
    if shown == "nao-cycle":
        motions = {kind: motion.cut(*span) for kind, span in phases.items()}
        build = partial(make_recorded_cycle_problem, motions, motion.repeats)
        x = (*(motion.duration_s for motion in motions.values()), step)
    else:
        ((kind, span),) = phases.items()
        build = partial(make_recorded_phase_problem, kind, motion.cut(*span))
        step = float(foot[1, 0] - foot[0, 0]) / 2 if kind is Support.SINGLE else step
    problem = make_refinable(build, intervals, options)
    cosine = float(make_places_function(motion.body)(motion.q[0])[1])
    return RecordedGait(
        gait=shown,
        problem=problem,
        x=x,
        motion=motion,
        step_m=step,
        inferred=inferred,
        lean_deg=float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))),
        make_planned=partial(_load_planned, shown, problem, x, step),
    )


def _load_planned(gait: str, recorded: GaitProblem, x: Sequence[float], step_m: float) -> GaitProblem:
    options = {key: recorded.options[key] for key in ("robot", "intervals")}
    if not step_m > 0.0:
        raise InputError(f"the step is {step_m:g} m long, and a planned one must be longer than 0 m")
    problem = load(gait, **options) if gait == "nao-cycle" else load(gait, step_length_m=step_m, **options)
    fixed = dict(zip(recorded.names, x, strict=True))
    wider: dict[str, float] = {}
    for name, value in fixed.items():  # a recorded duration may violate its bounds; the optimum has the same duration
        low, high = problem.value(f"{name}.lower"), problem.value(f"{name}.upper")
        wider |= {f"{name}.lower": min(low, value), f"{name}.upper": max(high, value)}
    return problem.with_values(**wider).fix(**fixed)
