"""A study as plain settings (command line, TOML file), and its manifest ``study.json``: settings, commands, machine, versions."""

import os
import sys
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from compare.study.origin import describe_processor, describe_system, format_now, hash_installed_code
from compare.study.task import GRADIENT_SOLVERS, IPOPT, Handling, ProblemSpec, Stop, Task, list_solvers
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.kernel.compiler import BASE_FLAGS, find_compiler, lane_flags, native_lanes
from nlp_gait.decoding import decode
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.files import check_plain, convert_errors, lock_folder, read_json, read_text, write_json
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import resolve_code

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

    def tasks(self) -> tuple[Task, ...]:
        """Return every run of the study: for each problem and solver its runs, then those that IPOPT polishes."""
        tasks: list[Task] = []
        for problem in self.problems:
            for solver in self.solvers:
                task = Task(
                    problem=problem,
                    solver=solver.name,
                    settings=solver.settings,
                    handling=self.handling,
                    stop=self.stop,
                    seed=self.seed,
                    label=solver.label,
                )
                runs = range(solver.runs or (self.starts if solver.name in GRADIENT_SOLVERS else self.runs))
                tasks += [replace(task, run=run) for run in runs]
                if solver.polish:
                    polished = replace(task, label=f"{task.title}+{IPOPT}", polish=True)
                    tasks += [replace(polished, run=run) for run in runs]
        return tuple(tasks)

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


def resolve_user_code(settings: StudySettings, owner: str) -> StudySettings:
    """Return settings from a folder with user code as this command names it; raises UserCodeError if it does not."""
    return replace(
        settings,
        problems=tuple(_resolve_problem(p, owner) for p in settings.problems),
        solvers=tuple(
            s if s.name in list_solvers() else replace(s, name=resolve_code(s.name, "algorithm", owner))
            for s in settings.solvers
        ),
    )


def _resolve_problem(problem: ProblemSpec, owner: str) -> ProblemSpec:
    name, options = resolve_stored(problem.address, problem.options, owner)
    return replace(problem, name=name, options=options)


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


FILE = "study.json"
REMEDY = "delete it; the records stay valid"
PACKAGES = ("nlp-gait", "casadi", "numpy", "scipy", "joblib", "cma", "pymoo", "distributed")


@dataclass(frozen=True, kw_only=True)
class Session:
    """One command that ran a part of a study."""

    command: str
    started: str  #: date and time, UTC
    machine: Mapping[str, str]  #: processor, system, number of usable processors
    versions: Mapping[str, str]  #: of Python and the installed packages, and the hash of the code that runs solvers
    kernel: str  #: compiler and flags of the objective, or why it is interpreted
    jobs: str  #: worker processes, or the address of the scheduler

    @classmethod
    def begin(cls, command: str, jobs: str) -> "Session":
        """Return a session that begins now, in this process."""
        return cls(
            command=command,
            started=format_now(),
            machine={
                "processor": describe_processor(),
                "system": describe_system(),
                "processors": str(available_cores()),
            },
            versions={"python": sys.version.split()[0], **_list_versions(), "code": hash_installed_code()[:8]},
            kernel=_describe_kernel(),
            jobs=jobs,
        )


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """Content of ``study.json``."""

    settings: StudySettings | None  #: of the study that a command ran last; None without one
    sessions: tuple[Session, ...]
    runs: tuple[str, ...] = ()  #: that belong to the study: names of their records without suffix


@dataclass(frozen=True, kw_only=True)
class _File:
    schema: Literal[2] = 2
    study: Mapping[str, Any] | None = None
    sessions: tuple[Session, ...] = ()
    runs: tuple[str, ...] = ()


def write_manifest(folder: Path, settings: StudySettings, session: Session) -> None:
    """Add a session to the manifest of a folder, with the latest settings; raises InputError if the manifest is damaged."""
    with lock_folder(folder):
        file = _read_file(folder)
        file = replace(file, study=settings.to_json(), sessions=(*file.sessions, session))
        write_json(folder / FILE, asdict(file))


def list_runs(folder: Path, names: Sequence[str]) -> None:
    """Make runs part of the study; they replace the runs of their problems and solvers, whose records stay as files.

    Raises InputError if the manifest is damaged, and OutputError.
    """
    with lock_folder(folder):
        file = _read_file(folder)
        solvers = {_name_solver(name) for name in names}
        kept_names = [name for name in file.runs if _name_solver(name) not in solvers]
        if set(file.runs) != {*kept_names, *names}:
            write_json(folder / FILE, asdict(replace(file, runs=(*kept_names, *dict.fromkeys(names)))))


def _name_solver(name: str) -> str:
    return name.rsplit("-", 2)[0]  # without run and key


def _read_file(folder: Path) -> _File:
    path = folder / FILE
    if not os.path.lexists(path):
        return _File()
    raw = read_json(path, "manifest", remedy=REMEDY)
    with convert_errors(f"manifest {str(path)!r} is damaged", InputError, REMEDY):
        return decode(_File, raw)


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a folder, empty where none is stored; raises InputError if it is damaged or of another schema."""
    file, source = _read_file(folder), f"manifest {str(folder / FILE)!r}"
    settings = None if file.study is None else parse_settings(file.study, source, runs_code=False)
    return Manifest(settings=settings, sessions=file.sessions, runs=file.runs)


def _list_versions() -> dict[str, str]:
    versions = {}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    return versions


def _describe_kernel() -> str:
    lanes = native_lanes()
    try:
        return " ".join([find_compiler().summary, *BASE_FLAGS, *lane_flags(lanes), f"-DLANES={lanes}"])
    except CompilerError as error:
        return f"interpreted: {error}"
