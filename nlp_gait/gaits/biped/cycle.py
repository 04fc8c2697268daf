"""A walking cycle as one problem: rows of both phases, changes of torques at the switches, energy and speed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.formulation import Array, Assembly, Constraint, Display, GaitProblem, Grid, Signals, SolverHints, Start
from nlp_gait.formulation.assembly import Objective, Parameter, Point, RowsOverTime, Variable, make_parameters
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped.body import TIMES, Body, PhaseName
from nlp_gait.gaits.biped.cycle_motion import LEAST_STEP, STEP, make_cycle_planners, make_cycle_variables
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.joined_phases import (
    BALANCE,
    ENERGY_PER_METRE,
    assemble_part,
    collect_parameters,
    join_phases,
    list_rows_over_time,
)
from nlp_gait.gaits.biped.limits import BalanceMargins, Box, Limit, compute_margins, make_rows
from nlp_gait.gaits.biped.load_sharing import LoadSharing
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import add_robot, make_goal, make_phase_limits, make_start_within_reach
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Loader, Planner
from nlp_gait.gaits.biped.support_phases import limit_to_box, limit_to_sole, make_single_support_loads, make_support_box
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

SPEED = "speed_m_s"
SPEED_M_S = 0.03  # default, of NAO
# Energy per metre leaves the speed free; the others are means over the time of a cycle at a given speed.
CycleObjective = Literal["energy-per-metre", "power", "torque"]
LEAST_SPEED = 1e-4  # [m/s]
NO_JUMP_LIMIT = 1000.0  # of NAO [Nm]


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkingCycle:
    """A cycle sampled over both phases."""

    body: Body
    variables: tuple[Variable, ...]  # of the motion, the step length last
    phases: Mapping[str, Phase]  # ``"ssp"`` and ``"dsp"``
    at_given_speed: bool  # the step length is no decision variable but follows from the speed

    @property
    def objective(self) -> Objective:
        """What is minimised."""
        return self.phases["ssp"].goal.objective if self.at_given_speed else ENERGY_PER_METRE

    @property
    def decisions(self) -> tuple[Variable, ...]:
        """Variables of the problem, in the order of x."""
        return self.variables[:-1] if self.at_given_speed else self.variables

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of both phases; those of balance begin with the phase's name."""
        both = collect_parameters(self.phases)
        balance, shared = ([p for p in both if p.name.endswith(BALANCE) == own] for own in (True, False))
        jump = ("largest jump of a torque at a switch; the default is out of reach", 0.0, math.inf)
        limit = make_parameters(
            ("torque_jump_limit_Nm", "Nm", NO_JUMP_LIMIT * math.ceil(self.body.torque_scale), *jump)
        )
        step = self.variables[-1]
        speed = make_parameters(
            (SPEED, "m/s", self.body.scale_time(SPEED_M_S), "speed of walking", LEAST_SPEED, math.inf),
            (f"{STEP}.lower", "m", step.lower, "lower bound of the step length", -math.inf, math.inf),
            (f"{STEP}.upper", "m", step.upper, "upper bound of the step length", -math.inf, math.inf),
        )
        return (*(speed if self.at_given_speed else ()), *balance, *limit, *shared)

    def add_step(self, at: Point) -> Point:
        """Return the point with the step length as a variable, also if it follows from the speed."""
        if not self.at_given_speed:
            return at
        return at.extend(STEP, at[SPEED] * (at[TIMES["ssp"]] + at[TIMES["dsp"]]))

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return objective, rows and indexes.

        Torques may change by ``torque_change_limit_Nm`` over every interval of both phases, and at a switch by another limit,
        which is off by default: the published one is for a change over an interval of time, while at a switch the
        supporting feet change at once and in this model the loads with them.
        """
        at = self.add_step(point)
        samples = {name: phase.sample(at, ops) for name, phase in self.phases.items()}
        found = {name: assemble_part(name, name, phase, at, samples[name], ops) for name, phase in self.phases.items()}
        times = {name: ca.fmax(at[time], LEAST_DURATION) for name, time in TIMES.items()}
        period, step = times["ssp"] + times["dsp"], ca.fmax(at[STEP], LEAST_STEP)
        energy = sum(found[name].indexes[f"{name}_power_W"] * times[name] for name in times)
        mean = sum(found[name].objective * times[name] for name in times) / period
        # Changes of torques (J, 1) at the switches [Nm]; lift-off leads to the mirror image of the cycle's start.
        (images, signs), single, double = self.body.mirror, samples["ssp"].torque, samples["dsp"].torque
        jumps = {"lift_off": DM(signs) * single[images, 0] - double[:, -1], "touch_down": double[:, 0] - single[:, -1]}
        return Assembly(
            objective=mean if self.at_given_speed else energy / step,
            constraints=(*(row for part in found.values() for row in part.constraints), *self._join(jumps, at)),
            indexes={
                "power_W": energy / period,
                "energy_J_per_m": energy / step,
                "cost_of_transport": energy / step / self.body.weight,
                "speed_m_s": step / period,
                "step_length_m": step,
                **{name: value for part in found.values() for name, value in part.indexes.items()},
                **{f"{switch}_torque_jump_Nm": ca.mmax(ca.fabs(jump)) for switch, jump in jumps.items()},
            },
        )

    def _join(self, jumps: Mapping[str, MX], at: Point) -> list[Constraint]:
        """Return the rows of both switches, and of the step length where it follows from the speed."""
        limit, joints = at["torque_jump_limit_Nm"], self.body.joints
        rows = [
            make_rows(f"{switch}_torque_jump", "Nm", jump, -limit, limit, joints, "once", self.body.torque_scale)
            for switch, jump in jumps.items()
        ]
        if self.at_given_speed:
            rows.append(make_rows("step_length", "m", at[STEP], at[f"{STEP}.lower"], at[f"{STEP}.upper"], over="once"))
        return rows

    @property
    def rows_over_time(self) -> tuple[RowsOverTime, ...]:
        """Both phases as functions of time."""
        parts = ((name, name, phase.duration, 1) for name, phase in self.phases.items())
        return list_rows_over_time(parts, self.phases, lambda name, at: self.add_step(at))

    def signals(self, at: Point) -> Signals:
        """Return time histories of the cycle at a point of numbers."""
        return join_phases(phase.signals(self.add_step(at)) for phase in self.phases.values())


def make_walking_cycle(
    body: Body, sharing: LoadSharing, grid: Grid, goal: Goal, *, at_given_speed: bool
) -> WalkingCycle:
    """Return both phases of the cycle, joined, each with the goal; at a given speed the step length follows from it."""
    *motion, step = make_cycle_variables(body)
    variables = (*motion, *sharing.variables, step)
    plans, margins = make_cycle_planners(body), make_cycle_margins(body)
    own: dict[PhaseName, tuple[Planner, Loader, tuple[Limit, ...]]] = {
        "ssp": (plans["ssp"], make_single_support_loads(body), ()),
        "dsp": (sharing.add_to(plans["dsp"]), sharing.loads, sharing.limits),
    }
    phases: dict[str, Phase] = {
        name: Phase(
            body=body,
            variables=variables,
            duration=TIMES[name],
            plan=plan,
            loads=loads,
            grid=grid,
            limits=(*make_phase_limits(body, margins[name]), *body.motors.limits, *more),
            goal=goal,
            standing=("L",) if name == "ssp" else ("L", "R"),
        )
        for name, (plan, loads, more) in own.items()
    }
    return WalkingCycle(body=body, variables=variables, phases=phases, at_given_speed=at_given_speed)


def make_cycle_margins(body: Body) -> dict[PhaseName, BalanceMargins]:
    """Return the balance margins of each phase."""
    feet, (left_y, right_y) = body.robot.feet, body.feet_y
    usual = make_support_box(body.robot, {"L": (0.0, left_y), "R": (body.step_length_m, right_y)})

    def double(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        """In the box around the left foot and the right one a step ahead."""
        step = at[STEP]
        back = ca.fmin(-feet["left"].back_m, step - feet["right"].back_m)
        front = ca.fmax(feet["left"].front_m, step + feet["right"].front_m)
        return compute_margins(Box(back=back, front=front, right=usual.right, left=usual.left), zmp, ops)

    return {"ssp": limit_to_sole(body, (0.0, left_y)), "dsp": limit_to_box(usual, double)}


def plan_cycle(body: Body, grid: Grid, objective: CycleObjective, sharing: LoadSharing) -> GaitProblem:
    """Return the problem of a walking cycle; for the options see ``gaits.nao``."""
    at_given_speed = objective != "energy-per-metre"
    goal = make_goal(body, "torque" if objective == "torque" else "power")
    cycle = make_walking_cycle(body, sharing, grid, goal, at_given_speed=at_given_speed)
    names = tuple(variable.name for variable in cycle.decisions)

    def reach(at: Point) -> MX:
        return ca.horzcat(*(phase.sample(cycle.add_step(at), Exact()).reach for phase in cycle.phases.values()))

    start = sharing.start(names, partial(draw_start, names) if at_given_speed else None)
    if not body.closed_form:
        usual = [body.narrow(variable) for variable in cycle.decisions]
        start = make_start_within_reach(usual, (SPEED,) if at_given_speed else (), reach, start)
    return make_cycle_problem(f"{body.family}-cycle", cycle, start, rows_over_time=body.closed_form, repeats=True)


def make_cycle_problem(
    name: str, cycle: WalkingCycle, start: Start | None = None, *, rows_over_time: bool, repeats: bool
) -> GaitProblem:
    """Return the problem of a cycle, perhaps with rows between samples; ``repeats``: a gait's mirror image is the next step."""
    problem = GaitProblem(
        name=name,
        title=f"{cycle.body.title}, walking cycle: least {cycle.objective.name.replace('_', ' ')}",
        variables=cycle.decisions,
        own_parameters=cycle.parameters,
        objective=cycle.objective,
        with_other_options={} if cycle.at_given_speed else {SPEED: "objective=power"},
        assemble=cycle.assemble,
        grid=cycle.phases["ssp"].grid,
        rows_over_time=cycle.rows_over_time if rows_over_time else (),
        display=Display(motion=cycle.signals, durations=tuple(TIMES.values())),
        hints=SolverHints(start=start),
    )
    return add_robot(problem, cycle.body, repeats=repeats)


def draw_start(names: Sequence[str], values: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Draw a start point within the bounds whose times give a step within its bounds, as far as their own bounds allow."""
    x = draw_uniform(names, values, rng)
    times = [names.index(time) for time in TIMES.values()]
    step = rng.uniform(values[f"{STEP}.lower"], values[f"{STEP}.upper"])
    x[times] *= step / (values[SPEED] * x[times].sum())
    return np.asarray(x)
