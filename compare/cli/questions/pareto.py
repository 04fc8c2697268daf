"""``nlp-gait pareto``."""

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import AsJson, NamedProblem, OutFolder, Seed
from compare.cli.questions.output import Output

SEARCHES = ["NSGA2=10000,100000", "CMOPSO=10000,100000"]


@command
def pareto(
    *,
    against: Annotated[str, typer.Option(help="dbm_y_mean or dbm_x_mean [m], or speed [m/s].")] = "dbm_y_mean",
    points: Annotated[int, typer.Option(min=5, max=10000, help="Points of the front.")] = 40,
    starts: Annotated[int, typer.Option(min=1, max=100000, help="Random starts at every third point.")] = 5,
    search: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=BUDGET,BUDGET",
            show_default=False,
            help="NSGA2 or CMOPSO; repeatable. 'none' for no search.",
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, max=100000, help="Runs of each search.")] = 11,
    seed: Seed = 0,
    problem: NamedProblem,
    out: OutFolder = Path("pareto"),
    as_json: AsJson = False,
) -> None:
    """Power against stability or speed: the true front by IPOPT, its knees, and how near NSGA-II and CMOPSO come to it.

    Examples: `nlp-gait pareto nao-ssp --search NSGA2=10000`, `nlp-gait pareto nao-ssp --against speed`
    """
    from compare.questions.pareto.pareto import Pareto, parse_searches

    output, searches = Output(out=out, as_json=as_json), parse_searches(search or SEARCHES)
    effort = {"points": points, "starts": starts, "seed": seed, "runs": runs}
    output.answer(Pareto(problem=problem.load(), against=against, searches=searches, **effort))
