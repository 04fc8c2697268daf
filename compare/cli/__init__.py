"""Command line: ``nlp-gait COMMAND``.

Results go to stdout, progress and errors to stderr. Exit status: 0 done, 1 not done (one sentence says why), 2 wrong usage,
130 interrupted. Only the module of the command that is called is imported.
"""

from functools import cache
from typing import Annotated, Any

import typer
from typer.core import TyperCommand
from typer.main import get_command

from nlp_gait.providers import import_object

# By panel of the help: each command's function, and one line about it.
PANELS = {
    "Problems, optima and searches": {
        "list": ("list:list_problems", "List problems, algorithms and robots, or describe one."),
        "evaluate": ("evaluate:evaluate", "Judge candidates by the exact functions."),
        "solve": ("solve:solve", "Solve a problem by IPOPT or SLSQP."),
        "plan": ("solve:plan", "Plan a whole walk from standing to standing."),
    },
    "Comparison": {
        "compare": ("compare:compare", "Compare searches and IPOPT."),
        "import": ("exchange:import_results", "Add results of other programs to a study."),
        "report": ("report:report", "Write a study's report again."),
        "reproduce": ("report:reproduce", "Recompute a paper's tables, figures and claims."),
        "bench": ("bench:bench", "Rank an algorithm on GaitBench."),
        "verify": ("exchange:verify", "Check a study or its archive, or pack it."),
    },
    "Questions": {
        "sweep": ("questions:sweep", "Solve a problem over a grid of values."),
        "tune": ("questions:tune", "Tune a gait in the physics engine, beside IPOPT."),
        "prices": ("questions:prices", "What each limit and each error of the robot costs."),
        "pareto": ("questions:pareto", "Power against stability or speed."),
        "certainty": ("questions:certainty", "Is the best known optimum the global one?"),
    },
    "Show and share": {
        "simulate": ("simulate:simulate", "Simulate a gait in MuJoCo."),
        "export": ("exchange:export", "Write a gait, an instance or a problem for others."),
    },
}


@cache
def load_command(name: str) -> Any:
    """Import a command and return its parser."""
    places = {name: place for commands in PANELS.values() for name, (place, _) in commands.items()}
    alone = typer.Typer(add_completion=False, rich_markup_mode="markdown")
    alone.command(name)(import_object(f"compare.cli.{places[name]}"))
    return get_command(alone)


class ImportedWhenUsed(TyperCommand):
    """A command whose module is imported when its options are needed; the list of commands needs its summary alone."""

    @property
    def params(self) -> list[Any]:
        """Its arguments and options."""
        return load_command(str(self.name)).params

    @params.setter
    def params(self, _: object) -> None:
        """Ignore those of the function in its place, which has none."""

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Parse the arguments by the command's own parser."""
        return load_command(str(self.name)).make_context(info_name, args, parent, **extra)


app = typer.Typer(
    help="Biped gait problems: the true optimum by IPOPT, and how far evolutionary search stops from it.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)
for panel, commands in PANELS.items():
    for name, (_, summary) in commands.items():
        app.command(name, cls=ImportedWhenUsed, rich_help_panel=panel, short_help=summary)(lambda: None)


def _print_version(requested: bool) -> None:
    if requested:
        import nlp_gait

        print(nlp_gait.__version__)
        raise typer.Exit


@app.callback()
def take_common_options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Options without a command."""


def main() -> None:
    """Entry point of the console script."""
    from compare.cli.command import run_app

    run_app(app)
