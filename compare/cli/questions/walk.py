"""``nlp-gait walk``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import AnyCycle, Seed
from compare.cli.questions.output import Output
from compare.cli.simulation_options import DriveOptions


@command
def walk(
    *,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=LOW:HIGH:COUNT",
            help="Speeds (default: ten from 0.01 to 0.1 m/s, for humanoids in proportion to the root of their leg length), or "
            "another parameter or variable; NAME=V1,V2,...",
        ),
    ] = None,
    engine: Annotated[
        bool, typer.Option("--engine", help="Simulate ten steps of each gait in MuJoCo (extra sim).")
    ] = False,
    steps: Annotated[int | None, typer.Option(min=0, max=1000, help="Simulate so many steps; 0 for none.")] = None,
    baseline: Annotated[
        list[str] | None,
        typer.Option(help="Planner to compare with, on the same footsteps: cart-table, least-torque; repeatable."),
    ] = None,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts where no neighbour helps.")] = 5,
    seed: Seed = 0,
    drives: DriveOptions,
    problem: AnyCycle,
    output: Output,
) -> None:
    """Find the cheapest walking cycle at each speed: its cost of transport, and its simulation in a physics engine.

    The problem is nao-cycle, or humanoid-cycle, with the power as its objective; each point starts from its neighbours.
    Simulations are open loop unless a feedback is named. Rerun the command to continue after an interruption.

    Examples: `nlp-gait walk`, `nlp-gait walk --over speed_m_s=0.02,0.04 --engine`,
    `nlp-gait walk --baseline cart-table --baseline least-torque --engine`,
    `nlp-gait walk humanoid-cycle --robot my.urdf --over speed_m_s=0.05 --baseline cart-table`,
    `nlp-gait walk --over ssp_dbm_y_mean_limit_m=0.02:0.035:4 --set speed_m_s=0.03 --steps 10`
    """
    from compare.questions.sweep import parse_axis
    from compare.questions.walk.walk import CheapestWalk, check_cycle, default_speeds
    from compare.study.simulations import STEPS

    check_cycle(problem.name)
    cycle = replace(problem, option=["objective=power", *(problem.option or ())]).make_spec(problem.name).load()
    output.answer(
        CheapestWalk(
            problem=cycle,
            axis=parse_axis(over or default_speeds(cycle)),
            starts=starts,
            seed=seed,
            steps=(STEPS if engine else 0) if steps is None else steps,
            drive=drives.make(),
            planners=baseline or (),
        )
    )
