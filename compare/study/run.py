"""What to run, as plain data, and the inputs of a run: everything that its result depends on, from which its file is named."""

import inspect
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from metaheuristics.external_program import ExternalProgram
from metaheuristics.interface import Algorithm
from metaheuristics.preparation import check_budget
from metaheuristics.registry import ADAPTERS, ALGORITHMS, make_algorithm, make_handling
from metaheuristics.user_algorithm import PlainFunction, to_algorithm
from nlp_gait import __version__
from nlp_gait.backends.exact import hash_formulas, hash_json, identify_problem, make_key
from nlp_gait.backends.solvers.registry import SOLVERS, list_settings, make_solver
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import LARGEST_INTEGER, check_plain, replace_nan
from nlp_gait.formulation import GaitProblem, Objective
from nlp_gait.formulation.registry import check_options, find_maker, hash_files, load
from nlp_gait.gaitbench.generated import resolve_name
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import (
    SourceFiles,
    check_reference,
    find_entry_points,
    forget_code,
    is_program,
    is_user_code,
    load_object,
    parse_command,
    read_source_files,
    shorten_name,
    shorten_reference,
)

IPOPT = "ipopt"
GRADIENT_SOLVERS = tuple(SOLVERS)
LABEL = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9._+:() -]{0,62}[A-Za-z0-9._+:()-])?")
PYMOO = "pymoo:"  # prefix of names that are not user code
FUNCTION = "function"  # kind of a plain function in settings
KEY_DIGITS = 16
EVALUATIONS = 10_000  # as in the papers: 50 candidates, 200 generations


def list_solvers() -> tuple[str, ...]:
    """Return the names of all solvers of a study; those of other packages need the extra ``algorithms``."""
    return (*GRADIENT_SOLVERS, *ALGORITHMS, *ADAPTERS)


@dataclass(frozen=True, kw_only=True)
class ProblemSpec:
    """A problem as plain data."""

    #: As in ``nlp-gait list``, or the id of an instance of GaitBench, which is replaced by its problem, or user code (see
    #: ``nlp_gait.formulation.registry.find_maker``), or a ``GaitProblem``
    name: str | GaitProblem
    #: That differ from the defaults; none for a ``GaitProblem``
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)  #: parameters that differ from the defaults
    label: str = ""  #: its name in a study; empty for ``name``, without file or module

    def __post_init__(self) -> None:
        """Replace the id of an instance of GaitBench by its problem, its option and its label."""
        if isinstance(self.name, str):
            name, instance = resolve_name(self.name)
            if instance:
                object.__setattr__(self, "label", self.label or self.name)  # it is frozen
                object.__setattr__(self, "name", name)
                object.__setattr__(self, "options", {**instance, **self.options})

    @property
    def load_name(self) -> str:
        """Name from which the problem is loaded."""
        return self.name if isinstance(self.name, str) else self.name.load_name

    @property
    def title(self) -> str:
        """Name in a study."""
        return self.label or (self.load_name if self.load_name in PROBLEMS else shorten_name(self.load_name))

    def with_options(self, **options: str | int | float | bool) -> "ProblemSpec":
        """Return a copy with further options."""
        return replace(self, options={**self.options, **options})

    def load(self) -> GaitProblem:
        """Return the problem; each is built once in a process, as long as its files do not change."""
        if isinstance(self.name, GaitProblem):
            if self.options:
                raise InputError(
                    f"problem {self.load_name!r} is already built; options are not allowed: {', '.join(self.options)}"
                )
            return self.name.with_values(**self.values)
        check_options(find_maker(self.name), self.options)  # before the cache, to which True and 1 are the same
        code = "" if self.name in PROBLEMS else read_source_files(self.name, "problem").digest
        contents = (code, *hash_files(self.options).values())
        return _load(self.name, tuple(sorted(self.options.items())), contents).with_values(**self.values)


@lru_cache(maxsize=16)
def _load(name: str, options: tuple[tuple[str, Any], ...], contents: tuple[str, ...]) -> GaitProblem:
    return load(name, **dict(options))


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Everything that the result of a run depends on."""

    problem: Mapping[str, Any]  #: see ``identify_problem``
    objective: Objective
    solver: str | Mapping[str, Any]  #: its name, user code as the user named it, or the settings of an object
    seed: int  #: of this run
    version: str = ""  #: of nlp-gait; empty for imported results
    settings: Mapping[str, Any] = field(default_factory=dict)  #: of the solver, that differ from its defaults
    code: str = ""  #: hash of the files of a user-defined solver
    handling: str = ""  #: of constraints, in a search; empty for an NLP solver
    evaluations: int | None = None  #: budget, if the solver heeds one
    time_limit_s: float | None = None  #: wall time [s]
    start: Mapping[str, float] = field(default_factory=dict)  #: of an NLP solver; empty for a random point
    imported: str = ""  #: hash of imported values; empty for a run of ours

    @property
    def is_search(self) -> bool:
        """Whether the run ends with a search, so that its history is exact."""
        return bool(self.handling)

    @cached_property
    def key(self) -> str:
        """Hash of all inputs, for the name of a file; the same wherever the user's files lie."""
        solver = shorten_reference(self.solver) if isinstance(self.solver, str) else self.solver
        return hash_json({**replace_nan(self), "problem": make_key(self.problem), "solver": solver})[:KEY_DIGITS]


