"""``nlp-gait motions``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import Seed, parse_names
from compare.cli.questions.output import Output


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
        int, typer.Option(min=0, max=100_000, help="Random starts for each order, next to the simpler optimum.")
    ] = 1,
    seed: Seed = 0,
    robot: Annotated[str, typer.Option(help="nao-v5, nao-v6, nao-v4, or a robot file.")] = "nao-v5",
    intervals: Annotated[int, typer.Option(min=1, help="Intervals of the phase.")] = 10,
    output: Output,
) -> None:
    """Solve a NAO phase with richer and richer motions: what the paper's cubics cost, and the least power of richer motions.

    Each order starts from the optimum of the one before, which it contains exactly. Free joints take minutes each.
    Rerun the command to continue after an interruption.

    Example: `nlp-gait motions nao-dsp`. One order alone: `nlp-gait solve nao-dsp --option trajectory=spline-4`
    """
    from compare.questions.motions.motion import load_phase
    from compare.questions.motions.motions import Motions

    phase, rising, free = load_phase(problem, robot, intervals), parse_names(orders), parse_names(free_orders)
    output.answer(Motions(problem=phase, orders=rising, free_orders=free, starts=starts, seed=seed))
