"""A study as plain settings: of a command line, a TOML file, or an earlier session's folder."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from compare.study.task import GRADIENT_SOLVERS, IPOPT, Handling, ProblemSpec, Stop, Task
from nlp_gait.errors import InputError, kind_name, unknown
from nlp_gait.files import check_plain, read_text

SCHEMA = 1  # of study files, which need not state it
LARGEST_FILE = 2**17  # bytes; a study has some hundred
MOST_RUNS = 100_000


@dataclass(frozen=True, kw_only=True)
class SolverSpec:
    """A solver of a study.

    Attributes:
        algorithm: name.
        label: what the study calls it; the name if empty.
        runs: how many; None for the study's.
        settings: of the algorithm, where they differ from its defaults.
        polish: IPOPT from each of its results, as a solver of its own called ``<label>+ipopt``.
    """

    algorithm: str
    label: str = ""
    runs: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    polish: bool = False


@dataclass(frozen=True, kw_only=True)
class StudySettings:
    """Everything that decides what a study computes.

    Attributes:
        problems: at least one.
        solvers: at least one.
        runs: of each search algorithm.
        starts: of each gradient method; each is one run.
        handling: of constraints, in searches.
        stop: of each run.
        seed: run k has the seed ``seed + k``.
    """

    problems: tuple[ProblemSpec, ...]
    solvers: tuple[SolverSpec, ...]
    runs: int = 11
    starts: int = 20
    handling: Handling = field(default_factory=Handling)
    stop: Stop = field(default_factory=Stop)
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what no machine can hold."""
        for count in (self.runs, self.starts, *(s.runs for s in self.solvers if s.runs is not None)):
            if not 1 <= count <= MOST_RUNS:
                raise InputError(f"runs and starts must be from 1 to {MOST_RUNS}, got {count}")

    def tasks(self) -> tuple[Task, ...]:
        """Every run of the study."""
        return tuple(
            task
            for problem in self.problems
            for solver in self.solvers
            for title in (solver.label or solver.algorithm,)
            for first in (
                Task(
                    problem=problem,
                    algorithm=solver.algorithm,
                    settings=solver.settings,
                    handling=self.handling,
                    stop=self.stop,
                    seed=self.seed,
                    label=solver.label,
                ),
            )
            for single in (
                (first, replace(first, algorithm=IPOPT, settings={}, label=f"{title}+{IPOPT}", polishes=title))
                if solver.polish
                else (first,)
            )
            for run in range(self._runs(solver))
            for task in (replace(single, run=run),)
        )

    def to_json(self) -> dict[str, Any]:
        """As ``settings_from`` reads it."""
        return {
            "problem": [
                {"name": p.name, "label": p.label, "options": dict(p.options), "set": dict(p.values)}
                for p in self.problems
            ],
            "solver": [{key: v for key, v in asdict(s).items() if v is not None} for s in self.solvers],
            "runs": self.runs,
            "starts": self.starts,
            "handling": {"name": self.handling.name, **self.handling.settings},
            "seed": self.seed,
            **{key: value for key, value in asdict(self.stop).items() if value is not None},
        }

    def _runs(self, solver: SolverSpec) -> int:
        if solver.runs is not None:
            return solver.runs
        return self.starts if solver.algorithm in GRADIENT_SOLVERS else self.runs


def read_settings(path: Path) -> StudySettings:
    """Settings from a TOML file.

    Raises:
        InputError: the file cannot be read, or something in it is not allowed; the message says what and where.
    """
    text = read_text(path, "study file", at_most=LARGEST_FILE)
    try:
        raw = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"study file {str(path)!r} is not valid TOML: {error}") from error
    return settings_from(raw, f"study file {str(path)!r}")


