"""``nlp-gait pareto``."""

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import AsJson, NamedProblem, OutFolder, Seed
from compare.cli.questions.output import Output
from nlp_gait.errors import InputError

SEARCHES = ["NSGA2=10000,100000", "CMOPSO=10000,100000"]


@command
def pareto(
    *,
    objectives: Annotated[
        str,
        typer.Option(
            help="power [W] and one or two of dbm_y_mean, dbm_x_mean, dbm_y_min, dbm_x_min [m] and "
            "speed [m/s], separated by commas."
        ),
    ] = "power,dbm_y_mean",
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

    With three objectives the front is a surface, without searches.

    Examples: `nlp-gait pareto nao-ssp --search NSGA2=10000`, `nlp-gait pareto nao-ssp --objectives power,dbm_y_mean,speed`
    """
    from compare.questions.pareto.competing import parse_objectives
    from compare.questions.pareto.pareto_front import ParetoFront, parse_searches
    from compare.questions.pareto.pareto_surface import ParetoSurface

    names, output = parse_objectives(objectives), Output(out=out, as_json=as_json)
    searches = parse_searches(search or SEARCHES)
    effort = {"points": points, "starts": starts, "seed": seed}
    if len(names) == 1:
        (name,) = names
        output.answer(ParetoFront(problem=problem.load(), objective=name, searches=searches, runs=runs, **effort))
        return
    if search and searches:
        raise InputError("three objectives are traded without searches; leave out --search")
    output.answer(ParetoSurface(problem=problem.load(), objectives=(names[0], names[1]), **effort))
