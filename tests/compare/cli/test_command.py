"""How groups of options become the options of a command."""

import sys
from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from compare.cli import app
from compare.cli.command import command
from nlp_gait.errors import InputError

RUN = CliRunner()


@dataclass(frozen=True, kw_only=True)
class Fruit:
    name: Annotated[str, typer.Argument(metavar="FRUIT")]
    weight_g: Annotated[float, typer.Option("--weight", help="Of one piece.")] = 100.0

    def __post_init__(self) -> None:
        if self.weight_g <= 0.0:
            raise InputError(f"--weight must be positive, got {self.weight_g}")


@command
def weigh(
    *,
    count: Annotated[int, typer.Option(min=1)] = 1,
    fruit: Fruit,
    loud: bool = False,
    box: Annotated[str, typer.Option()] = "",
    labels: Annotated[list[str] | None, typer.Option("--label")] = None,
) -> None:
    """Weigh some fruit."""
    print(f"{count * fruit.weight_g:g} g of {fruit.name}" + "!" * loud)


MARKET = typer.Typer()
MARKET.command()(weigh)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ([], 2, "Missing argument 'FRUIT'"),
        (["plum", "--weight", "heavy"], 2, "Invalid value for '--weight'"),
        (["plum", "--weight", "-1"], 1, "nlp-gait: --weight must be positive, got -1.0\n"),
        (["plum", "--weight", "nan"], 1, "nlp-gait: --weight-g must be a finite number, got nan\n"),
        (
            ["plum", "--box", ""],
            1,
            "nlp-gait: --box is an empty text; give a value, or leave it out (is a shell variable",
        ),
        (["plum", "--label", "ripe", "--label", " "], 1, "nlp-gait: --label is an empty text"),
        ([""], 1, "name is an empty text"),
    ],
)
def test_a_group_refuses_as_a_command_does(arguments: list[str], status: int, words: str) -> None:
    done = RUN.invoke(MARKET, arguments)
    assert done.exit_code == status and words in done.stderr


def test_an_empty_path_is_not_the_current_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ["import", "walk12", "finals.csv", "--as", "GA", "--out", ""]
    monkeypatch.setattr(sys, "argv", ["nlp-gait", *arguments])
    assert "--out is an empty text" in RUN.invoke(app, arguments).stderr
