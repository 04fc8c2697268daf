"""The problem of a phase: its goal, its limits, its start points, and its robot for drawings and simulations."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Point, Signals, SolverHints, Start
from nlp_gait.formulation.display import Display, SimulationModel, Skeleton
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped import limits
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.biped.bounds import make_usual_bounds
from nlp_gait.gaits.biped.goals import HEAT_LOSS, INSTEAD, Criterion, Goal
from nlp_gait.gaits.biped.loads import make_single_support_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Loader
from nlp_gait.gaits.biped.sequence import Sequence
from nlp_gait.gaits.biped.skeleton import draw_robot
from nlp_gait.symbolic.nonsmooth import Exact

DRAWS = 50  # of a start point, at most


def make_goal(body: Body, criterion: Criterion) -> Goal:
    """Return the goal of a criterion, with the robot's motors.

    Raises InputError if the motors change the power, but something else is minimised.
    """
    motors = body.motors
    if criterion != "power" and motors.power is not None:
        raise InputError(
            f"motors={','.join(motors.features)!r} changes the power, but the objective is "
            f"{INSTEAD[criterion].objective.name}; leave out what changes it"
        )
    if criterion != "power":
        return INSTEAD[criterion]
    return Goal() if motors.power is None else Goal(power=motors.power)


def make_phase_limits(body: Body, balance: limits.BalanceMargins) -> tuple[limits.Limit, ...]:
    """Return the limits of every phase (sections 4.1 and 4.2) and of the drives."""
    size = body.torque_scale
    return (
        limits.JointLimits(body.robot, body.planned),
        limits.Reach(),
        *(() if body.closed_form else (limits.Closure(),)),
        limits.TorqueChange(size),
        *((limits.DriveLimits(body.robot, size),) if body.drive_limits else ()),
        balance,
    )


def make_phase(
    body: Body,
    kind: Support,
    balance: limits.BalanceMargins,
    loads: Loader | None,
    added_limits: tuple[limits.Limit, ...] = (),
    make: Callable[..., Phase] = Phase,
    **fields: Any,
) -> Phase:
    """Return a phase of a kind with the usual limits, others, and further fields; ``loads`` are those of double support."""
    return make(
        body=body,
        loads=make_single_support_loads(body) if loads is None or kind is Support.SINGLE else loads,
        limits=(*make_phase_limits(body, balance), *added_limits, *body.motors.limits),
        standing=kind.standing,
        **fields,
    )


def make_phase_problem(name: str, title: str, phase: Phase, *, searchable: bool = True) -> GaitProblem:
    """Return the problem of one phase, whose name and title lack the robot's; not ``searchable``, it needs gradients."""
    start = phase.start
    if not phase.body.closed_form:
        start = make_start_within_reach(phase, (), lambda point: phase.sample(point, Exact()).reach, start)
    return make_gait_problem(phase, name, title, SolverHints(start=start, searchable=searchable))


def make_gait_problem(
    gait: Phase | Sequence, name: str, title: str, hints: SolverHints, **simulated: Any
) -> GaitProblem:
    """Return the problem of a phase or a sequence of phases, whose name and title lack the robot's.

    ``simulated`` are fields of the model for simulations that are not the robot's.
    """
    body = gait.body

    def draw(signals: Signals, parameters: Mapping[str, float]) -> Skeleton:
        return draw_robot(body.full, signals)

    rotors = {name: joint.armature_kgm2 for name, joint in body.robot.joints.items()}
    joints = {
        name: replace(joint, armature_kgm2=rotors.get(name, joint.armature_kgm2))
        for name, joint in body.simulated.joints.items()
    }
    model = SimulationModel(
        robot=replace(body.simulated, joints=joints),
        gravity=body.gravity,
        slope_rad=body.slope_rad,
        heat_loss=HEAT_LOSS.name,
        **simulated,
    )
    return GaitProblem(
        name=f"{body.family}-{name}",
        title=f"{body.title} {title}",
        variables=gait.decisions,
        own_parameters=gait.parameters,
        objective=gait.objective,
        assemble=gait.assemble,
        grid=gait.grid,
        rows_over_time=gait.rows_over_time() if body.closed_form else (),
        display=Display(
            motion=gait.signals,
            durations=gait.durations,
            robot=body.full,
            skeleton=draw,
            simulation_model=model,
        ),
        hints=hints,
    )


def make_start_within_reach(
    gait: Phase | Sequence, names_read: tuple[str, ...], reach: Callable[[Point], MX], start: Start | None
) -> Start:
    """Return start points at which all knees are within reach, or the nearest of some: beyond reach there is no slope back.

    Besides the margin on the reach, the motion reads the parameters ``names_read``; ``reach`` gives the cosines of the knees at a
    point. Start points to choose from are those of ``start``, or any, within both the bounds and the usual ones.
    """
    variables = [make_usual_bounds(gait.body, variable) for variable in gait.decisions]
    read = (limits.REACH_MARGIN, *names_read)
    names = [variable.name for variable in variables]

    @cache
    def farthest() -> ca.Function:
        x, p = MX.sym("x", len(names)), MX.sym("p", len(read))
        return ca.Function("farthest", [x, p], [ca.mmax(ca.fabs(reach(Point.of(x, p, names, read))))])

    def draw(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        within = dict(parameters)
        for variable in variables:
            bounds = f"{variable.name}.lower", f"{variable.name}.upper"
            low, high = max(within[bounds[0]], variable.lower), min(within[bounds[1]], variable.upper)
            if low <= high:
                within |= zip(bounds, (low, high), strict=True)
        return draw_uniform(names, within, rng) if start is None else start(within, rng)

    def choose(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        best, least = np.zeros(0), np.inf
        for _ in range(DRAWS):
            x = draw(parameters, rng)
            cosine = float(farthest()(x, [parameters[name] for name in read]))
            if cosine < least:
                best, least = x, cosine
            if least <= 1.0 - parameters[limits.REACH_MARGIN]:
                break
        return best

    return choose