@dataclass(frozen=True, kw_only=True)
class Run:
    """One run of a solver on a problem."""

    problem: ProblemSpec
    #: name, or user code as ``file.py:name``, ``module:name`` or ``cmd:COMMAND``, or a picklable search algorithm or plain
    #: function (see ``metaheuristics.to_algorithm``)
    solver: str | Algorithm | Callable[..., object]
    settings: Mapping[str, Any] = field(default_factory=dict)  #: of the named solver, that differ from its defaults
    handling: str = "deb"  #: of constraints, in searches: deb or penalty=WEIGHT
    evaluations: int = EVALUATIONS  #: budget of a search and of SLSQP; other NLP solvers end by themselves
    time_limit_s: float | None = None  #: wall time [s]
    seed: int = 0  #: of the study
    number: int = 0  #: its seed is ``seed + number``, so that equal runs of all solvers start alike
    label: str = ""  #: of the solver in the study; empty for its name
    #: Values of all variables by name at which an NLP solver starts; empty for a random point
    start: Mapping[str, float] = field(default_factory=dict)

    @property
    def run_seed(self) -> int:
        """Seed of this run."""
        return self.seed + self.number

    @property
    def title(self) -> str:
        """Name of the solver in the study."""
        if isinstance(self.solver, str):
            return self.label or (shorten_name(self.solver) if self.is_user_code else self.solver)
        kind = type(self.solver).__name__
        return self.label or str(getattr(self.solver, "name", getattr(self.solver, "__name__", kind)))

    @property
    def is_user_code(self) -> bool:
        """Whether the solver is user code by name, which runs in its own process."""
        name = self.solver
        if not isinstance(name, str) or name in list_solvers() or name.startswith(PYMOO):
            return False
        return is_user_code(name, "algorithm")

    @property
    def is_search(self) -> bool:
        """True for metaheuristics, False for gradient methods."""
        return self.solver not in GRADIENT_SOLVERS

    def read_code(self) -> SourceFiles | None:
        """Return the files of a solver that is user code by name, as they are now; None for other solvers."""
        return read_source_files(str(self.solver), "algorithm") if self.is_user_code else None

    def make_search(self, files: SourceFiles | None = None) -> Algorithm:
        """Return the search with its settings; this first runs user code. Raises SearchError for no search, and UserCodeError."""
        if isinstance(self.solver, str) and is_program(self.solver):
            program = ExternalProgram(command=parse_command(self.solver), name=self.title, settings=self.settings)
            return to_algorithm(program, self.title)
        algorithm = load_object(str(self.solver), "algorithm", files) if self.is_user_code else self.solver
        if isinstance(algorithm, str):
            return make_algorithm(algorithm, **self.settings)
        return to_algorithm(algorithm, self.title, self.settings)

    def make_solver(self) -> Solver:
        """Return the NLP solver with settings and the limits that it respects; InputError for what it does not allow."""
        setting_names = list_settings(str(self.solver))
        limits = {"evaluations": self.evaluations, "time_limit_s": self.time_limit_s}
        respected = {limit: value for limit, value in limits.items() if limit in setting_names and value is not None}
        return make_solver(str(self.solver), **{**respected, **self.settings})


def plan_runs(
    problems: Iterable[ProblemSpec], solvers: Iterable[tuple[str, Any]], *, runs: int, starts: int, **common: Any
) -> tuple[Run, ...]:
    """Return the runs of a study: on each problem ``starts`` of each NLP solver, and ``runs`` of each search.

    ``solvers`` are labels, which may be empty, with solvers; ``common`` are further fields of all runs, such as ``evaluations``.
    """
    pairs = list(solvers)
    return tuple(
        Run(problem=problem, solver=solver, label=label, number=number, **common)
        for problem in problems
        for label, solver in pairs
        for number in range(starts if solver in GRADIENT_SOLVERS else runs)
    )


def make_inputs(runs: Iterable[Run]) -> list[Inputs]:
    """Return the inputs of runs; each problem and each file is read once. InputError for settings that are not plain."""
    problems: dict[int, tuple[GaitProblem, dict[str, Any]]] = {}
    solvers: dict[tuple[int, int], tuple[Any, str]] = {}
    listed = []
    for run in runs:
        if id(run.problem) not in problems:
            problem = run.problem.load()
            problems[id(run.problem)] = problem, identify_problem(problem)
        if (key := (id(run.solver), id(run.settings))) not in solvers:
            files = run.read_code()
            solvers[key] = _describe_solver(run), "" if files is None else files.digest
        listed.append(_make_inputs(run, *problems[id(run.problem)], *solvers[key]))
    return listed


