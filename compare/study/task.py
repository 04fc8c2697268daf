"""What to run, as plain data that can be passed to other processes and written to files."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from compare.study.definition import group_of, source_of
from metaheuristics.interface import Algorithm
from metaheuristics.preparation import check_limits
from metaheuristics.registry import ADAPTERS, ALGORITHMS, algorithm, handling
from metaheuristics.user_algorithm import PlainFunction, as_algorithm
from nlp_gait.backends.identity import SOURCE, hash_json, identify_problem
from nlp_gait.backends.solvers.registry import SOLVERS, list_settings, make_solver
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, unknown
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import check_options, load
from nlp_gait.providers import PROBLEMS
from nlp_gait.robots.loading import hash_robot, is_robot_file
from nlp_gait.user_code import check_reference, find_entry_points, hash_source, is_user_code, load_object, shorten_name

IPOPT = "ipopt"
GRADIENT_SOLVERS = tuple(SOLVERS)
LABEL = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9._+:() -]{0,62}[A-Za-z0-9._+:()-])?")
PYMOO = "pymoo:"  # before the names of that package's algorithms, which are no modules' names
FUNCTION = "function"  # kind of a plain function in settings
# Stands for an algorithm of one's own in checks before its code runs.
UNREAD: Any = PlainFunction(function=lambda f, lower, upper, evaluations, seed: None, name="own")


def solver_names() -> tuple[str, ...]:
    """Names of all solvers that a study can run; other packages' algorithms need the extra ``algorithms``."""
    return (*GRADIENT_SOLVERS, *ALGORITHMS, *ADAPTERS)


@dataclass(frozen=True, kw_only=True)
class ProblemSpec:
    """A problem as plain data.

    Attributes:
        name: as in ``nlp-gait list``, or of one's own, see ``nlp_gait.formulation.registry.find_maker``; or a ``GaitProblem``
            itself, which then has its options already.
        options: what it is built with, where that differs from the defaults.
        values: parameters, where they differ from the defaults.
        label: what a study calls it; the name if empty, of one's own without file or module.
    """

    name: str | GaitProblem
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    label: str = ""

    @property
    def called(self) -> str:
        """Name."""
        return self.name if isinstance(self.name, str) else self.name.address

    @property
    def title(self) -> str:
        """Label, or name without one."""
        return self.label or (self.called if self.called in PROBLEMS else shorten_name(self.called))

    def with_options(self, **options: str | int | float | bool) -> ProblemSpec:
        """The same with other options beside those that it has."""
        return replace(self, options={**self.options, **options})

    def load(self) -> GaitProblem:
        """The problem, built once in each process for each content of what it is built from."""
        if isinstance(self.name, GaitProblem):
            if self.options:
                raise InputError(
                    f"{self.called!r} is built already, so it takes no options; got {', '.join(self.options)}"
                )
            return self.name.with_values(**self.values)
        check_options(self.name, self.options)  # before the cache, to which True and 1 are the same
        robot = self.options.get("robot")
        contents = (
            hash_robot(robot) if isinstance(robot, str) and is_robot_file(robot) else "",
            hash_source(self.name, "problem") if self.name not in PROBLEMS else "",
        )
        return _load(self.name, tuple(sorted(self.options.items())), contents).with_values(**self.values)


@lru_cache(maxsize=16)
def _load(name: str, options: tuple[tuple[str, Any], ...], contents: tuple[str, ...]) -> GaitProblem:
    return load(name, **dict(options))


