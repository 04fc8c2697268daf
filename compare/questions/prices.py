"""What each limit costs the optimum, and which error of the robot data would change it most, verified by solving again."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import (
    LENGTH,
    MASS,
    NaturalStep,
    choose_natural_step,
    make_heading,
    name_in_words,
    with_unit,
)
from compare.drawing.figures import make_figure, use_style
from compare.questions.question import Answer, Question, Work, make_record_table
from compare.report.document import Figure, Part, make_text_table
from compare.study.run import ProblemSpec
from nlp_gait.backends.exact import identify_problem
from nlp_gait.backends.optima.optimum import SHARP, Optimum, find_optimum
from nlp_gait.backends.optima.sensitivities import Sensitivities, differentiate_by_models, differentiate_by_parameters
from nlp_gait.backends.solve import Continuation, find_cheapest_feasible
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Outcome
from nlp_gait.interrupts import Progress
from nlp_gait.robots.perturbation import MASS as MASS_ENDING
from nlp_gait.robots.perturbation import list_quantities, name_perturbed, split_name


def is_mass(quantity: str) -> bool:
    """Return True for a factor of masses, False for a length that is added [m]."""
    return quantity.endswith(MASS_ENDING)


def get_quantity(problem: GaitProblem, quantity: str) -> float:
    """Return the value of a quantity of the problem's robot; see ``nlp_gait.robots.perturbation``."""
    _, changes = split_name(str(problem.options["robot"]))
    return changes.get(quantity, float(is_mass(quantity)))


def perturb_robot(problem: GaitProblem, values: Mapping[str, float]) -> GaitProblem:
    """Return the problem with other values of its robot's quantities; errors in a robot's data do not move the limits."""
    name, changes = split_name(str(problem.options["robot"]))
    robot = name_perturbed(name, {**changes, **values})
    spec = ProblemSpec(name=problem.load_name, options={**problem.options, "robot": robot}, values=problem.values)
    return spec.load().with_values(**problem.parameter_values)


# A variable that moves by less than this share of its range over a natural step counts as constant.
CONSTANT = 1e-9
# Distance of the verification in natural steps; less where x* turns earlier, down to the smaller one.
CHECK_SHARE, LEAST_CHECK_SHARE = 1e-3, 1e-6
# Relative agreement of derivative and difference quotient: where x* turns in between, the quotient lies in between.
AGREEMENT = 1e-4
# Half-width of the central differences over rebuilt models: masses enter the objective almost linearly.
MASS_DIFFERENCE, LENGTH_DIFFERENCE_M = 1e-3, 1e-4
# A limit whose natural step changes the optimum by less than this share costs nothing.
FREE = 1e-9
SHOWN = 10  # bars of each kind
VERIFIED = 3  # quantities of the robot with the largest changes that are solved again
LISTED = 12  # rows of the robot's table; the CSV file has all
UP, DOWN = "#D55E00", "#0072B2"
# Unit and scale in which most bars are small numbers.
PREFIXED = {"W": ("mW", 1e3)}
EXPLANATION = (
    "The slope is the derivative of the optimum with respect to the quantity, from the multipliers; next to it are the changes "
    "found by solving again one step lower and one step higher. The line is the straight line on which x* moves, in steps of "
    "the quantity: beyond it, another kink or limit takes over."
)
OF_GAITS = " dbm is the dynamic balance margin, the distance of the zero-moment point from the edge of the soles."


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

    def __post_init__(self) -> None:
        """Restore infinite ends of the reach, which are stored as null."""
        down, up = self.reach
        reach = (-math.inf if math.isnan(down) else down, math.inf if math.isnan(up) else up)
        object.__setattr__(self, "reach", reach)  # it is frozen

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
        """Return the variable that moves most in units of its range, and its move over a natural step; None if none moves."""
        moves = self.x or {}
        name = max(moves, key=lambda variable: abs(moves[variable]) / ranges[variable], default="")
        constant = not name or abs(moves[name] * self.step) < CONSTANT * ranges[name]
        return None if constant else (name, moves[name] * self.step)


def price_parameters(optimum: Optimum) -> list[Price]:
    """Return the prices of all parameters; both bounds of a fixed variable are one, under the variable's name."""
    derivatives, problem = differentiate_by_parameters(optimum), optimum.problem
    sides = optimum.side[-len(problem.names) :]
    prices = []
    for i, (parameter, value) in enumerate(zip(problem.parameters, map(float, problem.p), strict=True)):
        stem, _, end = parameter.name.rpartition(".")
        name = parameter.name
        if stem in problem.names and problem.value(f"{stem}.lower") == problem.value(f"{stem}.upper"):
            if (sides[problem.variable_index(stem)] > 0) != (end == "upper"):
                continue
            name = stem
        step = choose_natural_step(parameter.unit, value)
        prices.append(_make_price(problem, derivatives, i, name, parameter.unit, value, step))
    return prices