def _make_inputs(run: Run, problem: GaitProblem, identity: dict[str, Any], solver: Any, code: str) -> Inputs:
    has_budget = run.is_search or "evaluations" in list_settings(str(run.solver))
    return Inputs(
        problem=identity,
        objective=problem.objective,
        solver=solver["solver"],
        settings=solver["settings"],
        seed=run.run_seed,
        version=__version__,
        code=code,
        handling=run.handling if run.is_search else "",
        evaluations=run.evaluations if has_budget else None,
        time_limit_s=run.time_limit_s,
        start=dict(run.start),
    )


def _describe_solver(run: Run) -> dict[str, Any]:
    solver = (
        run.solver if isinstance(run.solver, str) else {**describe_settings(run.solver), **_hash_source(run.solver)}
    )
    try:
        plain: dict[str, Any] = json.loads(json.dumps({"solver": solver, "settings": dict(run.settings)}))
        check_plain(plain)
    except (TypeError, ValueError) as error:
        raise InputError(f"settings of {run.title!r} must be numbers, texts and lists: {error}") from error
    return plain


def check_run(run: Run) -> None:
    """Raise now what would fail later: unknown problem, option, parameter, solver or setting; a bad label or limit."""
    problem = run.problem.load()
    for title in (run.problem.title, run.title):
        if not LABEL.fullmatch(title):
            raise InputError(
                f"a label has 1 to 64 letters, digits, spaces and . _ + : ( ) -, and begins with a letter or digit; got {title!r}"
            )
    if run.is_user_code:
        check_reference(str(run.solver), "algorithm")  # without running it
    elif isinstance(run.solver, str) and run.solver not in list_solvers():
        raise unknown("algorithm", run.solver, [*list_solvers(), *find_entry_points("algorithm")])
    if run.time_limit_s is not None and not run.time_limit_s > 0.0:
        raise InputError(f"time_limit_s must be > 0, got {run.time_limit_s}")
    if run.run_seed > LARGEST_INTEGER:
        raise InputError(f"the seed {run.run_seed} of run {run.number} exceeds 64 bits")
    if not run.is_search:
        run.make_solver().check(problem)
    else:
        make_handling(run.handling)
        if not run.is_user_code:
            check_budget(run.make_search(), run.evaluations)
    if run.start:
        if run.is_search:
            raise InputError(f"search {run.title!r} takes no start point; only NLP solvers do")
        problem.check_within(run.start)


def check_repeatable(problem: ProblemSpec) -> None:
    """Raise InputError for a user's problem that is another one when it is loaded again, as one with random numbers is."""
    if not isinstance(problem.name, str) or problem.name in PROBLEMS:
        return
    first = hash_formulas(problem.load())
    forget_code(problem.name)
    again = load(problem.name, **problem.options).with_values(**problem.values)
    if hash_formulas(again) != first:
        raise InputError(
            f"two loads of the problem {problem.name!r} differ: fix the seed of its random numbers, or write the numbers down"
        )


def describe_problem(problem: GaitProblem) -> dict[str, Any]:
    """Return name, options and changed parameter values of a problem, as plain data for ``load_result``."""
    return {"problem": problem.load_name, "options": dict(problem.options), "parameters": dict(problem.values)}


def describe_settings(settings: Any) -> dict[str, Any]:
    """Return settings with their class name as plain data; of other objects than data classes, the public attributes."""
    if isinstance(settings, PlainFunction):
        return {**describe_settings(settings.function), **settings.settings}
    if inspect.isroutine(settings):
        return {"kind": FUNCTION, "function": settings.__qualname__}
    kind = type(settings).__name__
    plain = is_dataclass(settings) and not isinstance(settings, type)
    values = asdict(settings) if plain else {k: v for k, v in getattr(settings, "__dict__", {}).items() if k[0] != "_"}
    encoded: dict[str, Any] = json.loads(json.dumps(values, default=_encode_setting, skipkeys=True))
    return {"kind": kind, **encoded}


def _hash_source(solver: object) -> dict[str, str]:
    """Return the hash of the file of a user-defined object; empty without a file, as in a notebook, or if it is ours."""
    kind = solver if inspect.isroutine(solver) else type(solver)
    if kind.__module__.partition(".")[0] in ("metaheuristics", "nlp_gait"):
        return {}
    try:
        path = inspect.getsourcefile(kind)
        return {"file_sha256": hash_json(Path(path).read_text(encoding="utf-8"))} if path else {}
    except (TypeError, OSError):
        return {}


def _encode_setting(value: Any) -> Any:
    """Return what JSON has no form for: a number of NumPy as a number, and of anything else the name of its type."""
    return value.item() if isinstance(value, np.generic) else f"<{type(value).__name__}>"
