"""Prices of an optimum: derivatives with respect to parameters and the robot's data, verified by solving again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from compare.analysis.units import LENGTH, MASS, NaturalStep, choose_natural_step
from compare.questions.perturbed_problem import get_quantity, is_mass, perturb_robot
from nlp_gait.backends.optima.optimum import SHARP, Optimum
from nlp_gait.backends.optima.sensitivities import Sensitivities, model_sensitivities, parameter_sensitivities
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Outcome
from nlp_gait.progress import Progress
from nlp_gait.robots.perturbation import quantities

# A variable that moves by less than this share of its range over a natural step counts as constant.
CONSTANT = 1e-9
# Distance of the verification in natural steps; less where x* turns earlier, down to the smaller one.
CHECK_SHARE, LEAST_CHECK_SHARE = 1e-3, 1e-6
# Relative agreement of derivative and difference quotient: where x* turns in between, the quotient lies in between.
AGREEMENT = 1e-4
# Half-width of the central differences over rebuilt models: masses enter the objective almost linearly.
MASS_DIFFERENCE, LENGTH_DIFFERENCE_M = 1e-3, 1e-4


@dataclass(frozen=True, kw_only=True)
class Price:
    """Effect of a change of one quantity on the optimum."""

    name: str  #: of the parameter, or of the robot's quantity
    unit: str  #: of the quantity; ``"1"`` for a factor
    value: float  #: its current value, 0 for a length that is added
    slope: float  #: derivative of the optimal objective
    step: float  #: natural step [unit]
    words: str  #: the step in words, for example ``"1 mm"``
    reach: tuple[float, float]  #: how far the quantity may change, down and up, while x* moves along one line
    #: derivative of x* by variable name; None where dependent bounds contradict each other
    x: Mapping[str, float] | None
    resolved: float | None = None  #: the slope by solving again slightly lower and higher; None without verification
    #: largest difference of ``x`` from solving again, in units of its largest entry; None without verification
    x_error: float | None = None
    #: change of the objective by solving again a natural step lower and higher; None where that failed
    one_step: tuple[float | None, float | None] | None = None

    @property
    def per_step(self) -> float:
        """Change of the objective over a natural step, by the slope."""
        return self.slope * self.step

    @property
    def error(self) -> float | None:
        """Relative difference of the slope from solving again."""
        if self.resolved is None:
            return None
        return abs(self.resolved - self.slope) / max(abs(self.slope), abs(self.resolved))

    def find_largest_move(self, ranges: Mapping[str, float]) -> tuple[str, float] | None:
        """Return the variable that moves most in units of its range, and its move over a natural step; None if there is none."""
        moves = self.x or {}
        name = max(moves, key=lambda variable: abs(moves[variable]) / ranges[variable], default="")
        constant = not name or abs(moves[name] * self.step) < CONSTANT * ranges[name]
        return None if constant else (name, moves[name] * self.step)

    def to_json(self) -> dict[str, Any]:
        """Return plain data without loss: the reach as text, because JSON has no infinity."""
        return {**asdict(self), "reach": [repr(end) for end in self.reach]}


def parse_price(raw: Mapping[str, Any]) -> Price:
    """Return the price of ``Price.to_json``."""
    return decode(Price, {**raw, "reach": [float(end) for end in raw["reach"]]})


def price_parameters(optimum: Optimum) -> list[Price]:
    """Return the prices of all parameters; both bounds of a fixed variable are one, under the variable's name."""
    derivatives, problem = parameter_sensitivities(optimum), optimum.problem
    sides = optimum.side[-len(problem.names) :]
    prices = []
    for i, (parameter, value) in enumerate(zip(problem.parameters, map(float, problem.p), strict=True)):
        stem, _, end = parameter.name.rpartition(".")
        name = parameter.name
        if stem in problem.names and problem.value(f"{stem}.lower") == problem.value(f"{stem}.upper"):
            if (sides[problem.variable_index(stem)] > 0) != (end == "upper"):
                continue
            name = stem
        prices.append(
            _make_price(problem, derivatives, i, name, parameter.unit, value, choose_natural_step(parameter, value))
        )
    return prices


def price_robot(optimum: Optimum, progress: Progress) -> list[Price]:
    """Return the prices of the robot's masses, leg lengths and soles."""
    problem, robot = optimum.problem, optimum.problem.display.robot
    names = quantities(robot)  # type: ignore[arg-type]
    values = [get_quantity(problem, name) for name in names]

    def make_pairs() -> Iterator[tuple[GaitProblem, GaitProblem, float]]:
        for name, value in zip(names, values, strict=True):
            progress(f"robot with another {name}")
            half = MASS_DIFFERENCE if is_mass(name) else LENGTH_DIFFERENCE_M
            low, high = (perturb_robot(problem, {name: value + change}) for change in (-half, half))
            yield high, low, 2 * half

    derivatives = model_sensitivities(optimum, make_pairs())
    return [
        _make_price(problem, derivatives, i, name, *(("1", value, MASS) if is_mass(name) else ("m", value, LENGTH)))
        for i, (name, value) in enumerate(zip(names, values, strict=True))
    ]


def _make_price(
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


def change_parameter(problem: GaitProblem, price: Price, change: float) -> GaitProblem | None:
    """Return the problem with a changed parameter; None if the value is not allowed."""
    ends = [f"{price.name}.{end}" for end in ("lower", "upper")] if price.name in problem.names else [price.name]
    try:
        return problem.with_values(**dict.fromkeys(ends, price.value + change))
    except InputError:
        return None


def verify_price(optimum: Optimum, near: Outcome, price: Price, change: Callable[[float], GaitProblem | None]) -> Price:
    """Return the price with the results of solving again, slightly and a natural step away from the optimum."""
    turn = min(abs(reach) for reach in price.reach)
    small = min(CHECK_SHARE * price.step, max(turn / 2, LEAST_CHECK_SHARE * price.step))
    low, high, less, more = (_solve_neighbour(near, change(d)) for d in (-small, small, -price.step, price.step))
    problem, sign = optimum.problem, optimum.problem.objective.sign
    steps = tuple(None if end is None else sign * end.cost - optimum.objective for end in (less, more))
    verified = replace(price, one_step=(steps[0], steps[1]))
    if low is None or high is None:
        return verified
    resolved = sign * (high.cost - low.cost) / (2 * small)
    return replace(verified, resolved=resolved, x_error=_compute_x_error(problem, price, low, high, small))


def _compute_x_error(problem: GaitProblem, price: Price, low: Outcome, high: Outcome, small: float) -> float | None:
    if price.x is None:
        return None
    expected = np.array(list(price.x.values())) / problem.scale
    largest = np.abs(expected).max()
    if largest * price.step < CONSTANT:
        return None
    return float(np.abs((high.x - low.x) / (2 * small) / problem.scale - expected).max() / largest)


def _solve_neighbour(near: Outcome, problem: GaitProblem | None) -> Outcome | None:
    """Return the optimum of a neighbouring problem; None if there is no problem or IPOPT fails."""
    if problem is None:
        return None
    end = SHARP.run_from(problem, near)
    if end is None or not end.converged:
        end = SHARP.run(problem, np.clip(near.x, problem.lower, problem.upper))
    return end if end.converged else None