def price_robot(optimum: Optimum, progress: Progress) -> tuple[Price, ...]:
    """Return the prices of the robot's masses, leg lengths and soles."""
    problem, robot = optimum.problem, optimum.problem.display.robot
    names = list_quantities(robot)  # type: ignore[arg-type]
    values = [get_quantity(problem, name) for name in names]

    def make_pairs() -> Iterator[tuple[GaitProblem, GaitProblem, float]]:
        for name, value in zip(names, values, strict=True):
            progress(f"robot with another {name}")
            half = MASS_DIFFERENCE if is_mass(name) else LENGTH_DIFFERENCE_M
            low, high = (perturb_robot(problem, {name: value + change}) for change in (-half, half))
            yield high, low, 2 * half

    derivatives = differentiate_by_models(optimum, make_pairs())
    return tuple(
        _make_price(problem, derivatives, i, name, *(("1", value, MASS) if is_mass(name) else ("m", value, LENGTH)))
        for i, (name, value) in enumerate(zip(names, values, strict=True))
    )


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


def change_robot(problem: GaitProblem, price: Price, change: float) -> GaitProblem:
    """Return the problem with another robot."""
    return perturb_robot(problem, {price.name: price.value + change})


def verify_price(optimum: Optimum, near: Outcome, price: Price, change: Callable[[float], GaitProblem | None]) -> Price:
    """Return the price with the results of solving again, slightly and a natural step away from the optimum."""
    turn = min(abs(reach) for reach in price.reach)
    small = min(CHECK_SHARE * price.step, max(turn / 2, LEAST_CHECK_SHARE * price.step))
    low, high, less, greater = (_solve_neighbour(near, change(d)) for d in (-small, small, -price.step, price.step))
    problem, sign = optimum.problem, optimum.problem.objective.sign
    steps = tuple(None if end is None else sign * end.cost - optimum.objective for end in (less, greater))
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


@dataclass(frozen=True, kw_only=True)
class FoundPrices:
    """Prices at the optimum of a problem."""

    objective: float  #: at the optimum
    x: Mapping[str, float]  #: by variable name
    limits: tuple[Price, ...]  #: parameters with a price, most expensive step first
    free: int  #: number of parameters without one
    robot: tuple[Price, ...]  #: quantities of the robot, largest change first; empty if the problem has no robot
    weak: tuple[str, ...]  #: bounds that are active without a price, or nearly active: there, derivatives are one-sided
    dependent: int  #: number of active constraints that follow from others
    residual: float  #: of the first-order conditions
    reason: str | None  #: why there are no derivatives; None if there are


