"""NAO's walking cycle: single and double support that fit together, at least energy per metre or least power at a speed.

The published phases (Gupta, Pratihar, Deb 2023) cannot be chained: single support ends with the hip 0.03 m ahead of the stance
foot, double support starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times
and the step length are variables, and the cycle repeats after mirroring left to right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from nlp_gait.formulation import Array, GaitProblem, Grid, Variable, maker
from nlp_gait.gaits.biped.curves import grid_for
from nlp_gait.gaits.biped.cycle import CycleGoal, WalkingCycle, cycle_problem, start_at_speed
from nlp_gait.gaits.biped.cycle_motion import TIMES
from nlp_gait.gaits.biped.double_support import LOAD_DEGREE, Sharing, TorsoShare
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.motors import Motors
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.problem import goal_of
from nlp_gait.gaits.nao.body import GRAVITY, JOINTS, PLANNED_JOINTS, nao
from nlp_gait.gaits.nao.cycle.motion import double_support_planner, nao_cycle_variables, single_support_planner
from nlp_gait.gaits.nao.cycle.rows import double_margins, mean_margins, single_margins
from nlp_gait.gaits.nao.double_support import standing
from nlp_gait.gaits.nao.motors import nao_motors
from nlp_gait.gaits.nao.problem import paper_parts, with_robot
from nlp_gait.gaits.nao.single_support import single_support_loads
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import partner


@maker
def nao_cycle(
    *,
    robot: str = "nao-v5",
    objective: CycleGoal = "energy-per-metre",
    intervals: int = 10,
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "lever",
    samples_per_interval: int = 0,
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one; for the other options see ``gaits.nao``.

    Args:
        robot: name or file.
        objective: ``"energy-per-metre"`` leaves the speed free; ``"power"``, and ``"torque"`` for the mean of the sum of squared
            torques, are those at the speed ``speed_m_s``, a parameter: the step length is then no variable but speed times the
            time of the cycle.
        intervals: of each phase.
        rotational_inertia: False takes every link as a point mass.
        torso_share: by the lever rule the nearer foot carries more, so that the load passes from foot to foot; as printed, the
            farther one; free plans the load of the foot that has landed.
        samples_per_interval: above 1 for a denser grid; 0 for what suits the loads: 4 where they are planned, else 1.
        motors: what of the real motors is taken into account; the mean square of a continuous torque is that of each phase.
        load_degree: of the planned wrench over double support.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walking cycle by this package.
    """
    grid = grid_for("cubic", intervals, samples_per_interval, planned_loads=torso_share == "free")
    real, at_given_speed = nao_motors(motors, nao(robot, rotational_inertia)), objective != "energy-per-metre"
    sharing = standing(real.model).sharing(torso_share, load_degree)
    goal = goal_of("torque" if objective == "torque" else "power", real)
    cycle = walking_cycle(real, sharing, grid, goal, at_given_speed=at_given_speed)
    names = tuple(variable.name for variable in cycle.decisions)

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        return start_at_speed(names, parameters, rng)

    problem = cycle_problem("nao-cycle", "NAO", cycle, sharing.start_of(names, start if at_given_speed else None))
    return with_robot(
        replace(problem, rows_over_time=cycle.rows_over_time), robot, cycle.robot.armatures_kgm2, repeats=True
    )


def walking_cycle(motors: Motors, sharing: Sharing, grid: Grid, goal: Goal, *, at_given_speed: bool) -> WalkingCycle:
    """Both phases of the cycle.

    Args:
        motors: of a robot as ``nao`` makes it.
        sharing: of load in double support, see ``biped.double_support``.
        grid: of each phase.
        goal: of each phase; the cycle's is their mean over time, or energy per metre.
        at_given_speed: the step length follows from the speed.
    """
    model = motors.model
    *motion, step = nao_cycle_variables(model)
    variables, means = (*motion, *sharing.variables, step), mean_margins(model)
    double = sharing.planned(double_support_planner(model))
    halves = {
        "ssp": (single_support_planner(model), single_support_loads(model), single_margins(model), ()),
        "dsp": (double, sharing.loads, double_margins(model), sharing.parts),
    }
    phases = {
        name: Phase(
            robot=model,
            joints=JOINTS,
            planned=PLANNED_JOINTS,
            variables=variables,
            duration=TIMES[name],
            plan=plan,
            loads=loads,
            grid=grid,
            parts=(*paper_parts(model, margins, means[name]), *motors.parts, *more),
            goal=goal,
        )
        for name, (plan, loads, margins, more) in halves.items()
    }
    return nao_cycle_of(model, variables, phases, at_given_speed=at_given_speed)


def nao_cycle_of(
    model: Robot, variables: tuple[Variable, ...], phases: Mapping[str, Phase], *, at_given_speed: bool
) -> WalkingCycle:
    """A cycle of NAO from both phases; see ``WalkingCycle``."""
    return WalkingCycle(
        robot=model,
        images=tuple(map(partner, JOINTS)),
        gravity=GRAVITY,
        variables=variables,
        phases=phases,
        at_given_speed=at_given_speed,
    )
