"""What holds an optimum back, and which error of the model would change it most: derivatives, checked by solving again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from compare.analysis.natural_steps import LENGTH, MASS, NaturalStep, choose_natural_step
from compare.questions.other_robot import is_mass, present_value, with_robot
from compare.questions.prices.price import STANDS, Price, Prices, price_from
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import ProblemSpec
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.optima.continuation import Continuation, find_cheapest_feasible
from nlp_gait.backends.optima.optimum import SHARP, Optimum, find_optimum
from nlp_gait.backends.optima.sensitivities import Sensitivities, model_sensitivities, parameter_sensitivities
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Outcome
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.robots import Robot
from nlp_gait.robots.perturbation import quantities

# A limit whose natural step changes the optimum by less than this share of it costs nothing.
FREE = 1e-9
# The check solves again this share of a natural step away, less where x* turns before, down to the smaller one.
CHECK_SHARE, LEAST_CHECK_SHARE = 1e-3, 1e-6
# Derivative and difference quotient agree to this, relative: where x* turns on the way the quotient is in between.
AGREEMENT = 1e-4
# Half-width of the central differences over rebuilt models: masses enter the objective almost linearly.
MASS_DIFFERENCE, LENGTH_DIFFERENCE_M = 1e-3, 1e-4


class _StoredPrices(NamedTuple):
    """Prices that take seconds, in steps: those of the whole robot, and what solving again says of each."""

    store: Store
    inputs: dict[str, Any]
    progress: Progress

    def of_robot(self, compute: Callable[[], list[Price]]) -> list[Price]:
        raw = self.store.compute("robot-{key}", self.inputs, lambda: [price.plain() for price in compute()])
        return [price_from(price) for price in raw]

    def checked(self, base: Solved, price: Price, changed: Callable[[float], GaitProblem | None]) -> Price:
        def compute() -> dict[str, Any]:
            self.progress(f"solving again with another {price.name}")
            return _checked(base, price, changed).plain()

        return price_from(self.store.compute("check-{key}", {**self.inputs, "quantity": price.name}, compute))


class Solved(NamedTuple):
    """An optimum with the outcome near it, from which neighbours are solved."""

    near: Outcome
    optimum: Optimum


def solved(problem: GaitProblem, starts: int, seed: int, solver: Solver | None = None) -> Solved:
    """Best optimum from random starts, to machine precision.

    Raises:
        InputError: none converged to a feasible point, the solver gives no multipliers, or the problem is too large.
    """
    near = find_cheapest_feasible(Continuation(starts=starts, seed=seed, solver=solver).run(problem))
    if near is None:
        raise InputError(
            f"{problem.name}: none of {starts} starts converged to a feasible point, so there is nothing to differentiate; "
            "try more --starts, or relax the limits that `nlp-gait solve` names"
        )
    return Solved(near, find_optimum(problem, near))


def prices(
    spec: ProblemSpec,
    *,
    starts: int = 10,
    seed: int = 0,
    checks: int = 3,
    solver: Solver | None = None,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> Prices:
    """Prices of all parameters and, where a robot can be chosen, of its masses, leg lengths and soles.

    Args:
        spec: the problem.
        starts: random starts.
        seed: of the starts.
        checks: how many of the robot's quantities, largest change first, are checked by solving again; all parameters are.
        solver: one that gives multipliers; None for IPOPT, which in any case sharpens what was found.
        store: of finished results; None stores nothing.
        progress: told each step when it begins.

    Raises:
        InputError: no optimum was found, the solver gives no multipliers, or the problem is too large.
    """
    problem = spec.load()
    store, chosen = store or Store(), solver or IpoptSettings()
    asked = {"starts": starts, "seed": seed, "solver": chosen.name, "settings": chosen.to_dict()}
    store.report_changes("prices", problem, **asked, checks=checks)
    kept = _StoredPrices(store, {**fingerprint(problem), **asked}, progress)
    progress("solving")
    base = solved(problem, starts, seed, store_runs(store, chosen))
    found = base.optimum
    limits, free = list[Price](), 0
    robot: list[Price] = []
    if found.reason is None:
        every = _ranked(_parameter_prices(found))
        limits = [price for price in every if abs(price.per_step) > FREE * max(abs(found.objective), FREE)]
        free = len(every) - len(limits)
        limits = [kept.checked(base, price, partial(_moved, problem, price)) for price in limits]
        if problem.display.robot is not None:
            robot = _ranked(kept.of_robot(partial(_robot_prices, spec, found, problem.display.robot, progress)))
            robot[:checks] = [
                kept.checked(base, price, partial(_with_changed_robot, spec, price)) for price in robot[:checks]
            ]
    return Prices(
        problem=problem.name,
        objective_name=problem.objective.name,
        unit=problem.objective.unit,
        sense=problem.objective.sense,
        objective=found.objective,
        x=problem.by_name(found.x),
        limits=tuple(limits),
        free=free,
        robot=tuple(robot),
        weak=found.weak,
        dependent=found.dependent,
        residual=found.residual,
        reason=found.reason,
    )


def _parameter_prices(found: Optimum) -> list[Price]:
    """Prices of all parameters; both bounds of a fixed variable are one, under the variable's name."""
    derivatives, problem = parameter_sensitivities(found), found.problem
    sides = found.side[-len(problem.names) :]
    prices = []
    for i, (q, value) in enumerate(zip(problem.parameters, map(float, problem.p), strict=True)):
        stem, _, end = q.name.rpartition(".")
        name = q.name
        if stem in problem.names and problem.value(f"{stem}.lower") == problem.value(f"{stem}.upper"):
            if (sides[problem.variable_index(stem)] > 0) != (end == "upper"):
                continue
            name = stem
        prices.append(_price(problem, derivatives, i, name, q.unit, value, choose_natural_step(q, value)))
    return prices