@dataclass(frozen=True, kw_only=True, eq=False)
class Prices(Question[FoundPrices]):
    """What does each limit cost, and each error of the robot's masses, leg lengths and soles?"""

    name: ClassVar[str] = "prices"

    starts: int = 10  #: random starts
    seed: int = 0  #: of the starts
    solver: Solver | None = None  #: one with multipliers; its optimum is refined by IPOPT

    def find(self, work: Work) -> Iterator[FoundPrices]:
        """Yield the prices; InputError if there is no optimum, the solver has no multipliers, or the problem is too large."""
        problem = self.problem
        work.progress("solving")
        near = find_cheapest_feasible(Continuation(starts=self.starts, seed=self.seed, solver=self.solver).run(problem))
        if near is None:
            raise InputError(
                f"{problem.name}: none of {self.starts} starts converged to a feasible point, so there is nothing to "
                "differentiate; try more --starts, or relax the limits that `nlp-gait solve` names"
            )
        optimum, solver = find_optimum(problem, near), self.solver or IpoptSettings()
        effort = {"starts": self.starts, "seed": self.seed, "solver": solver.name, "settings": solver.to_dict()}
        inputs = {**identify_problem(problem), **effort}
        parameters: list[Price] = []
        robot: list[Price] = []

        def verify(price: Price, change: Callable[[GaitProblem, Price, float], GaitProblem | None]) -> Price:
            work.progress(f"solving again with another {price.name}")
            function = partial(verify_price, optimum, near, price, partial(change, problem, price))
            return work.compute(Price, "check", {**inputs, "quantity": price.name}, function)

        if optimum.reason is None:
            parameters = _rank(price_parameters(optimum))
            if problem.display.robot is not None:
                function = partial(price_robot, optimum, work.progress)
                robot = _rank(work.compute(tuple[Price, ...], "robot", inputs, function))
        limits = [price for price in parameters if abs(price.per_step) > FREE * max(abs(optimum.objective), FREE)]
        yield FoundPrices(
            objective=optimum.objective,
            x=problem.by_name(optimum.x),
            limits=tuple(verify(price, change_parameter) for price in limits),
            free=len(parameters) - len(limits),
            robot=(*(verify(price, change_robot) for price in robot[:VERIFIED]), *robot[VERIFIED:]),
            weak=optimum.weak,
            dependent=optimum.dependent,
            residual=optimum.residual,
            reason=optimum.reason,
        )

    def get_optimum(self, findings: FoundPrices) -> float:
        return findings.objective

    def report(self, findings: FoundPrices) -> Answer:
        problem, stem = self.problem, f"{self.problem.name}-prices"
        objective, ranges = problem.objective, problem.by_name(problem.scale)
        steps = (make_heading(words, objective.unit) for words in ("by the slope", "- step", "+ step"))
        header = ("quantity", "step", *steps, "error of slope, x*", "x* moves most in", "line [steps]")

        def make_table(prices: Sequence[Price], title: str) -> list[Part]:
            return [make_text_table(header, [_make_row(price, ranges) for price in prices], title)] if prices else []

        cost = "What holds it back: change of the optimum for one step upwards of a limit or coefficient"
        data = f"Which error of the robot would change it most, with unchanged limits (first {LISTED} of {len(findings.robot)})"
        parts: list[Part] = [
            *make_table(findings.limits, cost),
            f"{findings.free} other parameters cost nothing here",
            *make_table(findings.robot[:LISTED], data),
            f"The first-order conditions are satisfied to {findings.residual:.1e}; {findings.dependent} of the active "
            "constraints follow from others.",
            EXPLANATION + (OF_GAITS if problem.moves else ""),
        ]
        if findings.weak:
            parts.append(f"Active without a price, so that derivatives are one-sided: {', '.join(findings.weak)}")
        if findings.limits or findings.robot:
            shown = "Cost of one natural step of each limit, and effect of errors of the robot."
            parts.append(Figure(name=stem, caption=shown, drawing=plot_prices(findings, problem)))
        rows = [
            {"kind": kind, **vars(price), "per_step": price.per_step}
            for kind, prices in (("limit", findings.limits), ("robot", findings.robot))
            for price in prices
        ]
        about = {"objective_name": objective.name, "unit": objective.unit, "sense": objective.sense}
        return Answer(
            stem=stem,
            title=f"{problem.name}: what each limit costs",
            headline=(f"{objective.name} {with_unit(findings.objective, objective.unit)}, to {objective.sense}",),
            parts=[*parts, make_record_table(stem, rows)],
            data={"problem": problem.name, **about, **asdict(findings)},
        )


def _rank(prices: Sequence[Price]) -> list[Price]:
    return sorted(prices, key=lambda price: -abs(price.per_step))


def _make_row(price: Price, ranges: Mapping[str, float]) -> tuple[str, ...]:
    move = price.find_largest_move(ranges)
    moves = "no derivative" if price.x is None else "-" if move is None else f"{move[0]} {move[1]:+.3g}"
    down, up = (value / price.step for value in price.reach)
    steps, errors = ("-", "-"), "-"
    if price.one_step is not None:
        steps = tuple("none" if value is None else f"{value:+z.5f}" for value in price.one_step)  # type: ignore[assignment]
        errors = ", ".join("-" if error is None else f"{error:.0e}" for error in (price.error, price.x_error))
    return (price.name, price.words, f"{price.per_step:+z.5f}", *steps, errors, moves, f"{down:+.2g} to {up:+.2g}")


def plot_prices(findings: FoundPrices, problem: GaitProblem) -> Drawing:
    """Plot the effect of a natural step of each limit and of errors of the robot as bars."""
    titles = {"raising a limit": findings.limits, "another robot with the same limits": findings.robot}
    groups = {title: prices[:SHOWN] for title, prices in titles.items() if prices}
    unit, scale = PREFIXED.get(problem.objective.unit, (problem.objective.unit, 1.0))
    with use_style():
        figure = make_figure(3.6 * len(groups), 1.0 + 0.24 * max(map(len, groups.values())))
        all_axes = figure.subplots(1, len(groups), squeeze=False)[0]
        for axes, (title, prices) in zip(all_axes, groups.items(), strict=True):
            names = [f"{name_in_words(price.name, price.unit)}, {price.words}" for price in prices]
            values = [scale * price.per_step for price in prices]
            axes.barh(names, values, 0.72, color=[UP if value > 0.0 else DOWN for value in values])
            axes.invert_yaxis()
            axes.grid(visible=False, axis="y")
            axes.axvline(0.0, color="0.3", linewidth=0.6)
            axes.set(title=title, xlabel=make_heading(f"change of {problem.objective.name}", unit))
    return figure
