"""Results of solvers, and a point that was read from the file of `solve --out` or a few lines by hand; its signals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError, check_count
from nlp_gait.files import read_json
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.formulation.registry import load, resolve_stored
from nlp_gait.formulation.signals import Array, Signals

# A total violation below this counts as feasible (each row in units of its scale).
FEASIBILITY_TOLERANCE = 1e-6
# Fields of an outcome in the file of a result.
WRITTEN = ("claimed", "feasible", "status", "objective", "violation", "iterations", "time_s")


@dataclass(frozen=True, kw_only=True)
class ActiveConstraint:
    """An active bound."""

    name: str  #: row or variable bound, for example ``"dbm_y_mean"`` or ``"bounds[hip_height_m]"``
    side: str  #: ``"lower"`` or ``"upper"``
    bound: float  #: value of the bound [unit]
    unit: str  #: of the bound
    price: float  #: change of the optimal objective per unit of the bound
    price_unit: str  #: for example ``"W per m"``


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstraintValue:
    """Value of one constraint at a point; a missing bound is None."""

    name: str
    value: float
    lower: float | None
    upper: float | None
    violation: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Evaluations:
    """Calls of the NLP's functions: values, gradient of the objective, Jacobian of the rows, Hessian."""

    f: int = 0
    g: int = 0
    gradient: int = 0
    jacobian: int = 0
    hessian: int = 0

    def __add__(self, added: Evaluations) -> Evaluations:
        """Sum by kind."""
        return Evaluations(**{kind: getattr(self, kind) + getattr(added, kind) for kind in asdict(self)})

    def by_kind(self) -> dict[str, int]:
        """Return counts by kind; only f for a solver that calls nothing else."""
        return {"f": self.f} if self == Evaluations(f=self.f) else asdict(self)


@dataclass(frozen=True, kw_only=True)
class SolveTime:
    """Wall time [s]: building the symbolic NLP, generating and compiling derivatives, solving."""

    build: float
    compile: float
    solve: float


