"""Options that several commands take; ``command`` explains groups of options."""

import inspect
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from compare.cli.command import OUTPUT
from compare.study.run import ProblemSpec
from nlp_gait.errors import InputError, describe_type, unknown
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import find_maker
from nlp_gait.user_code import allow_code, is_reference

LARGEST = sys.float_info.max
RESULTS = Path("results")  # default folder
Starts = Annotated[int, Option(min=1, max=100000)]
Runs = Annotated[int, Option(min=1, max=100000)]
Seed = Annotated[int, Option(min=0)]
Evaluations = Annotated[int, Option(min=1, max=10**12)]
Jobs = Annotated[int | None, Option(min=1, max=4096)]
Scheduler = Annotated[str | None, Option(metavar="ADDRESS")]
OutFolder = Annotated[Path, OUTPUT]
Code = Annotated[list[str] | None, Option(metavar="FILE.py:NAME")]
ProblemName = Annotated[str, Argument(metavar="PROBLEM")]
Robot = str | None
Values = Annotated[list[str] | None, Option("--set", metavar="NAME=VALUE")]
Limits = Annotated[list[str] | None, Option("--limit", metavar="NAME")]


@dataclass(frozen=True, kw_only=True)
class ProblemOptions:
    """Robot, options and values of a problem."""

    robot: Robot = None
    values: Values = None
    limits: Limits = None

    def make_spec(self, name: str) -> ProblemSpec:
        """Return the problem of that name with these values; raises UnknownNameError, and InputError for bad values."""
        spec, given = ProblemSpec(name=name), dict(parse_pairs(self.values, "--set"))
        maker_options = inspect.signature(find_maker(spec.load_name)).parameters
        options = parse_options(spec.load_name, [(key, text) for key, text in given.items() if key in maker_options])
        if self.robot is not None:
            options["robot"] = self.robot
        if self.limits:
            if "limits" not in maker_options:
                raise InputError(f"{name} takes no limits, those of NAO and of humanoids do; leave out --limit")
            options |= parse_options(spec.load_name, [("limits", ",".join(self.limits))])
        spec = spec.with_options(**options)
        problem = spec.load()
        numbers = {key: parse_number(key, text, "--set") for key, text in given.items() if key not in maker_options}
        fixed = {key: numbers.pop(key) for key in problem.names if key in numbers}
        return replace(spec, values=dict(problem.with_values(**numbers).fix(**fixed).values))


@dataclass(frozen=True, kw_only=True)
class NamedProblem(ProblemOptions):
    """A problem by name, with its options and values."""

    name: ProblemName

    def spec(self) -> ProblemSpec:
        """Return the problem as plain data; raises as ``make_spec``."""
        return self.make_spec(self.name)

    def load(self) -> GaitProblem:
        """Return the problem; raises as ``make_spec``."""
        return self.spec().load()


def name_all(code: Sequence[str] | None) -> None:
    """Allow files of data to use this code of the user; raises InputError for a text that is not a reference."""
    for text in code or ():
        if not is_reference(text):
            raise InputError(f"--code takes FILE.py:NAME, MODULE:NAME or cmd:COMMAND, got {text!r}")
        allow_code(text)


def parse_names(text: str) -> list[str]:
    """Return comma-separated names."""
    return [name.strip() for name in text.split(",") if name.strip()]


def parse_numbers(name: str, text: str, flag: str, *, least: float = -LARGEST, most: float = LARGEST) -> list[float]:
    """Return comma-separated numbers; raises as ``parse_number``."""
    return [parse_number(name, word, flag, least=least, most=most) for word in text.split(",")]


def parse_number(name: str, text: str, flag: str, *, least: float = -LARGEST, most: float = LARGEST) -> float:
    """Return a finite number within its limits; InputError if the text is not one."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:  # NaN fails too
        limits = "" if most == LARGEST and least == -LARGEST else f" from {least:g} to {most:g}"
        raise InputError(f"{flag}: {name} must be a finite number{limits}, got {text!r}")
    return value


def parse_pairs(items: Sequence[str] | None, flag: str) -> list[tuple[str, str]]:
    """Return names and values of texts NAME=VALUE; raises InputError for another text."""
    pairs = []
    for item in items or ():
        name, equals, text = item.partition("=")
        if not equals or not name:
            raise InputError(f"{flag} takes NAME=VALUE, got {item!r}")
        pairs.append((name.strip(), text.strip()))
    return pairs


def parse_options(problem: str, pairs: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return options of a problem from names and texts; raises UnknownNameError, and InputError for a bad value."""
    parameters, options = inspect.signature(find_maker(problem)).parameters, {}
    for name, text in pairs:
        if name not in parameters:
            raise unknown(f"option of {problem}", name, parameters)
        kind = type(parameters[name].default)
        try:
            options[name] = {"true": True, "false": False}[text.lower()] if kind is bool else kind(text)
        except (KeyError, ValueError):
            raise InputError(f"option {name} must be {describe_type(kind)}, got {text!r}") from None
    return options
