"""What to run, as plain data that can be passed to other processes and written to files."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from typing import Any

import metaheuristics
import nlp_gait
from metaheuristics.interface import Algorithm
from nlp_gait.backends.solvers.registry import SOLVERS, setting_names, solver
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, unknown
from nlp_gait.problem import GaitProblem
from nlp_gait.problem.registry import check_options

IPOPT = "ipopt"
GRADIENT_SOLVERS = tuple(SOLVERS)
LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+:-]{0,63}")


def solver_names() -> tuple[str, ...]:
    """Names of all solvers that a study can run; other packages' algorithms need the extra ``algorithms``."""
    return (*GRADIENT_SOLVERS, *metaheuristics.ALGORITHMS, *metaheuristics.ADAPTERS)


@dataclass(frozen=True, kw_only=True)
class ProblemSpec:
    """A problem as plain data.

    Attributes:
        name: as in ``nlp-gait list``.
        options: what it is built with, where that differs from the defaults.
        values: parameters, where they differ from the defaults.
        label: what a study calls it; the name if empty.
    """

    name: str
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    label: str = ""

    @property
    def title(self) -> str:
        """Label, or name without one."""
        return self.label or self.name

    def with_options(self, **options: str | int | float | bool) -> ProblemSpec:
        """The same with other options beside those that it has."""
        return replace(self, options={**self.options, **options})

    def load(self) -> GaitProblem:
        """The problem, built once in each process."""
        check_options(self.name, self.options)  # before the cache, to which True and 1 are the same
        return _load(self.name, tuple(sorted(self.options.items()))).with_values(**self.values)


@lru_cache(maxsize=16)
def _load(name: str, options: tuple[tuple[str, Any], ...]) -> GaitProblem:
    return nlp_gait.load(name, **dict(options))


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
        algorithm: name of the solver, or settings of a search algorithm of one's own (which must be picklable).
        settings: of the named algorithm, where they differ from its defaults.
        handling: of constraints, in searches.
        stop: criteria.
        seed: of the study.
        run: number of the run; its own seed is ``seed + run``, so that equal runs of all algorithms start alike.
        label: what the study calls the solver; the algorithm's name if empty.
        polishes: label of the search whose equal run gives the start point; empty for a random one.
        start: values of all variables by name, where IPOPT or another NLP solver begins; empty for a random point.
    """

    problem: ProblemSpec
    algorithm: str | Algorithm
    settings: Mapping[str, Any] = field(default_factory=dict)
    handling: Handling = field(default_factory=Handling)
    stop: Stop = field(default_factory=Stop)
    seed: int = 0
    run: int = 0
    label: str = ""
    polishes: str = ""
    start: Mapping[str, float] = field(default_factory=dict)

    @property
    def run_seed(self) -> int:
        """Seed that repeats this run alone."""
        return self.seed + self.run

    @property
    def title(self) -> str:
        """Label, or the algorithm's name without one."""
        return self.label or (self.algorithm if isinstance(self.algorithm, str) else self.algorithm.name)

    @property
    def is_search(self) -> bool:
        """True for metaheuristics, False for gradient methods."""
        return self.algorithm not in GRADIENT_SOLVERS

    def definition(self) -> dict[str, Any]:
        """All that the result depends on, as JSON gives it back; equal definitions have equal results."""
        problem = self.problem.load()
        named = isinstance(self.algorithm, str)
        parts: dict[str, Any] = {
            "problem": {"name": problem.name, "options": dict(problem.options), "parameters": dict(problem.values)},
            "objective": asdict(problem.objective),
            "algorithm": self.algorithm if named else plain_settings(self.algorithm),
            "settings": dict(self.settings),
            "seed": self.run_seed,
        }
        if self.is_search:
            parts |= {"handling": asdict(self.handling), "stop": asdict(self.stop)}
        elif "evaluations" in setting_names(str(self.algorithm)):
            parts["stop"] = asdict(self.stop)
        elif self.stop.time_limit_s is not None:
            parts["stop"] = {"time_limit_s": self.stop.time_limit_s}
        if self.start:
            parts["start"] = dict(self.start)
        if self.polishes:
            parts["polishes"] = {"solver": self.polishes, "handling": asdict(self.handling), "stop": asdict(self.stop)}
        try:
            return json.loads(json.dumps(parts, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise InputError(f"settings of {self.title!r} must be numbers, texts and lists: {error}") from error

    def search(self) -> Algorithm:
        """Settings of the search algorithm."""
        if isinstance(self.algorithm, str):
            return metaheuristics.algorithm(self.algorithm, **self.settings)
        return self.algorithm

    def solver(self) -> Solver:
        """NLP solver with its settings and the limits that it heeds.

        Raises:
            InputError: a time limit that it cannot heed, or a setting that is not allowed.
        """
        name = str(self.algorithm)
        known = setting_names(name)
        if self.stop.time_limit_s is not None and "time_limit_s" not in known:
            raise InputError(f"{name} cannot be stopped at a time limit; leave out {name}, or the limit")
        limits = {"evaluations": self.stop.evaluations, "time_limit_s": self.stop.time_limit_s}
        heeded = {limit: value for limit, value in limits.items() if limit in known and value is not None}
        return solver(name, **{**heeded, **self.settings})


def check_task(task: Task) -> None:
    """Refuse now what would fail later: unknown problem, option, parameter, algorithm or setting; a bad label or limit."""
    problem = task.problem.load()
    for title in (task.problem.title, task.title):
        if not LABEL.fullmatch(title):
            raise InputError(
                f"a label has 1 to 64 letters, digits and . _ + : -, and begins with a letter or digit; got {title!r}"
            )
    if isinstance(task.algorithm, str) and task.algorithm not in solver_names():
        raise unknown("algorithm", task.algorithm, solver_names())
    if task.stop.time_limit_s is not None and not task.stop.time_limit_s > 0.0:
        raise InputError(f"time_limit_s must be > 0, got {task.stop.time_limit_s}")
    if not task.is_search:
        task.solver().check(problem)
    else:
        metaheuristics.handling(task.handling.name, **task.handling.settings)
        metaheuristics.check_limits(
            task.search(), task.stop.evaluations, task.stop.target, task.stop.stagnation, task.stop.time_limit_s
        )
    if task.start:
        if task.is_search:
            raise InputError(f"{task.title!r} takes no start point; NLP solvers do")
        problem.check_within(task.start)


def plain_problem(problem: GaitProblem) -> dict[str, Any]:
    """Name, options and changed parameter values of a problem, as plain data from which ``load_result`` makes it again."""
    return {"problem": problem.name, "options": dict(problem.options), "parameters": dict(problem.values)}


def plain_settings(settings: Any) -> dict[str, Any]:
    """Settings with their class name, as plain data."""
    return {"kind": type(settings).__name__, **asdict(settings)}
