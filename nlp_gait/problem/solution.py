"""What a solver hands back: plain numbers and names, no solver objects."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class ActiveConstraint:
    """A bound that holds the optimum back.

    Attributes:
        name: row or variable bound, for example ``"dbm_y_mean"`` or ``"bounds[hip_height_m]"``.
        side: ``"lower"`` or ``"upper"``.
        bound: value of the bound [unit].
        unit: of the bound.
        price: change of the optimal objective per unit by which the bound is raised.
        price_unit: for example ``"W per m"``.
    """

    name: str
    side: str
    bound: float
    unit: str
    price: float
    price_unit: str


@dataclass(frozen=True, kw_only=True)
class RowViolation:
    """A violated row at the point that is reported."""

    name: str
    value: float
    lower: float
    upper: float
    violation: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class StartOutcome:
    """How one start ended.

    Attributes:
        index: number of the start.
        success: converged, and feasible for the exact functions.
        status: in words.
        objective: exact value at the end point, in the problem's sense.
        violation: exact total violation there.
        iterations: over all stages.
        time_s: wall time of the solver.
        x0: start point by variable name.
        x: end point by variable name.
    """

    index: int
    success: bool
    status: str
    objective: float
    violation: float
    iterations: int
    time_s: float
    x0: dict[str, float]
    x: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Evaluations:
    """Calls of the NLP's functions: values, gradient of the objective, Jacobian of the rows, Hessian."""

    f: int = 0
    g: int = 0
    gradient: int = 0
    jacobian: int = 0
    hessian: int = 0

    def __add__(self, other: Evaluations) -> Evaluations:
        """Sum by kind."""
        return Evaluations(**{kind: getattr(self, kind) + getattr(other, kind) for kind in asdict(self)})


@dataclass(frozen=True, kw_only=True)
class SolveTime:
    """Wall time [s]: building the symbolic NLP, generating and compiling derivatives, solving."""

    build: float
    compile: float
    solve: float


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Best of all starts, judged by the exact functions.

    Attributes:
        problem: name.
        options: what the problem was built with.
        parameters: values that differ from the defaults.
        success: at least one start converged to a point that is feasible for the exact functions.
        status: in words; if nothing converged, what stands in the way.
        objective: exact value, in the problem's sense; name and unit beside it.
        x: by variable name.
        violation: exact total violation.
        worst_violations: violated rows, worst first.
        iterations: of the start that is reported.
        evaluations: over all starts.
        time_s: over all starts.
        solver: for example ``"ipopt"``, with the linear solver that it really used.
        functions: ``"compiled"`` or ``"interpreted"``.
        active_constraints: bounds with a price, dearest first.
        starts: outcome of every start.
        seed: of the start points.
    """

    problem: str
    options: dict[str, Any]
    parameters: dict[str, float]
    success: bool
    status: str
    objective: float
    objective_name: str
    objective_unit: str
    x: dict[str, float]
    violation: float
    worst_violations: tuple[RowViolation, ...]
    iterations: int
    evaluations: Evaluations
    time_s: SolveTime
    solver: str
    linear_solver: str
    functions: str
    active_constraints: tuple[ActiveConstraint, ...]
    starts: tuple[StartOutcome, ...]
    seed: int

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, with the schema version of results."""
        return {"schema": 1, **asdict(self)}
