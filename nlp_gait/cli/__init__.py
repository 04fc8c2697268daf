"""Command line: ``nlp-gait COMMAND``.

From the problems to the comparison: ``list | evaluate | solve | search | compare | report | sweep | reproduce | walk``. From a
result to a robot: ``simulate | export | animate``. Questions past the papers: ``prices | pareto | certainty | motors | motions |
robust``.

Results go to stdout, progress and errors to stderr. Exit status: 0 done, 1 not done (one sentence says why), 2 wrong usage,
130 interrupted.
"""

from __future__ import annotations

import typer

from nlp_gait.cli.animate import animate
from nlp_gait.cli.certainty import certainty
from nlp_gait.cli.compare import compare
from nlp_gait.cli.evaluate import evaluate
from nlp_gait.cli.export import export
from nlp_gait.cli.list import list_problems
from nlp_gait.cli.motions import motions
from nlp_gait.cli.motors import motors
from nlp_gait.cli.pareto import pareto
from nlp_gait.cli.prices import prices
from nlp_gait.cli.report import report
from nlp_gait.cli.reproduce import reproduce
from nlp_gait.cli.robust import robust
from nlp_gait.cli.search import search
from nlp_gait.cli.simulate import simulate
from nlp_gait.cli.solve import solve
from nlp_gait.cli.sweep import sweep
from nlp_gait.cli.walk import walk

app = typer.Typer(
    help="Biped gait problems: the true optimum by IPOPT, and how far evolutionary search stops from it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)
app.command("list")(list_problems)
app.command("evaluate")(evaluate)
app.command("solve")(solve)
app.command("search")(search)
app.command("compare")(compare)
app.command("report")(report)
app.command("sweep")(sweep)
app.command("reproduce")(reproduce)
app.command("prices")(prices)
app.command("pareto")(pareto)
app.command("certainty")(certainty)
app.command("motions")(motions)
app.command("motors")(motors)
app.command("robust")(robust)
app.command("walk")(walk)
app.command("simulate")(simulate)
app.command("export")(export)
app.command("animate")(animate)


def main() -> None:
    """Entry point of the console script."""
    app()
