"""NAO's walking cycle: single and double support that fit together, at least energy per metre or least power at a speed.

The published phases (Gupta, Pratihar, Deb 2023) cannot be chained: single support ends with the hip 0.03 m ahead of the stance
foot, double support starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times
and the step length are variables, and the cycle repeats after mirroring left to right.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Array, GaitProblem, Objective, Signals
from nlp_gait.problems.nao.body import nao
from nlp_gait.problems.nao.cycle_motion import (
    TIMES,
    cycle_variables,
    double_support_planner,
    single_support_planner,
)
from nlp_gait.problems.nao.cycle_rows import WalkingCycle, joined, start_at_speed
from nlp_gait.problems.nao.double_support import TorsoShare, double_support_loads
from nlp_gait.problems.nao.phase import Phase
from nlp_gait.problems.nao.single_support import single_support_loads

Goal = Literal["energy-per-metre", "power"]
OBJECTIVES = {
    "energy-per-metre": Objective(name="energy_per_metre", unit="J/m"),
    "power": Objective(name="power", unit="W"),
}


def nao_cycle(
    *,
    robot: str = "nao-v5",
    objective: Goal = "energy-per-metre",
    intervals: int = 10,
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "lever",
    samples_per_interval: int = 1,
) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one.

    Args:
        robot: name or file of the robot.
        objective: ``"energy-per-metre"`` leaves the speed free; ``"power"`` is that at the speed ``speed_m_s``, a parameter: the
            step length is then no variable but speed times the time of the cycle.
        intervals: equal parts of each phase over which torques may change by the limit.
        rotational_inertia: False takes every link as a point mass, in torques and ZMP.
        torso_share: how the torso's mass is shared between the legs in double support (see ``nao_dsp.torso_shares``). By the
            lever rule the nearer foot carries more, so that the load passes from foot to foot; as printed, the farther one.
        samples_per_interval: above 1 for a grid that is denser than the intervals.
    """
    options: dict[str, str | int | bool] = {
        "robot": robot,
        "objective": objective,
        "intervals": intervals,
        "rotational_inertia": rotational_inertia,
        "torso_share": torso_share,
    }
    cycle = walking_cycle(**options, samples_per_interval=samples_per_interval)  # type: ignore[arg-type]

    def refine(factor: int) -> GaitProblem:
        return nao_cycle(**options, samples_per_interval=samples_per_interval * factor)  # type: ignore[arg-type]

    def signals(x: Array, p: Array) -> Signals:
        return joined(cycle.signals(problem.symbols(), x, p))

    def start(p: Array, rng: np.random.Generator) -> Array:
        names = (parameter.name for parameter in problem.parameters)
        return start_at_speed(problem.names, dict(zip(names, p.tolist(), strict=True)), rng)

    problem = GaitProblem(
        name="nao-cycle",
        title=f"NAO, walking cycle: least {OBJECTIVES[objective].name.replace('_', ' ')}",
        options=options,
        variables=cycle.decisions,
        own_parameters=cycle.parameters,
        objective=OBJECTIVES[objective],
        assemble=cycle.assemble,
        refine=refine,
        signals=signals,
        start=start if cycle.at_given_speed else None,
    )
    return problem


def walking_cycle(
    *,
    robot: str,
    objective: Goal,
    intervals: int,
    rotational_inertia: bool,
    torso_share: TorsoShare,
    samples_per_interval: int = 1,
) -> WalkingCycle:
    """Both phases of the cycle; arguments as those of ``nao_cycle``."""
    if objective not in OBJECTIVES:
        raise InputError(f"objective must be one of {', '.join(OBJECTIVES)}, got {objective!r}")
    if torso_share not in get_args(TorsoShare):
        raise InputError(f"torso_share must be one of {', '.join(get_args(TorsoShare))}, got {torso_share!r}")
    model = nao(robot, rotational_inertia)
    variables = cycle_variables(model)
    halves = {
        "ssp": (single_support_planner(model), single_support_loads(model)),
        "dsp": (double_support_planner(model), double_support_loads(model, torso_share)),
    }
    phases = {
        name: Phase(
            robot=model,
            variables=len(variables),
            duration=TIMES[name],
            plan=plan,
            loads=loads,
            intervals=intervals,
            samples_per_interval=samples_per_interval,
            derivatives="analytic",
        )
        for name, (plan, loads) in halves.items()
    }
    return WalkingCycle(robot=model, variables=variables, phases=phases, at_given_speed=objective == "power")