@dataclass(frozen=True, kw_only=True)
class Handling:
    """Constraint handling of the search algorithms: ``"deb"``, ``"penalty"`` or ``"epsilon"``, and its settings."""

    name: str = "deb"
    settings: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Stop:
    """When a run ends.

    Attributes:
        evaluations: budget of a search, and of SLSQP; an NLP solver ends by itself.
        target: a feasible objective at least this good ends a search, in the problem's sense.
        stagnation: so many generations without a better point end a search.
        time_limit_s: wall time [s]; refused for a solver that cannot heed it (fatrop).
    """

    evaluations: int = 10_000
    target: float | None = None
    stagnation: int | None = None
    time_limit_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class Task:
    """One run.

    Attributes:
        problem: what is solved.
        solver: name of the solver, also of one's own as ``file.py:name`` or ``module:name``; or a search algorithm itself, or
            a plain function (see ``metaheuristics.as_algorithm``), which must be picklable.
        settings: of the named algorithm, where they differ from its defaults.
        handling: of constraints, in searches.
        stop: criteria.
        seed: of the study.
        run: number of the run; its own seed is ``seed + run``, so that equal runs of all algorithms start alike.
        label: what the study calls the solver; the algorithm's name if empty.
        polishes: label of the search whose equal run gives the start point; empty for a random one.
        polished: that run, where it is known.
        start: values of all variables by name, where IPOPT or another NLP solver begins; empty for a random point.
    """

    problem: ProblemSpec
    solver: str | Algorithm | Callable[..., object]
    settings: Mapping[str, Any] = field(default_factory=dict)
    handling: Handling = field(default_factory=Handling)
    stop: Stop = field(default_factory=Stop)
    seed: int = 0
    run: int = 0
    label: str = ""
    polishes: str = ""
    polished: Task | None = None
    start: Mapping[str, float] = field(default_factory=dict)

    @property
    def run_seed(self) -> int:
        """Seed that repeats this run alone."""
        return self.seed + self.run

    @property
    def title(self) -> str:
        """Label, or the algorithm's name without one."""
        if isinstance(self.solver, str):
            return self.label or (shorten_name(self.solver) if self.is_user_code else self.solver)
        kind = type(self.solver).__name__
        return self.label or str(getattr(self.solver, "name", getattr(self.solver, "__name__", kind)))

    @property
    def is_user_code(self) -> bool:
        """Whether the algorithm is code of one's own by name, which runs in a process of its own."""
        name = self.solver
        if not isinstance(name, str) or name in solver_names() or name.startswith(PYMOO):
            return False
        return is_user_code(name, "algorithm")

    @property
    def is_search(self) -> bool:
        """True for metaheuristics, False for gradient methods."""
        return self.solver not in GRADIENT_SOLVERS

    def definition(self) -> dict[str, Any]:
        """All that the result depends on, as JSON gives it back; equal definitions have equal results."""
        problem = self.problem.load()
        parts: dict[str, Any] = {
            "problem": identify_problem(problem),
            "objective": asdict(problem.objective),
            "solver": self._solver_part(),
            "settings": dict(self.settings),
            "seed": self.run_seed,
        }
        if self.is_search:
            parts |= {"handling": asdict(self.handling), "stop": asdict(self.stop)}
        elif "evaluations" in list_settings(str(self.solver)):
            parts["stop"] = asdict(self.stop)
        elif self.stop.time_limit_s is not None:
            parts["stop"] = {"time_limit_s": self.stop.time_limit_s}
        if self.start:
            parts["start"] = dict(self.start)
        if self.polishes:
            parts["polishes"] = {"solver": self.polishes, "handling": asdict(self.handling), "stop": asdict(self.stop)}
            if self.polished is not None:
                parts["polishes"]["key"] = hash_json(group_of(self.polished.definition()))
        try:
            return json.loads(json.dumps(parts, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise InputError(f"settings of {self.title!r} must be numbers, texts and lists: {error}") from error

    def _solver_part(self) -> str | dict[str, Any]:
        """Name, or settings, and the hash of the source where it is not this package's."""
        if not isinstance(self.solver, str):
            source = source_of(self.solver)
            return {**plain_settings(self.solver), **({} if source is None else {SOURCE: source})}
        if self.is_user_code:
            return {"name": self.solver, SOURCE: hash_source(self.solver, "algorithm")}
        return self.solver

    def make_search(self) -> Algorithm:
        """Settings of the search algorithm; code of one's own runs here for the first time.

        Raises:
            SearchError: it is no algorithm, or does not take its settings.
            UserCodeError: its code cannot be found or fails.
        """
        if not isinstance(self.solver, str):
            return as_algorithm(self.solver, self.title, self.settings)
        if self.is_user_code:
            own = load_object(self.solver, "algorithm")
            return as_algorithm(own, self.title, self.settings)
        return algorithm(self.solver, **self.settings)

    def make_solver(self) -> Solver:
        """NLP solver with its settings and the limits that it heeds.

        Raises:
            InputError: a time limit that it cannot heed, or a setting that is not allowed.
        """
        name = str(self.solver)
        known = list_settings(name)
        if self.stop.time_limit_s is not None and "time_limit_s" not in known:
            raise InputError(f"{name} cannot be stopped at a time limit; leave out {name}, or the limit")
        limits = {"evaluations": self.stop.evaluations, "time_limit_s": self.stop.time_limit_s}
        heeded = {limit: value for limit, value in limits.items() if limit in known and value is not None}
        return make_solver(name, **{**heeded, **self.settings})


def check_task(task: Task) -> None:
    """Refuse now what would fail later: unknown problem, option, parameter, algorithm or setting; a bad label or limit."""
    problem = task.problem.load()
    for title in (task.problem.title, task.title):
        if not LABEL.fullmatch(title):
            raise InputError(
                f"a label has 1 to 64 letters, digits, spaces and . _ + : ( ) -, and begins with a letter or digit; got {title!r}"
            )
    if task.is_user_code:
        check_reference(str(task.solver), "algorithm")  # without running it
    elif isinstance(task.solver, str) and task.solver not in solver_names():
        raise unknown("algorithm", task.solver, [*solver_names(), *find_entry_points("algorithm")])
    if task.stop.time_limit_s is not None and not task.stop.time_limit_s > 0.0:
        raise InputError(f"time_limit_s must be > 0, got {task.stop.time_limit_s}")
    if not task.is_search:
        task.make_solver().check(problem)
    else:
        handling(task.handling.name, **task.handling.settings)
        search = UNREAD if task.is_user_code else task.make_search()
        check_limits(search, task.stop.evaluations, task.stop.target, task.stop.stagnation, task.stop.time_limit_s)
    if task.start:
        if task.is_search:
            raise InputError(f"{task.title!r} takes no start point; NLP solvers do")
        problem.check_within(task.start)


def plain_problem(problem: GaitProblem) -> dict[str, Any]:
    """Name, options and changed parameter values of a problem, as plain data from which ``load_result`` makes it again."""
    return {"problem": problem.address, "options": dict(problem.options), "parameters": dict(problem.values)}


def plain_settings(settings: Any) -> dict[str, Any]:
    """Settings with their class name, as plain data; of an object that is no data class what is plain among its attributes."""
    if isinstance(settings, PlainFunction):
        return {**plain_settings(settings.function), **settings.settings}
    if inspect.isroutine(settings):
        return {"kind": FUNCTION, "function": settings.__qualname__}
    kind = type(settings).__name__
    known = is_dataclass(settings) and not isinstance(settings, type)
    values = asdict(settings) if known else {k: v for k, v in getattr(settings, "__dict__", {}).items() if k[0] != "_"}
    return {"kind": kind, **{name: _plain(value) for name, value in values.items()}}


def _plain(value: Any) -> Any:
    """A value as JSON has it; what it has not is named by its type."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.generic):
        value = value.item()
    return value if value is None or isinstance(value, (str, int, float)) else f"<{type(value).__name__}>"
