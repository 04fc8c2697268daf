"""Options that several commands take; ``command`` explains groups of options."""

import inspect
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import Handling, ProblemSpec, Stop
from nlp_gait.errors import InputError, describe_type, unknown
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.formulation.registry import find_maker
from nlp_gait.formulation.result import load_result
from nlp_gait.user_code import allow_code, is_reference

# Default folder of results.
RESULTS = Path("results")
# Options of problems with their own flag.
FLAGS = ("robot", "intervals", "derivatives")


@dataclass(frozen=True, kw_only=True)
class StoredGait:
    """A gait in a file, and the user code that it needs."""

    result: Path
    code: list[str] | None = None

    def load(self) -> Result:
        """Return the gait; raises as ``load_result``, and InputError for code that is not a reference."""
        name_all(self.code)
        return load_result(self.result)


@dataclass(frozen=True, kw_only=True)
class CycleOptions:
    """Options and values of a walking cycle."""

    robot: str | None = None
    intervals: int | None = None
    option: list[str] | None = None
    values: list[str] | None = None
    fix: list[str] | None = None

    def make_spec(self, name: str) -> ProblemSpec:
        """Return the problem of that name with these options; raises UnknownNameError, and InputError for bad values."""
        named = ProblemSpec(name=name)
        options: dict[str, Any] = {k: value for k, value in vars(self).items() if k in FLAGS and value is not None}
        known = inspect.signature(find_maker(named.address)).parameters
        for key, text in _parse_pairs(self.option, "--option"):
            if key not in known:
                raise unknown(f"option of {name}", key, known)
            options[key] = _parse_option(key, text, known[key].default)
        named = replace(named.with_options(**options), values=parse_values(self.values, "--set"))
        fixed = named.load().fix(**parse_values(self.fix, "--fix"))
        return replace(named, values=dict(fixed.values))


@dataclass(frozen=True, kw_only=True)
class AnyCycle(CycleOptions):
    """A walking cycle, by default NAO's."""

    name: str = "nao-cycle"


@dataclass(frozen=True, kw_only=True)
class ProblemOptions(CycleOptions):
    """Options and values of any problem."""

    derivatives: str | None = None


@dataclass(frozen=True, kw_only=True)
class NamedProblem(ProblemOptions):
    """A problem by name, with its options and values."""

    name: str

    def spec(self) -> ProblemSpec:
        """Return the problem as plain data; raises as ``make_spec``."""
        return self.make_spec(self.name)

    def load(self) -> GaitProblem:
        """Return the problem; raises as ``make_spec``."""
        return self.spec().load()


@dataclass(frozen=True, kw_only=True)
class AnyProblem(ProblemOptions):
    """A problem whose name may be left out where a file determines it."""

    name: str | None = None

    def spec(self) -> ProblemSpec:
        """Return the problem; raises as ``make_spec``."""
        if self.name is None:
            raise InputError("name the problem, for example nao-ssp; it may be left out only where a file names it")
        return self.make_spec(self.name)


@dataclass(frozen=True, kw_only=True)
class NaoPhase(NamedProblem):
    """A problem, by default nao-ssp."""

    name: str = "nao-ssp"


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """Number of runs of search algorithms, constraint handling, and stop criteria."""

    runs: int = 11
    seed: int = 0
    evaluations: int = 10_000
    handling: str = "deb"
    penalty_weight: float | None = None
    target: float | None = None
    stagnation: int | None = None
    time_limit: float | None = None
    polish: bool = False

    def make_study(
        self, problems: Sequence[ProblemSpec], solvers: Sequence[SolverSpec], starts: int = 20
    ) -> StudySettings:
        """Return the study of problems by solvers; InputError unless a penalty and its weight are given together."""
        if (self.handling == "penalty") != (self.penalty_weight is not None):
            raise InputError("--handling penalty and --penalty-weight go together; no weight suits every problem")
        weight = {} if self.penalty_weight is None else {"weight": self.penalty_weight}
        return StudySettings(
            problems=tuple(problems),
            solvers=tuple(solvers),
            runs=self.runs,
            starts=starts,
            handling=Handling(name=self.handling, settings=weight),
            stop=Stop(
                evaluations=self.evaluations,
                target=self.target,
                stagnation=self.stagnation,
                time_limit_s=self.time_limit,
            ),
            seed=self.seed,
        )


def name_all(code: Sequence[str] | None) -> None:
    """Allow files of data to use this code of the user; raises InputError for a text that is not a reference."""
    for text in code or ():
        if not is_reference(text):
            raise InputError(f"--code takes FILE.py:NAME, MODULE:NAME or cmd:COMMAND, got {text!r}")
        allow_code(text, "problem")
        allow_code(text, "algorithm")


def parse_names(text: str) -> list[str]:
    """Return comma-separated names."""
    return [name.strip() for name in text.split(",") if name.strip()]


def parse_x(text: str) -> list[float]:
    """Return comma-separated numbers; raises as ``parse_number``."""
    return [parse_number("x", part, "--x") for part in text.split(",")]


def parse_values(items: Sequence[str] | None, flag: str) -> dict[str, float]:
    """Return the numbers of an option NAME=VALUE by name; raises as ``parse_number``."""
    return {name: parse_number(name, text, flag) for name, text in _parse_pairs(items, flag)}


def parse_number(name: str, text: str, flag: str) -> float:
    """Return a number; InputError if the text is not one."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{flag}: {name} must be a number, got {text!r}") from None


def _parse_pairs(items: Sequence[str] | None, flag: str) -> list[tuple[str, str]]:
    pairs = []
    for item in items or ():
        name, equals, text = item.partition("=")
        if not equals or not name:
            raise InputError(f"{flag} takes NAME=VALUE, got {item!r}")
        pairs.append((name.strip(), text.strip()))
    return pairs


def _parse_option(name: str, text: str, default: Any) -> str | int | float | bool:
    kind = type(default)
    try:
        return {"true": True, "false": False}[text.lower()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise InputError(f"--option {name} must be {describe_type(kind)}, got {text!r}") from None
