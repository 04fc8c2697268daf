"""Results of solvers."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from nlp_gait.formulation.signals import Array, Signals

if TYPE_CHECKING:
    from nlp_gait.formulation.gait_problem import GaitProblem

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
        return f"<Solution of {self.problem.address}: {value}; {counts} of {self.best.solver} converged>"

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
            "problem": problem.address,
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
