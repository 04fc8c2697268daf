"""Derivatives of an optimum, its objective and x*, with respect to parameters and to the model.

The objective's derivative is that of the Lagrangian at fixed x* and multipliers (envelope theorem); x* moves by the
linearised first-order conditions with the active bounds as equations (Fiacco (1983), Introduction to Sensitivity and
Stability Analysis in Nonlinear Programming, theorem 3.2.2).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nlp_gait.backends.optima.optimum import WEAK_MULTIPLIER, Optimum, build_kkt_functions, solve_kkt, to_array
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi

# Dependent active rows may contradict each other by this share of a row's change.
CONTRADICTION = 1e-6
# A bound that is approached more slowly than this per unit of a quantity is not approached.
LEAST_APPROACH = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Sensitivities:
    """Derivatives at an optimum, one column for each quantity."""

    objective: Array  #: (k,) of the optimal objective, in the problem's sense
    x: Array  #: (n, k) of x*
    defined: Array  #: (k,) False where dependent active bounds contradict each other: no derivative exists
    #: (2, k) change of the quantity, down (<= 0) and up, at which, to first order, the next bound becomes active or is released
    reach: Array


class _Change(NamedTuple):
    """Derivatives of cost, rows, their bounds and gradient of L at fixed w and multipliers, one column for each quantity."""

    cost: Array
    values: Array
    lower: Array
    upper: Array
    gradient: Array


@lock_casadi
def differentiate_by_parameters(optimum: Optimum) -> Sensitivities:
    """Return derivatives with respect to all parameters, in their order and units; InputError if there are none."""
    _require_derivatives(optimum)
    jacobians = optimum.functions.by_parameters(optimum.w, optimum.parameters, optimum.multipliers)
    cost, *changes = (np.array(jacobian)[:, :-1] for jacobian in jacobians)  # the last one is the sigmoid's width
    return _differentiate(optimum, _Change(cost[0], *changes))


@lock_casadi
def differentiate_by_models(optimum: Optimum, pairs: Iterable[tuple[GaitProblem, GaitProblem, float]]) -> Sensitivities:
    """Return derivatives with respect to the data of the model, for example a robot's masses.

    They are central differences of the Lagrangian, its gradient and the rows, at fixed x*, multipliers and parameter values: the
    problems are evaluated, not solved, and not at their own parameter values. A pair consists of the problem with more of a
    quantity, the problem with less of it, and the difference. Raises InputError if there are none, or for other constraints.
    """
    _require_derivatives(optimum)
    columns = []
    for larger, smaller, difference in pairs:
        high, low = (_evaluate(optimum, problem) for problem in (larger, smaller))
        columns.append([(a - b) / difference for a, b in zip(high, low, strict=True)])
    cost, *changes = (np.array(column).T for column in zip(*columns, strict=True))
    return _differentiate(optimum, _Change(cost, *changes))


def _evaluate(optimum: Optimum, problem: GaitProblem) -> _Change:
    """Evaluate another model at the same x, multipliers and parameter values."""
    functions = build_kkt_functions(problem)
    model, changed, n = optimum.functions.model, functions.model, optimum.functions.model.variables
    if model.row_names != changed.row_names or model.lifted != changed.lifted:
        raise InputError(f"{problem.name}: the other model has other constraints; sensitivities need the same ones")
    ratio = model.scale / changed.scale  # its variables may be scaled to another range
    w, lam = optimum.w.copy(), optimum.multipliers.copy()
    w[:n] = (optimum.x - changed.offset) / changed.scale
    lam[-n:] /= ratio
    cost, values, lower, upper = (to_array(array) for array in functions.values(w, optimum.parameters))
    gradient = to_array(functions.gradient(w, optimum.parameters, lam))
    gradient[:n] *= ratio
    for array in (values, lower, upper):  # x and its bounds are the same
        array[-n:] = 0.0
        array[~np.isfinite(array)] = 0.0
    return _Change(cost[0], values, lower, upper, gradient)


def _differentiate(optimum: Optimum, change: _Change) -> Sensitivities:
    model, side, active = optimum.functions.model, optimum.side, optimum.active
    hessian, jacobian = optimum.matrices
    shift = (change.values - np.where(side[:, None] > 0, change.upper, change.lower))[active]
    step = solve_kkt(hessian, jacobian[active], -change.gradient, -shift, model.variables)
    return Sensitivities(
        objective=optimum.problem.objective.sign * (change.cost + optimum.multipliers[active] @ shift),
        x=model.scale[:, None] * step.w[: model.variables],
        defined=step.inconsistent <= CONTRADICTION * np.maximum(1.0, np.abs(shift).max(axis=0, initial=0.0)),
        reach=_find_reach(optimum, change, jacobian @ step.w, step.multipliers),
    )


def _find_reach(optimum: Optimum, change: _Change, moved: Array, multipliers: Array) -> Array:
    """Return how far each quantity may change, down and up, before the set of active bounds changes.

    ``moved`` (m, k) is the change of the rows by the change of w, ``multipliers`` (a, k) that of the active rows' multipliers.
    """
    values, lower, upper = optimum.rows
    inactive, active = optimum.side == 0, optimum.active
    priced = np.abs(optimum.multipliers[active]) > WEAK_MULTIPLIER
    side = optimum.side[active]
    rate = change.values + moved
    prices = (optimum.multipliers[active] * side)[priced]
    room = [(upper - values)[inactive], (values - lower)[inactive], prices]
    falls = -(side[:, None] * multipliers)[priced]
    shrinks = [(rate - change.upper)[inactive], (change.lower - rate)[inactive], falls]
    distance, speed = np.maximum(np.concatenate(room), 0.0)[:, None], np.concatenate(shrinks)
    with np.errstate(divide="ignore", invalid="ignore"):
        change_at_bound = np.where(np.abs(speed) > LEAST_APPROACH, distance / speed, np.inf)
    up = np.where(change_at_bound > 0.0, change_at_bound, np.inf).min(axis=0, initial=np.inf)
    down = np.where(change_at_bound < 0.0, change_at_bound, -np.inf).max(axis=0, initial=-np.inf)
    return np.array([down, up])


def _require_derivatives(optimum: Optimum) -> None:
    if optimum.reason is not None:
        raise InputError(f"{optimum.problem.name}: no sensitivities at this point: {optimum.reason}")
