"""Command line: ``nlp-gait COMMAND``.

From the problems to the comparison: ``list | evaluate | solve | search | compare | report | sweep | reproduce | walk``. From a
result to a robot: ``simulate | export | animate``. Questions past the papers: ``prices | pareto | certainty | motors | motions |
robust``. To and from other packages: ``import | bench | logs | export-objective``.

Results go to stdout, progress and errors to stderr. Exit status: 0 done, 1 not done (one sentence says why), 2 wrong usage,
130 interrupted.
"""

from __future__ import annotations

import typer

from compare.cli.animate import animate
from compare.cli.compare import compare
from compare.cli.evaluate import evaluate
from compare.cli.exchange.bench import bench
from compare.cli.exchange.export_objective import export_objective
from compare.cli.exchange.import_results import import_results
from compare.cli.exchange.logs import logs
from compare.cli.export import export
from compare.cli.list import list_problems
from compare.cli.questions.certainty import certainty
from compare.cli.questions.motions import motions
from compare.cli.questions.motors import motors
from compare.cli.questions.pareto import pareto
from compare.cli.questions.prices import prices
from compare.cli.questions.robust import robust
from compare.cli.questions.sweep import sweep
from compare.cli.questions.walk import walk
from compare.cli.report import report
from compare.cli.reproduce import reproduce
from compare.cli.search import search
from compare.cli.simulate import simulate
from compare.cli.solve import solve

COMPARISON = (evaluate, solve, search, compare, report, sweep, reproduce)
QUESTIONS = (prices, pareto, certainty, motions, motors, robust, walk)
ROBOT = (simulate, export, animate)
EXCHANGE = (bench, logs, export_objective)

app = typer.Typer(
    help="Biped gait problems: the true optimum by IPOPT, and how far evolutionary search stops from it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)
app.command("list")(list_problems)
app.command("import")(import_results)
for function in (*COMPARISON, *QUESTIONS, *ROBOT, *EXCHANGE):
    app.command(function.__name__.replace("_", "-"))(function)


def main() -> None:
    """Entry point of the console script."""
    app()
