"""``nlp-gait robust``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import NaoPhase, Seed
from compare.cli.questions.output import Output


@command
def robust(
    *,
    mass: Annotated[float, typer.Option(min=0.0, max=50.0, help="Tolerance of every mass, up and down [%].")] = 5.0,
    sole: Annotated[
        float, typer.Option(min=0.0, max=20.0, help="Tolerance of the soles' position in x and y [mm].")
    ] = 2.0,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts of the nominal problem.")] = 10,
    seed: Seed = 0,
    samples: Annotated[
        int, typer.Option(min=0, max=100_000, help="Random corners on which each result is evaluated.")
    ] = 20,
    simulate: Annotated[
        bool, typer.Option(help="Simulate both gaits in MuJoCo on the worst robots (extra sim).")
    ] = True,
    problem: NaoPhase,
    output: Output,
) -> None:
    """Find the least power of a gait that keeps its limits for all masses and soles within their tolerances.

    One motion for all robots of a box, whose worst corners are found one after the other. Example: `nlp-gait robust nao-ssp`
    """
    from compare.questions.robust.robust import Robust

    effort = {"starts": starts, "seed": seed, "samples": samples}
    output.answer(Robust(problem=problem.load(), mass=mass, sole=sole, simulate=simulate, **effort))
