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
from compare.cli.questions.optima import certainty, pareto, prices, robust, sweep, variants
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
# One line each, so that the help fits one screen.
SUMMARIES = {
    "list": "List problems, algorithms and robots, or describe one.",
    "evaluate": "Judge candidates by the exact functions.",
    "solve": "Solve a problem by IPOPT or SLSQP.",
    "plan": "Plan a whole walk from standing to standing.",
    "compare": "Compare searches and IPOPT.",
    "import": "Add results of other programs to a study.",
    "report": "Write a study's report again.",
    "reproduce": "Recompute a paper's tables, figures and claims.",
    "bench": "Rank an algorithm on GaitBench.",
    "verify": "Check a study or its archive, or pack it.",
    "sweep": "Solve a problem over a grid of values.",
    "prices": "What each limit and each error of the robot costs.",
    "pareto": "Power against stability or speed.",
    "certainty": "Is the best known optimum the global one?",
    "variants": "What changes with motors, motions or options.",
    "robust": "One gait for all masses and soles within tolerances.",
    "simulate": "Simulate a gait in MuJoCo.",
    "export": "Write a gait, an instance or a problem for others.",
}
for panel, functions in PANELS.items():
    for function in functions:
        name = NAMES.get(function, function.__name__)
        app.command(name, rich_help_panel=panel, short_help=SUMMARIES[name])(function)


def main() -> None:
    """Entry point of the console script."""
    run_app(app)