def settings_from(raw: Any, source: str) -> StudySettings:
    """Settings from plain data.

    Args:
        raw: tables ``problem`` and ``solver``, and the study's own values.
        source: where it comes from, for messages.

    Raises:
        InputError: a value of the wrong kind or that is not allowed.
        UnknownNameError: a key that does not exist.
    """
    try:
        check_plain(raw)
    except ValueError as error:
        raise InputError(f"{source} may hold finite numbers, texts, lists and tables only: {error}") from error
    read = _Reader(source, "the study", raw)
    stop = {name: read.take(name, kind, None) for name, kind in STOP_KINDS.items()}
    handling = _Reader(source, "handling", read.table("handling", {"name": "deb"}))
    schema = read.take("schema", int, SCHEMA)
    if schema != SCHEMA:
        raise InputError(f"{source}: schema must be {SCHEMA}, got {schema}; a newer version of nlp-gait may read it")
    settings = StudySettings(
        problems=tuple(_problem(item, source) for item in read.tables("problem")),
        solvers=tuple(_solver(item, source) for item in read.tables("solver")),
        runs=read.take("runs", int, 11, at_least=1),
        starts=read.take("starts", int, 20, at_least=1),
        seed=read.take("seed", int, 0, at_least=0),
        handling=Handling(name=handling.take("name", str, "deb"), settings=handling.rest()),
        stop=Stop(**{name: value for name, value in stop.items() if value is not None}),
    )
    read.done()
    return settings


STOP_KINDS: Mapping[str, type] = {"evaluations": int, "target": float, "stagnation": int, "time_limit_s": float}


def _problem(raw: Any, source: str) -> ProblemSpec:
    read = _Reader(source, "[[problem]]", raw)
    name = read.take("name", str)
    label, options = read.take("label", str, ""), read.table("options", {})
    values, fixed = read.table("set", {}), read.table("fix", {})
    read.done()
    for key, value in options.items():
        if not isinstance(value, (str, int, float)):
            raise InputError(f"{source}: [[problem]]: option {key} must be a text or a number, got {value!r}")
    spec = ProblemSpec(name=name, options=options, label=label, values=values)
    return replace(spec, values=dict(spec.load().fix(**fixed).values)) if fixed else spec


def _solver(raw: Any, source: str) -> SolverSpec:
    read = _Reader(source, "[[solver]]", raw)
    spec = SolverSpec(
        algorithm=read.take("algorithm", str),
        label=read.take("label", str, ""),
        runs=read.take("runs", int, None, at_least=1),
        settings=read.table("settings", {}),
        polish=read.take("polish", bool, False),
    )
    read.done()
    return spec


REQUIRED: Any = object()


class _Reader:
    """Takes values out of a table; what is wrong or left over is an error that names it."""

    def __init__(self, source: str, where: str, raw: Any) -> None:
        self._where = f"{source}: {where}"
        if not isinstance(raw, Mapping):
            raise InputError(f"{self._where} must be a table, got {type(raw).__name__}")
        self._raw = dict(raw)
        self._known: list[str] = []

    def take(self, name: str, kind: type[Any], default: Any = REQUIRED, at_least: int | None = None) -> Any:
        """Value of a key; without a default it is needed."""
        self._known.append(name)
        if name not in self._raw:
            if default is REQUIRED:
                raise InputError(f"{self._where} needs {name!r}")
            return default
        value: Any = self._raw.pop(name)
        if kind is float and type(value) is int:
            value = float(value)
        if (
            not isinstance(value, kind)
            or isinstance(value, bool) != (kind is bool)
            or (at_least is not None and value < at_least)
        ):
            limit = "" if at_least is None else f" of at least {at_least}"
            raise InputError(f"{self._where}: {name} must be {kind_name(kind)}{limit}, got {value!r}")
        return value

    def table(self, name: str, default: Mapping[str, Any]) -> dict[str, Any]:
        """Sub-table; a text stands for a table with that name alone."""
        self._known.append(name)
        value = self._raw.pop(name, default)
        if isinstance(value, str) and "name" in default:
            return {"name": value}
        if not isinstance(value, Mapping):
            raise InputError(f"{self._where}: {name} must be a table, got {value!r}")
        return dict(value)

    def tables(self, name: str) -> Sequence[Any]:
        """List of sub-tables, at least one."""
        self._known.append(name)
        value = self._raw.pop(name, [])
        if not isinstance(value, list) or not value:
            raise InputError(f"{self._where} needs at least one [[{name}]]")
        return value

    def rest(self) -> dict[str, Any]:
        """What has not been taken."""
        return self._raw

    def done(self) -> None:
        """Raise if anything is left."""
        for name in self._raw:
            raise unknown(f"key of {self._where}", name, self._known)
