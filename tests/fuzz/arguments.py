"""Arguments of Python functions and answers of plug-ins, of any kind: taken for what they are, or refused in one sentence."""

from __future__ import annotations

import datetime
import random
from collections.abc import Callable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import metaheuristics as search
from metaheuristics.interface import Start
from nlp_gait import compile_objective, gaitbench, load, make_solver, solve
from nlp_gait.robots import load_robot
from tests.fuzz.trial import outcome

PROBLEM = load("walk12")
OBJECTIVE = compile_objective(PROBLEM, threads=1)
X = ((PROBLEM.lower + PROBLEM.upper) / 2).tolist()
MOST_EVALUATIONS = 1000
CALLBACKS = ("callback", "progress")
PSO = search.ParticleSwarm(population=5)


class Nameless:
    """An object that cannot even be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("no name")


LEAVES: tuple[Callable[[random.Random], Any], ...] = (
    lambda rng: None,
    lambda rng: rng.random() < 0.5,
    lambda rng: rng.choice((0, 1, -1, 2, 7, 2**31, 2**63, -(2**63) - 1, 10**40)),
    lambda rng: rng.choice((0.0, -0.0, 0.5, 1e-320, 1e308, -1e308, float("nan"), float("inf"), -float("inf"))),
    lambda rng: rng.choice(("", "walk12", "pso", "ipopt", "deb", "0.1", "nan", "\ud800", "\x00", "a/b.py:c", "x" * 10**5)),
    lambda rng: rng.choice((b"", b"2", bytearray(b"x"), memoryview(b"ab"), 1j, type, ..., NotImplemented, Nameless())),
    lambda rng: rng.choice((Path("absent"), Path("/"), Decimal("NaN"), Fraction(1, 3), datetime.date(2000, 1, 1), range(3))),
    lambda rng: rng.choice((np.float32(0.5), np.int8(1), np.bool_(True), np.datetime64("2000"), np.str_("a"), np.float64("nan"))),
    lambda rng: np.ma.masked_array(X, [True, False, False, False]),
    lambda rng: np.array(rng.choice((X, [X], [X] * 5, [], 1.0, [[[]]], ["a"], [None], [1j], [True], [2**70], [float("nan")]))),
    lambda rng: list(X),
)  # fmt: skip


def value(rng: random.Random, depth: int = 0) -> Any:
    """Any value at all."""
    if depth < 2 and rng.random() < 0.15:
        items = [value(rng, depth + 1) for _ in range(rng.randrange(4))]
        shape = rng.randrange(4)
        if shape == 0:
            return tuple(items)
        if shape == 1:
            return {rng.choice(("step_length_m", "lambda", "x", "", "name")): item for item in items}
        return iter(items) if shape == 2 else items
    return rng.choice(LEAVES)(rng)


def _minimize(**given: Any) -> Any:
    if isinstance(given["evaluations"], int) and given["evaluations"] > MOST_EVALUATIONS:
        given["evaluations"] = MOST_EVALUATIONS  # allowed, and takes as long as it says
    return search.minimize(given.pop("objective"), given.pop("algorithm"), **given)


# A call by its name, with arguments that are right.
CALLS: dict[str, tuple[Callable[..., Any], Mapping[str, Any]]] = {
    "solve": (solve, {"problem": PROBLEM, "starts": 1, "seed": 0, "x0": X, "fix": None, "solver": None, "progress": None}),
    "load": (lambda *, name, **options: load(name, **options), {"name": "walk12", "zmp": "appendix"}),
    "load robot": (lambda *, robot: load("nao-dsp", robot=robot), {"robot": "nao-v5"}),
    "robot": (lambda *, name: load_robot(name), {"name": "nao-v5"}),
    "solver": (
        lambda *, name, **s: make_solver(name, **s),
        {"name": "ipopt", "tolerance": 1e-8, "iterations": 9, "hessian": None},
    ),
    "algorithm": (lambda *, name, **s: search.make_algorithm(name, **s), {"name": "pso", "population": 9, "inertia": 0.7}),
    "handling": (lambda *, name, **s: search.make_handling(name, **s), {"name": "penalty", "weight": 1.0}),
    "compile": (compile_objective, {"problem": PROBLEM, "threads": 1, "lanes": None, "require_compiler": True}),
    "objective": (lambda *, x: OBJECTIVE(x), {"x": X}),
    "gaitbench": (lambda *, id: gaitbench.load(id), {"id": "walk12-w015"}),
    "with_values": (lambda *, v: PROBLEM.with_values(step_length_m=v), {"v": 0.1}),
    "with parameter": (lambda *, v: PROBLEM.with_values(**{"lambda": v}), {"v": 0.1}),
    "fix": (lambda *, v: PROBLEM.fix(step_length_m=v), {"v": 0.1}),
    "check_x": (lambda *, x: PROBLEM.check_x(x), {"x": X}),
    "by_name": (lambda *, name: PROBLEM.value(name), {"name": "lambda"}),
    "signals": (lambda *, x: PROBLEM.signals(x), {"x": X}),
    "minimize": (
        _minimize,
        {
            **{"objective": OBJECTIVE, "algorithm": PSO, "evaluations": 10, "seed": 0, "handling": search.Deb()},
            **{"target": None, "stagnation": None, "time_limit_s": None, "initial": None, "callback": None},
        },
    ),
}  # fmt: skip


def argument_ended(rng: random.Random) -> tuple[str, str]:
    """A call with one or two arguments of any kind, and how it ended."""
    name = rng.choice(list(CALLS))
    call, right = CALLS[name]
    given = dict(right)
    for argument in rng.sample(list(given), min(len(given), rng.choice((1, 1, 2)))):
        given[argument] = value(rng)
        if argument in CALLBACKS and callable(given[argument]):
            given[argument] = None  # what a function of the caller's own raises is the caller's
    return f"{name}({', '.join(f'{key}={_shown(item)}' for key, item in given.items())})", outcome(
        lambda: call(**given)
    )


class Plugin:
    """Objective and algorithm whose every answer may be anything."""

    name = "plug-in"

    def __init__(self, rng: random.Random, wrong: str) -> None:
        self._rng, self._wrong = rng, wrong
        self.names = self._answer("names", PROBLEM.names)
        self.lower, self.upper = self._answer("lower", PROBLEM.lower), self._answer("upper", PROBLEM.upper)
        self.population = self._answer("population", 5)

    def __call__(self, points: Any) -> Any:
        f, violation = OBJECTIVE(points)
        wrong = self._answer("answer", (f, violation))
        return wrong if wrong is not None else (self._answer("f", f), self._answer("violation", violation))

    def start(self, start: Start) -> Any:
        self._start, self._points = start, start.initial
        return self._answer("start", self)

    def ask(self) -> Any:
        return self._answer("ask", self._points)

    def tell(self, points: Any, f: Any, violation: Any, rule: Any) -> Any:
        self._points = self._start.rng.uniform(self._start.lower, self._start.upper, (5, len(self._start.lower)))
        return self._answer("tell", None)

    def stop(self) -> Any:
        return self._answer("stop", ())

    def _answer(self, place: str, right: Any) -> Any:
        return value(self._rng) if place == self._wrong else right


PLACES = ("names", "lower", "upper", "population", "answer", "f", "violation", "start", "ask", "tell", "stop")


def plugin_ended(rng: random.Random) -> tuple[str, str]:
    """Return how a search ended whose user-defined objective or algorithm returns any value."""
    place, state = rng.choice(PLACES), rng.getstate()

    def run() -> None:
        plugin = Plugin(rng, place)
        of_objective = place in ("names", "lower", "upper", "answer", "f", "violation")
        algorithm: Any = PSO if of_objective else plugin
        search.minimize(plugin if of_objective else OBJECTIVE, algorithm, evaluations=20)

    end = outcome(run)
    rng.setstate(state)
    return f"{place} {_shown(value(rng))}", end


def _shown(item: Any) -> str:
    try:
        return repr(item)[:200]
    except Exception:
        return type(item).__name__
