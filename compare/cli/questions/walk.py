"""``nlp-gait walk``."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from compare.cli.command import command
from compare.cli.common import fail, progress_bar, say
from compare.cli.interrupts import until_interrupted
from compare.cli.options import AnyCycle, Seed
from compare.cli.questions.answers import Output
from compare.cli.simulation_options import DriveOptions
from nlp_gait.errors import InputError

if TYPE_CHECKING:
    from compare.questions.walk.planners import Rival


@command
def walk(
    *,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=LOW:HIGH:COUNT",
            help="Speeds (default: ten from 0.01 to 0.1 m/s, of humanoids by the root of their legs' length), or another "
            "parameter or variable; NAME=V1,V2,...",
        ),
    ] = None,
    engine: Annotated[
        bool, typer.Option("--engine", help="Play ten steps of each gait in MuJoCo (extra sim): is the model right?")
    ] = False,
    steps: Annotated[int | None, typer.Option(min=0, max=1000, help="Play this many; 0 plays none.")] = None,
    baseline: Annotated[
        list[str] | None,
        typer.Option(
            help="Planner beside the cheapest gaits, on their footsteps: cart-table, least-torque; repeatable."
        ),
    ] = None,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts where no neighbour helps.")] = 5,
    seed: Seed = 0,
    servos: DriveOptions,
    problem: AnyCycle,
    output: Output,
) -> None:
    """Cheapest walking cycle at each speed: cost of transport, and how each gait walks in a physics engine.

    The problem is nao-cycle, or humanoid-cycle, with the power as its objective; each point starts from its neighbours. Played is
    in open loop unless a feedback is named. Called again after a kill or Ctrl-C, it continues where it stopped.

    Examples: `nlp-gait walk`, `nlp-gait walk --over speed_m_s=0.02,0.04 --engine`,
    `nlp-gait walk --baseline cart-table --baseline least-torque --engine`,
    `nlp-gait walk humanoid-cycle --robot my.urdf --over speed_m_s=0.05 --baseline cart-table`,
    `nlp-gait walk --over ssp_dbm_y_mean_limit_m=0.02:0.035:4 --set speed_m_s=0.03 --steps 10`
    """
    from compare.questions.sweep.study import count_solves, parse_axis
    from compare.questions.walk.planners import checked_planners, rivals
    from compare.questions.walk.report import walk_answer
    from compare.questions.walk.study import CYCLES, default_speeds, optimal_gaits, played
    from compare.study.simulations import STEPS
    from compare.study.store import Store
    from nlp_gait.simulation.engine import load_mujoco

    drive = servos.make()
    steps = (STEPS if engine else 0) if steps is None else steps
    if steps:
        load_mujoco()  # if it is missing, say so before the work
    if problem.name not in CYCLES:
        raise InputError(f"walk takes a walking cycle, {' or '.join(CYCLES)}; got {problem.name!r}")
    spec = replace(problem, option=["objective=power", *(problem.option or ())]).make_spec(problem.name)
    own = spec.load()
    axis, planners = parse_axis(default_speeds(own) if over is None else over), checked_planners(baseline or (), own)
    store = Store(output.out, say)
    with progress_bar("solves", count_solves([axis], "ipopt")) as advance:
        gaits, stopped = until_interrupted(
            lambda: optimal_gaits(spec, axis, starts=starts, seed=seed, store=store, progress=advance),
            folder=output.out,
        )
    if steps and not stopped:
        try:
            with progress_bar("walks", len(gaits)) as advance:
                for i, gait in enumerate(gaits):
                    gaits[i] = played(spec, gait, steps, drive, store)
                    advance(f"{gait.at:g}")
        except KeyboardInterrupt:
            stopped = "interrupted while the gaits were played"
    others: list[Rival] = []
    if planners and not stopped:
        try:
            with progress_bar("planners", len(planners) * len(gaits)) as advance:
                others.extend(
                    rivals(
                        spec,
                        gaits,
                        planners,
                        starts=starts,
                        seed=seed,
                        steps=steps,
                        drive=drive,
                        store=store,
                        progress=advance,
                    )
                )
        except KeyboardInterrupt:
            stopped = "interrupted while other planners planned"
    output.take(walk_answer(spec, gaits, others), stopped, store)
    if not any(gait.found.feasible for gait in gaits):
        fail(gaits[0].found.status)
