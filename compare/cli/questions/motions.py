"""``nlp-gait motions``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import fail, progress_bar, say
from compare.cli.interrupts import interruptible
from compare.cli.options import Seed, parse_names
from compare.cli.questions.answers import Output


@command
def motions(
    *,
    problem: Annotated[str, typer.Argument(metavar="[nao-ssp|nao-dsp]")] = "nao-ssp",
    orders: Annotated[
        str, typer.Option(help="Motions of hip, foot and arms, separated by commas.")
    ] = "cubic,quintic,spline-2,spline-4,spline-8",
    free_orders: Annotated[
        str, typer.Option(help="Motions of free joints, separated by commas; empty for none.")
    ] = "spline-2,spline-4,spline-8,spline-16",
    starts: Annotated[
        int, typer.Option(min=0, max=100_000, help="Random starts for each order, beside the simpler optimum.")
    ] = 1,
    seed: Seed = 0,
    robot: Annotated[str, typer.Option(help="nao-v5, nao-v6, nao-v4, or a robot file.")] = "nao-v5",
    output: Output,
) -> None:
    """Solve a NAO phase with richer and richer motions: what the paper's cubics cost, and the floor below them.

    Each order starts from the optimum of the one before, which it contains exactly. Free joints take minutes each;
    called again, it continues where it stopped.

    Example: `nlp-gait motions nao-dsp`. One order alone: `nlp-gait solve nao-dsp --option trajectory=spline-4`
    """
    from compare.questions.motions.report import motions_answer
    from compare.questions.motions.study import motions as run
    from compare.questions.motions.tasks import tasks
    from compare.study.store import Store

    study = tasks(problem, orders=parse_names(orders), free_orders=parse_names(free_orders), robot=robot, starts=starts)
    store = Store(output.out, say)
    with interruptible(output.out), progress_bar("motions", len(study)) as advance:
        found = run(study, seed=seed, store=store, progress=advance)
    output.take(motions_answer(found, problem), store=store)
    failed = [motion for motion in found if not motion.success]
    if failed:
        fail("; ".join(f"{motion.task.label}: {motion.status}" for motion in failed))
