"""What every problem of one NAO phase is made of: its parts, its goal, and the problem around them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.problem import Array, Assembly, GaitProblem, Playback, Point
from nlp_gait.problems.biped.goals import HEAT_LOSS, INSTEAD, Goal
from nlp_gait.problems.biped.parts import BalanceMargins, JointLimits, Margins, Part, Reach, TorqueChange
from nlp_gait.problems.biped.phase import Phase
from nlp_gait.problems.nao.body import GRAVITY, PLANNED_JOINTS, nao
from nlp_gait.problems.nao.motors import Motors
from nlp_gait.problems.nao.skeleton import skeleton
from nlp_gait.robots import Robot, load_robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

Criterion = Literal["power", "jerk", "torque", "torque-smoothness"]


def paper_parts(robot: Robot, margins: Margins, mean_limits_m: tuple[float, float]) -> tuple[Part, ...]:
    """Limits of both published phases (Gupta, Pratihar, Deb 2023, sections 4.1 and 4.2)."""
    return (JointLimits(robot, PLANNED_JOINTS), Reach(), TorqueChange(), BalanceMargins(margins, mean_limits_m))


def goal_of(criterion: Criterion, motors: Motors) -> Goal:
    """What is minimised.

    Raises:
        InputError: the motors change the power, but something else is minimised.
    """
    if criterion != "power" and motors.draw is not None:
        raise InputError(
            f"motors={','.join(motors.features)!r} changes the power, but the objective is "
            f"{INSTEAD[criterion].objective.name}; leave out what changes it"
        )
    if criterion != "power":
        return INSTEAD[criterion]
    return Goal() if motors.draw is None else Goal(draw=motors.draw)


def phase_problem(
    name: str,
    title: str,
    phase: Phase,
    robot: str,
    *,
    start: Callable[[Mapping[str, float], np.random.Generator], Array] | None = None,
    searchable: bool = True,
    long_derivatives: bool = False,
) -> GaitProblem:
    """Problem of one phase.

    Args:
        name: of the problem.
        title: one line.
        phase: with its parts and its goal.
        robot: name or file of the robot, with all its joints.
        start: start point; None for one within the bounds.
        searchable: False for a problem that only gradient methods can solve.
        long_derivatives: True where one solve pays for compiling its derivatives.
    """

    def assemble(at: Point, ops: Nonsmooth) -> Assembly:
        return phase.assemble(at, phase.samples(at, ops), ops)

    problem = GaitProblem(
        name=name,
        title=title,
        variables=phase.variables,
        own_parameters=phase.parameters,
        objective=phase.goal.objective,
        assemble=assemble,
        grid=phase.grid,
        motion=phase.signals,
        start=start,
        durations=(phase.duration,),
        stretches=phase.stretch(),
        searchable=searchable,
        long_derivatives=long_derivatives,
    )
    return with_robot(problem, robot, phase.robot.armatures_kgm2)


def with_robot(
    problem: GaitProblem, robot: str, armatures_kgm2: Mapping[str, float], *, repeats: bool = False
) -> GaitProblem:
    """The problem with what drawing and playing its gaits need of a robot.

    Args:
        problem: without.
        robot: name or file, with all its joints.
        armatures_kgm2: by joint, the inertia of rotors that the gait was planned with: it is played with the same.
        repeats: a gait is one step, whose mirror image is the next one.
    """
    full = load_robot(robot)
    played = replace(nao(robot, rotational_inertia=True), armatures_kgm2=armatures_kgm2)
    playback = Playback(robot=played, gravity=GRAVITY, heat_loss=HEAT_LOSS.name, repeats=repeats)
    return replace(problem, robot=full, skeleton=skeleton(full), playback=playback)
