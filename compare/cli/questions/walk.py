"""``nlp-gait walk``."""

from __future__ import annotations

from dataclasses import replace

from compare.cli.command import command
from compare.cli.options import AnyCycle
from compare.cli.questions.output import Output
from compare.cli.simulate import DriveOptions


@command
def walk(
    *,
    over: str | None = None,
    engine: bool = False,
    steps: int | None = None,
    baseline: list[str] | None = None,
    starts: int = 5,
    seed: int = 0,
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
