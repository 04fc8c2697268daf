"""How groups of options become the options of a command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from compare.cli import app, load_command
from compare.cli.command import command
from nlp_gait.errors import InputError

RUN = CliRunner()
SHARED = ("--robot", "--set")
# Commands that build any problem.
OF_A_PROBLEM = (
    "evaluate",
    "solve",
    "compare",
    "sweep",
    "prices",
    "pareto",
    "certainty",
    "variants",
    "robust",
)


@dataclass(frozen=True, kw_only=True)
class Fruit:
    name: Annotated[str, typer.Argument(metavar="FRUIT")]
    weight_g: Annotated[float, typer.Option("--weight", help="Of one piece.")] = 100.0

    def __post_init__(self) -> None:
        if self.weight_g <= 0.0:
            raise InputError(f"--weight must be positive, got {self.weight_g}")


@command
def weigh(*, count: Annotated[int, typer.Option(min=1)] = 1, fruit: Fruit, loud: bool = False) -> None:
    """Weigh some fruit."""
    print(f"{count * fruit.weight_g:g} g of {fruit.name}" + "!" * loud)


MARKET = typer.Typer()
MARKET.command()(weigh)


def test_a_group_comes_as_one_object_from_its_own_options() -> None:
    assert RUN.invoke(MARKET, ["apple"]).stdout == "100 g of apple\n"
    assert RUN.invoke(MARKET, ["--loud", "--weight", "20", "plum", "--count", "3"]).stdout == "60 g of plum!\n"


def test_help_names_the_options_of_a_group_in_their_place() -> None:
    shown = RUN.invoke(MARKET, ["--help"], env={"COLUMNS": "200"}).stdout
    places = [
        shown.index(word) for word in ("FRUIT", "Weigh some fruit.", "--count", "--weight", "Of one piece.", "--loud")
    ]
    assert places == sorted(places) and "--fruit" not in shown


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ([], 2, "Missing argument 'FRUIT'"),
        (["plum", "--weight", "heavy"], 2, "Invalid value for '--weight'"),
        (["plum", "--weight", "-1"], 1, "nlp-gait: --weight must be positive, got -1.0\n"),
        (["plum", "--weight", "nan"], 1, "nlp-gait: --weight-g must be a finite number, got nan\n"),
    ],
)
def test_a_group_refuses_as_a_command_does(arguments: list[str], status: int, words: str) -> None:
    done = RUN.invoke(MARKET, arguments)
    assert done.exit_code == status and words in done.stderr


@pytest.mark.parametrize("name", OF_A_PROBLEM)
def test_every_command_that_builds_any_problem_takes_the_same_options(name: str) -> None:
    options = {parameter.opts[0]: parameter for parameter in load_command(name).params}
    known = {parameter.opts[0]: parameter for parameter in load_command("solve").params}
    assert [options[option].help for option in SHARED] == [known[option].help for option in SHARED]


@pytest.mark.parametrize(
    ("problem", "intervals"), [("nao-ssp", 10), ("walk12", 20), ("stairs-plan", 40), ("stairs-ideal", 70)]
)
def test_help_names_the_page_with_the_number_of_intervals(problem: str, intervals: int) -> None:
    assert "see nlp-gait list PROBLEM" in RUN.invoke(app, ["solve", "--help"], env={"COLUMNS": "200"}).stdout
    assert f"intervals={intervals}" in RUN.invoke(app, ["list", problem]).stdout
