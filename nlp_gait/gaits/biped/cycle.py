"""A walking cycle as one problem: its motion, rows of both phases, changes of torques at the switches, energy and speed."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX, fmax, vertcat, vertsplit

from nlp_gait.formulation import Array, Assembly, GaitProblem, Grid, InstantPoint, Signals, SolverHints, Start, Variable
from nlp_gait.formulation.assembly import Objective, Parameter, Point, make_parameters
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped.body import (
    LIFT,
    TIMES,
    Angles,
    Body,
    Support,
    make_lift_variable,
    make_time_variable,
    read_duration,
)
from nlp_gait.gaits.biped.footholds import Foothold
from nlp_gait.gaits.biped.limits import REACH_MARGIN, BalanceMargins, Box, Goal, compute_margins, make_rows
from nlp_gait.gaits.biped.phase_problem import make_gait_problem, make_phase, make_start_within_reach
from nlp_gait.gaits.biped.samples import Instant, Loader, Planner
from nlp_gait.gaits.biped.sequence import (
    BALANCE,
    ENERGY_PER_METRE,
    SWITCHES,
    TORQUE_JUMP,
    End,
    MotionSection,
    Sequence,
    SwitchState,
    limit_torque_jump,
    make_state_variables,
    read_state,
)
from nlp_gait.gaits.biped.support_phases import limit_to_box, limit_to_sole, make_support_box, swing_foot
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, cubic, stack

STEP_SHARES = (0.1, 0.6)  # of a leg's length; generous, so that reach decides
STEP = "step_length_m"
LEAST_STEP = 1e-3  # [m]; a shorter step is evaluated as this one, so that the path of the swing foot stays defined


class PhaseMotion(NamedTuple):
    """A phase of a walk over the left foot, which stands at x = 0: from state to state while the right foot swings or stands."""

    start: SwitchState
    end: SwitchState
    duration: SX  # [s]
    foot: Motion  # ankle (3,) of the right foot [m]
    turns: Angles = {}  # of torso and right foot, if they turn


def make_cycle_variables(body: Body) -> tuple[Variable, ...]:
    """Return the variables of a cycle, most with the bounds of the phases; the step length is the last one."""
    states = [variable for switch in SWITCHES for variable in make_state_variables(body, switch, switch)]
    low, high = (round(share * body.leg_length_m, 3) for share in STEP_SHARES)
    step = Variable(name=STEP, unit="m", lower=low, upper=high, description="from foot to foot")
    return (
        *states,
        make_lift_variable(body),
        make_time_variable(body, Support.SINGLE),
        make_time_variable(body, Support.DOUBLE),
        step,
    )


def make_cycle_planners(body: Body) -> dict[Support, Planner]:
    """Return the plans of both phases, which are continuous at touch-down."""
    signs = DM([c.mirror_sign for c in body.coordinates])
    mirror = SX([1, -1, 1])

    def read(point: InstantPoint) -> tuple[SwitchState, SwitchState, SX]:
        """Return the states at lift-off and touch-down, and the step length [m]."""
        lift_off, landed = (read_state(point, switch, body.coordinates) for switch in SWITCHES)
        return lift_off, landed, fmax(point[STEP], LEAST_STEP)

    def single(point: InstantPoint, phase: SX) -> PhaseMotion:
        lift_off, landed, step = read(point)
        duration = read_duration(point, Support.SINGLE)
        foot = swing_foot(-step, step, *body.ankle("R"), point[LIFT], duration, phase)
        return PhaseMotion(lift_off, landed, duration, foot)

    def double(point: InstantPoint, phase: SX) -> PhaseMotion:
        (hip, velocity, angles, rates), landed, step = read(point)
        place = mirror * hip + vertcat(step, 0, 0)  # the mirror image of lift-off, a step further
        end = SwitchState(place, mirror * velocity, signs * angles, signs * rates)
        return PhaseMotion(landed, end, read_duration(point, Support.DOUBLE), body.standing_ankle("R", step))

    return {Support.SINGLE: make_planner(body, single), Support.DOUBLE: make_planner(body, double)}


def make_planner(body: Body, read: Callable[[InstantPoint, SX], PhaseMotion]) -> Planner:
    """Return the plan of a phase over the left foot from a function of its point and its time, a share of the duration."""
    left = body.standing_ankle("L")

    def plan(point: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
        motion = read(point, phase)
        hip, angles = interpolate_states(motion.start, motion.end, motion.duration, phase)
        turned = {**body.cycle_angles(angles), **motion.turns}
        return body.plan(hip, turned, {"L": left, "R": motion.foot}, point[REACH_MARGIN], ops)

    return plan


def interpolate_states(
    start: SwitchState, end: SwitchState, duration: SX, phase: SX
) -> tuple[Motion, tuple[Motion, ...]]:
    """Return the cubic motions of the hip (3,) [m] and of every coordinate [rad] from state to state."""

    def curves(*ends: SX) -> tuple[Motion, ...]:
        columns = zip(*map(vertsplit, ends), strict=True)
        return tuple(cubic(a, b, va, vb, duration, phase) for a, b, va, vb in columns)

    hip = curves(start.hip, end.hip, start.hip_velocity, end.hip_velocity)
    return stack(*hip), curves(start.angles, end.angles, start.angle_rates, end.angle_rates)


SPEED = "speed_m_s"
SPEED_M_S = 0.03  # default, of NAO
LEAST_SPEED = 1e-4  # [m/s]
NO_JUMP_LIMIT = 1000.0  # of NAO [Nm]


# Its plans read states and places of the feet themselves.
SECTIONS = tuple(
    MotionSection(kind, kind, End(), End(), (Foothold(0.0, 0.0, 0.0),) * 2, time) for kind, time in TIMES.items()
)


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkingCycle(Sequence):
    """A cycle sampled over both phases; of the variables, the step length is the last one."""

    sections: tuple[MotionSection, ...] = SECTIONS
    at_given_speed: bool  # the step length is no decision variable but follows from the speed

    @property
    def objective(self) -> Objective:
        """What is minimised."""
        return self.phases[Support.SINGLE].objective if self.at_given_speed else ENERGY_PER_METRE

    @property
    def decisions(self) -> tuple[Variable, ...]:
        """Variables of the problem, in the order of x."""
        return self.variables[:-1] if self.at_given_speed else self.variables

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of both phases; those of balance begin with the phase's name."""
        both = self.phase_parameters
        balance, shared = ([p for p in both if p.name.endswith(BALANCE) == of_balance] for of_balance in (True, False))
        jump = ("largest torque jump at a switch; the default never binds", 0.0, math.inf)
        limit = make_parameters((TORQUE_JUMP, "Nm", NO_JUMP_LIMIT * math.ceil(self.body.torque_scale), *jump))
        step = self.variables[-1]
        speed = make_parameters(
            (SPEED, "m/s", self.body.scale_time(SPEED_M_S), "speed of walking", LEAST_SPEED, math.inf),
            (f"{STEP}.lower", "m", step.lower, "lower bound of the step length", -math.inf, math.inf),
            (f"{STEP}.upper", "m", step.upper, "upper bound of the step length", -math.inf, math.inf),
        )
        return (*(speed if self.at_given_speed else ()), *balance, *limit, *shared)

    def read_section(self, section: MotionSection, point: Any) -> Any:
        """Return the point with the step length as a variable, also if it follows from the speed."""
        if not self.at_given_speed:
            return point
        return point.extend(STEP, point[SPEED] * (point[TIMES[Support.SINGLE]] + point[TIMES[Support.DOUBLE]]))

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return objective, rows and metrics.

        Torques may change by ``torque_change_limit_Nm`` over every interval of both phases, and at a switch by another limit,
        which is off by default: the published one is for a change over an interval of time, while at a switch the
        supporting feet change at once and in this model the loads with them.
        """
        extended = self.read_section(self.sections[0], point)
        sections = self.assemble_sections(point, ops)
        period, step = sum(sections.times.values(), MX(0)), ca.fmax(extended[STEP], LEAST_STEP)
        energy = sum(sections.energies.values(), MX(0))
        mean = sum((sections.objectives[name] * time for name, time in sections.times.items()), MX(0)) / period
        single, double = sections.samples.values()
        lift_off, jump = limit_torque_jump("lift_off", self.body, extended, double, single, mirrored=True)
        touch_down, landing = limit_torque_jump("touch_down", self.body, extended, single, double)
        rows = [lift_off, touch_down]
        if self.at_given_speed:
            lower, upper = (extended[f"{STEP}.{end}"] for end in ("lower", "upper"))
            rows.append(make_rows("step_length", "m", extended[STEP], lower, upper, over="once"))
        return Assembly(
            objective=mean if self.at_given_speed else energy / step,
            constraints=(*sections.rows, *rows),
            metrics={
                "power_W": energy / period,
                "energy_J_per_m": energy / step,
                "cost_of_transport": energy / step / self.body.weight,
                "speed_m_s": step / period,
                "step_length_m": step,
                **sections.metrics,
                **jump,
                **landing,
            },
        )

    def signals(self, point: Point) -> Signals:
        """Return time histories of the cycle at a point of numbers."""
        return self.list_step_signals(point)[0]


def make_walking_cycle(body: Body, loads: Loader, grid: Grid, goal: Goal, *, at_given_speed: bool) -> WalkingCycle:
    """Return both phases of the cycle, joined, each with the goal; at a given speed the step length follows from it."""
    variables, margins = make_cycle_variables(body), make_cycle_margins(body)
    fields: dict[str, Any] = {"variables": variables, "grid": grid, "goal": goal}
    phases = {
        kind: make_phase(body, kind, margins[kind], loads, duration=TIMES[kind], plan=plan, **fields)
        for kind, plan in make_cycle_planners(body).items()
    }
    return WalkingCycle(body=body, variables=variables, phases=phases, at_given_speed=at_given_speed)


def make_cycle_margins(body: Body, right_x: str = STEP) -> dict[Support, BalanceMargins]:
    """Return the balance margins of each phase; ``right_x`` is the place of the right foot in double support."""
    feet, (left_y, right_y) = body.robot.feet, body.feet_y
    usual = make_support_box(body.robot, {"L": (0.0, left_y), "R": (body.step_length_m, right_y)})

    def double(zmp: MX, point: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        """In the box around the left foot and the right one a step ahead."""
        step = point[right_x]
        back = ca.fmin(-feet["left"].back_m, step - feet["right"].back_m)
        front = ca.fmax(feet["left"].front_m, step + feet["right"].front_m)
        return compute_margins(Box(back=back, front=front, right=usual.right, left=usual.left), zmp, ops)

    return {Support.SINGLE: limit_to_sole(body, (0.0, left_y)), Support.DOUBLE: limit_to_box(usual, double)}


def make_cycle_problem(cycle: WalkingCycle) -> GaitProblem:
    """Return the problem of a walking cycle."""
    names = tuple(variable.name for variable in cycle.decisions)

    def reach(point: Point) -> MX:
        return ca.horzcat(
            *(cycle.phases[p.kind].sample(cycle.read_section(p, point), Exact()).knee_cosine for p in cycle.sections)
        )

    start: Start | None = partial(draw_start, names) if cycle.at_given_speed else None
    if not cycle.body.closed_form:
        start = make_start_within_reach(cycle, (SPEED,) if cycle.at_given_speed else (), reach, start)
    title = f"walking cycle: least {cycle.objective.name.replace('_', ' ')}"
    problem = make_gait_problem(cycle, "cycle", title, SolverHints(start=start), repeats=True)
    return problem if cycle.at_given_speed else replace(problem, with_other_options={SPEED: "objective=power"})


def draw_start(names: tuple[str, ...], values: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Draw a start point within the bounds, whose times give a step within its bounds, as far as their own bounds allow."""
    x = draw_uniform(names, values, rng)
    times = [names.index(time) for time in TIMES.values()]
    step = rng.uniform(values[f"{STEP}.lower"], values[f"{STEP}.upper"])
    x[times] *= step / (values[SPEED] * x[times].sum())
    return x
