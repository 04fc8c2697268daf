"""What every problem of one phase is made of: its goal, and the problem around it."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from nlp_gait.errors import InputError
from nlp_gait.formulation import Assembly, Display, GaitProblem, Parameter, Point, SolverHints, Start
from nlp_gait.gaits.biped.goals import HEAT_LOSS, INSTEAD, Goal
from nlp_gait.gaits.biped.motors import Motors
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.symbolic.nonsmooth import Nonsmooth

Criterion = Literal["power", "jerk", "torque", "torque-smoothness"]


def goal_of(criterion: Criterion, motors: Motors, heat: Parameter = HEAT_LOSS) -> Goal:
    """What is minimised, with the heat constant of a robot.

    Raises:
        InputError: the motors change the power, but something else is minimised.
    """
    if criterion != "power" and motors.draw is not None:
        raise InputError(
            f"motors={','.join(motors.features)!r} changes the power, but the objective is "
            f"{INSTEAD[criterion].objective.name}; leave out what changes it"
        )
    if criterion != "power":
        return replace(INSTEAD[criterion], heat=heat)
    return Goal(heat=heat) if motors.draw is None else Goal(heat=heat, draw=motors.draw)


def problem_of(
    name: str,
    title: str,
    phase: Phase,
    *,
    start: Start | None = None,
    searchable: bool = True,
) -> GaitProblem:
    """Problem of one phase, without what drawing and playing need.

    Args:
        name: of the problem.
        title: one line.
        phase: with its parts and its goal.
        start: start point; None for one within the bounds.
        searchable: False for a problem that only gradient methods can solve.
    """

    def assemble(at: Point, ops: Nonsmooth) -> Assembly:
        return phase.assemble(at, phase.samples(at, ops), ops)

    return GaitProblem(
        name=name,
        title=title,
        variables=phase.variables,
        own_parameters=phase.parameters,
        objective=phase.goal.objective,
        assemble=assemble,
        grid=phase.grid,
        display=Display(motion=phase.signals, durations=(phase.duration,)),
        hints=SolverHints(start=start, searchable=searchable),
    )