class Best(NamedTuple):
    """Best point after a number of calls: its objective, None before the first feasible point, and the time [s]."""

    calls: int
    objective: float | None
    time_s: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Guess:
    """Primal and dual point of the lifted NLP, for a warm start of a neighbouring problem."""

    primal: Array  # scaled variables, then the lifted ones
    bounds: Array  # multipliers of their bounds, positive at an upper bound
    rows: Array  # multipliers of all rows, those of the problem first
    width: float  # sigmoid width of that NLP


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """One run of an NLP solver from one start point."""

    solver: str  #: its name
    x0: Array  #: (n,) start point
    x: Array  #: (n,) end point, within the bounds
    claimed: bool  #: the solver claims a solution
    status: str  #: reason why it ended
    objective: float  #: exact value at x, in the problem's sense
    cost: float  #: the minimised value, negated if the problem maximises the objective
    violation: float  #: exact total violation at x
    iterations: int  #: over all stages, if the solver counts them
    evaluations: Evaluations  #: over all stages
    time_s: float  #: wall time of the run itself [s]
    build_s: float = 0.0  #: time to build the symbolic NLP, also if an earlier run built it [s]
    #: Time to make the solver, with derivatives and their compilation, also if an earlier run did [s]
    compile_s: float = 0.0
    functions: str = "interpreted"  #: ``"compiled"`` or ``"interpreted"``
    linear_solver: str = ""  #: used by the solver, if it reports it
    guess: Guess | None = None  #: warm start with multipliers, if the solver has one
    history: tuple[Best, ...] = ()  #: best so far, if the solver records it
    objective_s: float = math.nan  #: part of the time in the exact functions, NaN if unknown [s]

    @property
    def feasible(self) -> bool:
        """Whether the exact functions find it feasible, with a finite cost."""
        return self.violation <= FEASIBILITY_TOLERANCE and math.isfinite(self.cost)

    @property
    def converged(self) -> bool:
        """Whether the solver claims a solution and the exact functions find it feasible."""
        return self.claimed and self.feasible

    @property
    def rank(self) -> tuple[float, float]:
        """Smaller is better: converged runs by cost, then feasible ones by cost, then the rest by violation."""
        if self.feasible:
            return (0.0 if self.converged else 1.0), self.cost
        return 2.0, math.inf if math.isnan(self.violation) else self.violation


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Solution:
    """All starts of a problem, of which the best one is the solution."""

    problem: GaitProblem  #: with its parameter values
    starts: tuple[Outcome, ...]  #: outcome of every start
    seed: int  #: of the start points
    status: str  #: reason why the best start ended, and the obstacle if none converged
    worst_violations: tuple[ConstraintValue, ...]  #: violated rows of the best start, worst first
    active_constraints: tuple[ActiveConstraint, ...]  #: bounds with a price, highest first

    @cached_property
    def best(self) -> Outcome:
        """The cheapest start that converged, else the cheapest feasible, else the least infeasible."""
        return min(self.starts, key=lambda outcome: outcome.rank)

    @property
    def objective(self) -> float:
        """Exact value of the best start, in the problem's sense."""
        return self.best.objective

    @property
    def x(self) -> dict[str, float]:
        """End of the best start by variable name."""
        return self.problem.by_name(self.best.x)

    @property
    def feasible(self) -> bool:
        """Whether the exact functions find x feasible, with a finite objective."""
        return self.best.feasible

    @property
    def converged(self) -> bool:
        """Whether the best start converged to a feasible point: claimed by the solver, and feasible for the exact functions."""
        return self.best.converged

    @property
    def evaluations(self) -> Evaluations:
        """Calls over all starts."""
        return sum((outcome.evaluations for outcome in self.starts), Evaluations())

    @property
    def time_s(self) -> SolveTime:
        """Wall time over all starts [s]."""
        solve_s = sum(outcome.time_s for outcome in self.starts)
        return SolveTime(build=self.best.build_s, compile=self.best.compile_s, solve=solve_s)

    def __repr__(self) -> str:
        goal = self.problem.objective
        value = f"{goal.name} {self.objective:.6g} {goal.unit}" if self.feasible else "infeasible"
        counts = f"{sum(start.converged for start in self.starts)} of {len(self.starts)} starts"
        return f"<Solution of {self.problem.load_name}: {value}; {counts} of {self.best.solver} converged>"

    def signals(self) -> Signals:
        """Return time histories at x; raises InputError if the problem has none."""
        return self.problem.signals(self.best.x)

    def plot(self) -> Any:
        """Plot the gait with Matplotlib: stick figures, power and balance margin; raises as ``signals``."""
        from compare.drawing.gait_figure import plot_gait

        return plot_gait(self.problem, self.x, self.best.solver)

    def animate(self) -> Any:
        """Return a page that plays the gait in 3-D, with power and margin, for notebooks; ``write`` saves it. See ``plot``."""
        from compare.report.interactive import animate_gait

        return animate_gait(self.problem, self.x, self.best.solver)

    def to_json(self) -> dict[str, Any]:
        """Return plain dictionaries, lists and numbers, with the schema version of results."""
        problem, best = self.problem, self.best
        starts = [
            {
                "index": index,
                **{name: getattr(start, name) for name in WRITTEN},
                "x0": problem.by_name(start.x0),
                "x": problem.by_name(start.x),
            }
            for index, start in enumerate(self.starts)
        ]
        return {
            "schema": 1,
            "problem": problem.load_name,
            "options": dict(problem.options),
            "parameters": dict(problem.values),
            "objective_name": problem.objective.name,
            "objective_unit": problem.objective.unit,
            **{name: getattr(best, name) for name in (*WRITTEN, "solver", "linear_solver", "functions")},
            "status": self.status,
            "x": self.x,
            "worst_violations": [asdict(row) for row in self.worst_violations],
            "active_constraints": [asdict(bound) for bound in self.active_constraints],
            "evaluations": asdict(self.evaluations),
            "time_s": asdict(self.time_s),
            "seed": self.seed,
            "starts": starts,
        }


SCHEMA = 1  # of a result, and the default
SHORTEST_S, LONGEST_S = 0.001, 300.0  # of a gait; a step takes a second
AT_REST = 1e-6  # largest rate of a joint that stands still [rad/s]
ROUNDING = 1e-6  # of the number of periods: rounding must not add a row
FINE_INTERVALS = 500  # of a grid that splines are fitted to: angles are exact to 2e-5 rad, next to a switch of phases


@dataclass(frozen=True, kw_only=True)
class StoredProblem:
    """A problem in a certificate or another stored result."""

    name: str  # argument of ``load``
    options: Mapping[str, str | int | float | bool]  # of its maker
    parameters: Mapping[str, float]  # that differ from the defaults
    mathematics: int = 1  # version of the formulas
    files: Mapping[str, str] = field(default_factory=dict)  # hashes of the user's files that it was made of


