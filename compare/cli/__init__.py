"""Command line: ``nlp-gait COMMAND``.

Results go to stdout, progress and errors to stderr. Exit status: 0 done, 1 not done (one sentence says why), 2 wrong usage,
130 interrupted.
"""

from typing import Annotated

import typer

import nlp_gait
from compare.cli.bench import bench
from compare.cli.command import run_app
from compare.cli.compare import compare
from compare.cli.evaluate import evaluate
from compare.cli.exchange import import_results, verify
from compare.cli.export import export
from compare.cli.list import list_problems
from compare.cli.old_names import Commands
from compare.cli.questions.optima import certainty, prices, robust, sweep, variants
from compare.cli.questions.pareto import pareto
from compare.cli.report import report, reproduce
from compare.cli.simulate import simulate
from compare.cli.solve import plan, solve

PANELS = {
    "Problems, optima and searches": (list_problems, evaluate, solve, plan),
    "Comparison": (compare, import_results, report, reproduce, bench, verify),
    "Questions": (sweep, prices, pareto, certainty, variants, robust),
    "Show and share": (simulate, export),
}

app = typer.Typer(
    cls=Commands,
    help="Biped gait problems: the true optimum by IPOPT, and how far evolutionary search stops from it.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)


def _print_version(requested: bool) -> None:
    if requested:
        print(nlp_gait.__version__)
        raise typer.Exit


@app.callback()
def take_common_options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Options without a command."""


# Commands whose names are taken or not allowed in Python.
NAMES = {
    list_problems: "list",
    import_results: "import",
}
for panel, functions in PANELS.items():
    for function in functions:
        app.command(NAMES.get(function, function.__name__), rich_help_panel=panel)(function)


def main() -> None:
    """Entry point of the console script."""
    run_app(app)