def _robot_prices(spec: ProblemSpec, found: Optimum, robot: Robot, progress: Progress) -> list[Price]:
    names = quantities(robot)
    values = [present_value(found.problem, name) for name in names]

    def pairs() -> Iterator[tuple[GaitProblem, GaitProblem, float]]:
        for name, value in zip(names, values, strict=True):
            progress(f"robot with another {name}")
            half = MASS_DIFFERENCE if is_mass(name) else LENGTH_DIFFERENCE_M
            yield with_robot(spec, {name: value + half}), with_robot(spec, {name: value - half}), 2 * half

    derivatives = model_sensitivities(found, pairs())
    return [
        _price(found.problem, derivatives, i, name, *(("1", value, MASS) if is_mass(name) else ("m", value, LENGTH)))
        for i, (name, value) in enumerate(zip(names, values, strict=True))
    ]


def _price(
    problem: GaitProblem, derivatives: Sensitivities, i: int, name: str, unit: str, value: float, step: NaturalStep
) -> Price:
    return Price(
        name=name,
        unit=unit,
        value=value,
        slope=float(derivatives.objective[i]),
        step=step.size,
        words=step.words,
        reach=(float(derivatives.reach[0, i]), float(derivatives.reach[1, i])),
        x=problem.by_name(derivatives.x[:, i]) if derivatives.defined[i] else None,
    )


def _ranked(found: Sequence[Price]) -> list[Price]:
    return sorted(found, key=lambda price: -abs(price.per_step))


def _moved(problem: GaitProblem, price: Price, change: float) -> GaitProblem | None:
    """The problem with a parameter changed, or None where that is not allowed."""
    ends = [f"{price.name}.{end}" for end in ("lower", "upper")] if price.name in problem.names else [price.name]
    try:
        return problem.with_values(**dict.fromkeys(ends, price.value + change))
    except InputError:
        return None


def _with_changed_robot(spec: ProblemSpec, price: Price, change: float) -> GaitProblem:
    return with_robot(spec, {price.name: price.value + change})


def _checked(base: Solved, price: Price, changed: Callable[[float], GaitProblem | None]) -> Price:
    """A price with what solving again says, from the unchanged optimum, a little and a natural step away."""
    turn = min(abs(reach) for reach in price.reach)
    small = min(CHECK_SHARE * price.step, max(turn / 2, LEAST_CHECK_SHARE * price.step))
    low, high, less, more = (_neighbour(base, changed(d)) for d in (-small, small, -price.step, price.step))
    problem, objective = base.optimum.problem, base.optimum.objective
    sign = problem.objective.sign
    steps = tuple(None if end is None else sign * end.cost - objective for end in (less, more))
    checked = replace(price, one_step=(steps[0], steps[1]))
    if low is None or high is None:
        return checked
    return replace(
        checked,
        resolved=sign * (high.cost - low.cost) / (2 * small),
        x_error=_x_error(problem, price, low, high, small),
    )


def _x_error(problem: GaitProblem, price: Price, low: Outcome, high: Outcome, small: float) -> float | None:
    if price.x is None:
        return None
    expected = np.array(list(price.x.values())) / problem.scale
    largest = np.abs(expected).max()
    if largest * price.step < STANDS:
        return None
    return float(np.abs((high.x - low.x) / (2 * small) / problem.scale - expected).max() / largest)


def _neighbour(base: Solved, problem: GaitProblem | None) -> Outcome | None:
    """Optimum of a neighbour, None if there is none or IPOPT does not get there."""
    if problem is None:
        return None
    end = SHARP.run_from(problem, base.near)
    if end is None or not end.converged:
        end = SHARP.run(problem, np.clip(base.near.x, problem.lower, problem.upper))
    return end if end.converged else None