@dataclass(frozen=True, kw_only=True)
class _ResultFile:
    """Keys of a result that are read; only two are required."""

    schema: Literal[1] = 1
    problem: str
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    robot: str | None = None
    x: Mapping[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Result:
    """A point of a problem."""

    problem: GaitProblem  #: with the options and parameter values that it was solved with
    x: Array  #: (n,) decision variables


def load_result(path: Path) -> Result:
    """Return the result in a JSON object with ``problem``, ``x`` by variable name and optional ``options``, ``parameters``.

    Raises InputError for a file that cannot be read or is damaged, and for values that the problem does not allow.
    """
    raw = read_json(path, "result")
    owner = f"result {str(path)!r}"
    try:
        file = decode(_ResultFile, raw, ignore_unknown=True)
        name, options = resolve_stored(file.problem, file.options, "it")
        problem = load(name, **options).with_values(**file.parameters)
        result = Result(problem=problem, x=problem.check_x(file.x))
        if file.robot not in (None, result.problem.options.get("robot")):
            raise InputError(f"'robot' is {file.robot!r}, but the option of that name decides: write it into 'options'")
    except ValueError as error:
        raise InputError(f"{owner}: {error}; `nlp-gait solve ... --out FILE` writes a valid one") from error
    except GaitError as error:
        raise InputError(f"{owner}: {error}") from error
    return result


def sample_signals(result: Result, period_s: float) -> Signals:
    """Return signals on the problem's grid, whose intervals are halved until neighbouring samples are at most a period apart.

    Raises InputError if there are no signals, the period is not positive, or time runs backwards or lasts too long.
    """
    if not period_s > 0.0:  # NaN fails too
        raise InputError(f"the time between samples must be > 0 s, got {period_s!r}")
    return _refine(result, _compute_signals(result), period_s)


def _compute_signals(result: Result) -> Signals:
    """Return signals on the problem's grid; raises as ``sample_signals``."""
    signals = result.problem.signals(result.x)
    times = signals.arrays["t"]
    with np.errstate(over="ignore", invalid="ignore"):
        duration_s = float(times[-1] - times[0])
        forward = bool((times[1:] >= times[:-1]).all())  # NaN fails too
    if not (forward and SHORTEST_S <= duration_s <= LONGEST_S):
        reason = f"it lasts {duration_s:g} s" if forward or duration_s < 0.0 else "time runs backwards in one phase"
        limits = f"{SHORTEST_S:g} to {LONGEST_S:g} s"
        raise InputError(f"a gait that is drawn, simulated or exported must last {limits}, but {reason}")
    return signals


def _refine(result: Result, signals: Signals, period_s: float) -> Signals:
    longest = float(np.diff(signals.arrays["t"]).max())
    factor = 1
    while longest > factor * period_s * (1.0 + 1e-9):  # rounding must not halve a step that equals the period
        factor *= 2  # few different grids, each of which is built once
    dense = result.problem.dense(factor) if factor > 1 else None
    return signals if dense is None else dense.signals(result.x)


def sample_finely(result: Result) -> Signals:
    """Return signals with ``FINE_INTERVALS`` intervals a step if the problem can be refined; raises as ``sample_signals``."""
    signals = _compute_signals(result)
    steps = max(1, len(result.problem.display.durations) // 2)
    return _refine(result, signals, float(signals.arrays["t"][-1]) / FINE_INTERVALS / steps)


def sample_at_period(result: Result, period_ms: int) -> Signals:
    """Return signals exactly a period apart, of all whole periods; of a motion that ends at rest, of the begun one, too.

    Between fine samples all but angles are linear, so that torques do not overshoot where a foot lands. Raises as
    ``sample_signals``, and InputError for a period that is not a whole number of milliseconds >= 1.
    """
    check_count("period_ms", period_ms)
    signals = _compute_signals(result)
    fine = _refine(result, signals, min(period_ms / 1000.0, float(signals.arrays["t"][-1]) / FINE_INTERVALS))
    count = 1000.0 * float(fine.arrays["t"][-1]) / period_ms
    rests = "qd" in fine.arrays and bool(np.abs(fine.arrays["qd"][-1]).max() < AT_REST)
    periods = max(1, math.ceil(count - ROUNDING) if rests else math.floor(count + ROUNDING))
    t = np.arange(periods + 1) * period_ms / 1000.0
    arrays = {"t": t}
    for name, values in fine.arrays.items():
        if name == "q" and "qd" in fine.arrays:
            arrays[name] = _interpolate_angles(fine, t)
        elif name != "t":
            columns = values.reshape(len(values), -1).T
            interpolated = np.stack([np.interp(t, fine.arrays["t"], column) for column in columns], axis=1)
            arrays[name] = np.round(interpolated) if np.isin(values, (0.0, 1.0)).all() else interpolated
    return replace(fine, arrays=arrays)


def _interpolate_angles(fine: Signals, t: Array) -> Array:
    """Return angles (T, J) at times (T,) by cubics between fine samples and their rates, so that differences are smooth."""
    from scipy.interpolate import CubicHermiteSpline  # takes longer to import than everything else

    times, first = np.unique(fine.arrays["t"], return_index=True)
    angles = CubicHermiteSpline(times, fine.arrays["q"][first], fine.arrays["qd"][first])
    return np.asarray(angles(np.minimum(t, times[-1])))
