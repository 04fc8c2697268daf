"""A study as plain settings, from the command line or a TOML file."""

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from compare.study.run import GRADIENT_SOLVERS, IPOPT, Handling, ProblemSpec, Run, Stop
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import check_plain, convert_errors, read_text
from nlp_gait.providers import PROBLEMS

SCHEMA = 1  # of study files; the default
LARGEST_FILE = 2**17  # bytes; a study file has a few hundred
MOST_RUNS = 100_000


@dataclass(frozen=True, kw_only=True)
class SolverSpec:
    """A solver of a study."""

    name: str  #: as in ``nlp-gait list``, or user code as ``file.py:name`` or ``module:name``
    label: str = ""  #: its name in the study; empty for ``name``
    runs: int | None = None  #: number; None for the study's
    settings: Mapping[str, Any] = field(default_factory=dict)  #: that differ from its defaults
    polish: bool = False  #: whether each run is also made with IPOPT at its end, as another solver ``<label>+ipopt``


@dataclass(frozen=True, kw_only=True)
class StudySettings:
    """Everything that determines what a study computes."""

    problems: tuple[ProblemSpec, ...]
    solvers: tuple[SolverSpec, ...]
    runs: int = 11  #: of each search algorithm
    starts: int = 20  #: of each NLP solver; each is one run
    handling: Handling = field(default_factory=Handling)  #: of constraints, in searches
    stop: Stop = field(default_factory=Stop)
    seed: int = 0  #: run k has the seed ``seed + k``

    def __post_init__(self) -> None:
        """Check counts and seed."""
        solvers = ((f"runs of {solver.label or solver.name}", solver.runs) for solver in self.solvers)
        for name, count in (("runs", self.runs), ("starts", self.starts), *solvers):
            if count is not None and not 1 <= count <= MOST_RUNS:
                raise InputError(f"{name} must be a whole number from 1 to {MOST_RUNS}, got {count}")
        if self.seed < 0:
            raise InputError(f"seed must be a whole number of at least 0, got {self.seed}")

    def make_runs(self) -> tuple[Run, ...]:
        """Return every run of the study: for each problem and solver its runs, then those that IPOPT polishes."""
        runs: list[Run] = []
        for problem in self.problems:
            for solver in self.solvers:
                first = Run(
                    problem=problem,
                    solver=solver.name,
                    settings=solver.settings,
                    handling=self.handling,
                    stop=self.stop,
                    seed=self.seed,
                    label=solver.label,
                )
                numbers = range(solver.runs or (self.starts if solver.name in GRADIENT_SOLVERS else self.runs))
                runs += [replace(first, number=number) for number in numbers]
                if solver.polish:
                    polished = replace(first, label=f"{first.title}+{IPOPT}", polish=True)
                    runs += [replace(polished, number=number) for number in numbers]
        return tuple(runs)

    def to_json(self) -> dict[str, Any]:
        """Return plain data as ``parse_settings`` reads it."""
        return {
            "problem": [
                {"name": p.address, "label": p.label, "options": dict(p.options), "set": dict(p.values)}
                for p in self.problems
            ],
            "solver": [{key: v for key, v in asdict(s).items() if v is not None} for s in self.solvers],
            "runs": self.runs,
            "starts": self.starts,
            "handling": {"name": self.handling.name, **self.handling.settings},
            "seed": self.seed,
            **self.stop.limits,
        }


def read_settings(path: Path) -> StudySettings:
    """Return the settings in a TOML file; raises as ``parse_settings``, and InputError if the file cannot be read."""
    text = read_text(path, "study file", at_most=LARGEST_FILE)
    with convert_errors(f"study file {str(path)!r} is not valid TOML", InputError):
        raw = tomllib.loads(text)
    return parse_settings(raw, f"study file {str(path)!r}")


def parse_settings(raw: Any, source: str, *, runs_code: bool = True) -> StudySettings:
    """Return settings from plain data.

    Args:
        raw: tables ``problem`` and ``solver``, and the values of the study.
        source: of the data, for messages.
        runs_code: False if the user did not name this source: then no problem is built.

    Raises:
        InputError: a key does not exist, or a value has the wrong type or is not allowed.
        UnknownNameError: a problem or a variable to fix does not exist.
    """
    with convert_errors(f"{source} may contain only finite numbers, texts, lists and tables", InputError):
        check_plain(raw)
    for name in ("problem", "solver"):
        if isinstance(raw, Mapping) and not (isinstance(raw.get(name), list) and raw[name]):
            raise InputError(f"{source} needs at least one [[{name}]]")
    with convert_errors(source, InputError):
        study = decode(_Study, raw)
    if study.schema != SCHEMA:
        raise InputError(
            f"{source}: schema must be {SCHEMA}, got {study.schema}; a newer version of nlp-gait may read it"
        )
    handling: dict[str, Any] = (
        {"name": study.handling} if isinstance(study.handling, str) else {"name": "deb", **study.handling}
    )
    return StudySettings(
        problems=tuple(problem.spec(source, runs_code) for problem in study.problem),
        solvers=study.solver,
        runs=study.runs,
        starts=study.starts,
        seed=study.seed,
        handling=Handling(name=str(handling.pop("name")), settings=handling),
        stop=Stop(**{criterion.name: getattr(study, criterion.name) for criterion in fields(Stop)}),
    )


@dataclass(frozen=True, kw_only=True)
class _Problem:
    name: str
    label: str = ""
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    set: Mapping[str, Any] = field(default_factory=dict)
    fix: Mapping[str, Any] = field(default_factory=dict)

    def spec(self, source: str, runs_code: bool) -> ProblemSpec:
        if self.fix and not runs_code and self.name not in PROBLEMS:
            raise InputError(
                f"{source}: 'fix' of {self.name!r} would run code that this command does not name; write bounds under 'set'"
            )
        spec = ProblemSpec(name=self.name, options=self.options, label=self.label, values=self.set)
        return replace(spec, values=dict(spec.load().fix(**self.fix).values)) if self.fix else spec


@dataclass(frozen=True, kw_only=True)
class _Study(Stop):
    problem: tuple[_Problem, ...]
    solver: tuple[SolverSpec, ...]
    runs: int = 11
    starts: int = 20
    seed: int = 0
    handling: str | Mapping[str, Any] = "deb"
    schema: int = SCHEMA
