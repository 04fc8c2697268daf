"""NAO's walking cycle: single and double support that fit together, at least energy per metre or least power at a speed.

The published phases (Gupta, Pratihar, Deb 2023) cannot be chained: single support ends with the hip 0.03 m ahead of the stance
foot, double support starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times
and the step length are variables, and the cycle repeats after mirroring left to right.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from nlp_gait.problem import Array, GaitProblem, Grid, Objective, maker
from nlp_gait.problems.biped.phase import Phase
from nlp_gait.problems.nao.body import JOINTS, PLANNED_JOINTS, nao
from nlp_gait.problems.nao.cycle_motion import (
    TIMES,
    cycle_variables,
    double_support_planner,
    single_support_planner,
)
from nlp_gait.problems.nao.cycle_rows import (
    WalkingCycle,
    double_margins,
    joined,
    mean_margins,
    single_margins,
    start_at_speed,
)
from nlp_gait.problems.nao.double_support import TorsoShare, double_support_loads
from nlp_gait.problems.nao.motors import Motors
from nlp_gait.problems.nao.problem import goal_of, paper_parts, with_robot
from nlp_gait.problems.nao.single_support import single_support_loads

Goal = Literal["energy-per-metre", "power"]
OBJECTIVES = {
    "energy-per-metre": Objective(name="energy_per_metre", unit="J/m"),
    "power": Objective(name="power", unit="W"),
}


@maker({"samples_per_interval": 1}, {"motors": ""})
def nao_cycle(
    *,
    robot: str = "nao-v5",
    objective: Goal = "energy-per-metre",
    intervals: int = 10,
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "lever",
    samples_per_interval: int = 1,
    motors: str = "",
) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one; for the other options see ``problems.nao``.

    Args:
        robot: name or file.
        objective: ``"energy-per-metre"`` leaves the speed free; ``"power"`` is that at the speed ``speed_m_s``, a parameter: the
            step length is then no variable but speed times the time of the cycle.
        intervals: of each phase.
        rotational_inertia: False takes every link as a point mass.
        torso_share: by the lever rule the nearer foot carries more, so that the load passes from foot to foot; as printed, the
            farther one.
        samples_per_interval: above 1 for a denser grid.
        motors: what of the real motors is taken into account; the mean square of a continuous torque is that of each phase.
    """
    grid = Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
    real = Motors.parsed(motors, nao(robot, rotational_inertia))
    cycle = walking_cycle(real, torso_share, grid, at_given_speed=objective == "power")
    names = tuple(variable.name for variable in cycle.decisions)

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        return start_at_speed(names, parameters, rng)

    problem = GaitProblem(
        name="nao-cycle",
        title=f"NAO, walking cycle: least {OBJECTIVES[objective].name.replace('_', ' ')}",
        variables=cycle.decisions,
        own_parameters=cycle.parameters,
        objective=OBJECTIVES[objective],
        assemble=cycle.assemble,
        grid=grid,
        motion=lambda at: joined(cycle.signals(at)),
        start=start if cycle.at_given_speed else None,
        durations=tuple(TIMES.values()),
    )
    return with_robot(problem, robot, cycle.robot.armatures_kgm2, repeats=True)


def walking_cycle(motors: Motors, torso_share: TorsoShare, grid: Grid, *, at_given_speed: bool) -> WalkingCycle:
    """Both phases of the cycle.

    Args:
        motors: of a robot as ``nao`` makes it.
        torso_share: in double support, see ``double_support.torso_shares``.
        grid: of each phase.
        at_given_speed: the step length follows from the speed.
    """
    model = motors.model
    variables, means = cycle_variables(model), mean_margins(model)
    halves = {
        "ssp": (single_support_planner(model), single_support_loads(model), single_margins(model)),
        "dsp": (double_support_planner(model), double_support_loads(model, torso_share), double_margins(model)),
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
            parts=(*paper_parts(model, margins, means[name]), *motors.parts),
            goal=goal_of("power", motors),
        )
        for name, (plan, loads, margins) in halves.items()
    }
    return WalkingCycle(robot=model, variables=variables, phases=phases, at_given_speed=at_given_speed)
