"""Solve a problem's NLP with IPOPT from several starts, and judge every end point by the exact functions."""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from nlp_gait.backends.exact import ExactModel, exact_model
from nlp_gait.backends.nlp import NlpModel, nlp_model
from nlp_gait.backends.solution import (
    ActiveConstraint,
    Evaluations,
    RowViolation,
    Solution,
    SolveTime,
    StartOutcome,
)
from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import Array, GaitProblem

# An exact violation below this counts as feasible (in units of each row's scale, summed).
FEASIBILITY_TOLERANCE = 1e-6
# Sigmoid widths of the stages, in units of the switch (metres for a balance margin); each stage starts from the last one.
# The later ones are tried only if the exact functions find the point infeasible.
WIDTHS = (1e-2, 5e-4)
NARROWER_WIDTHS = (1e-4, 2e-5)
# Barrier parameter at which a warm-started stage begins.
WARM_BARRIER = 1e-5
# Prices below this share of the objective per unit of the row's scale are numerical dust and not reported.
PRICE_TOLERANCE = 1e-6

STATUS_WORDS = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged to IPOPT's acceptable level only",
    "Infeasible_Problem_Detected": "converged to a point of local infeasibility",
    "Maximum_Iterations_Exceeded": "stopped at the iteration limit",
    "Maximum_WallTime_Exceeded": "stopped at the time limit",
    "Restoration_Failed": "restoration of feasibility failed",
    "Search_Direction_Becomes_Too_Small": "search direction became too small",
    "Diverging_Iterates": "iterates diverged",
    "Invalid_Number_Detected": "a function returned NaN or inf",
    "Error_In_Step_Computation": "the linear solver failed",
}
CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True, kw_only=True)
class IpoptSettings:
    """Settings of one IPOPT run.

    Attributes:
        tolerance: IPOPT's ``tol``.
        iterations: limit of iterations for each stage.
        time_limit_s: limit of wall time for each stage [s].
        hessian: ``"exact"`` or ``"limited-memory"``.
    """

    tolerance: float = 1e-8
    iterations: int = 300
    time_limit_s: float = 60.0
    hessian: str = "exact"

    def __post_init__(self) -> None:
        """Refuse what IPOPT would refuse late."""
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance must be within (0, 1), got {self.tolerance}")
        if self.iterations < 1 or not self.time_limit_s > 0.0:
            raise InputError(f"iterations and time_limit_s must be positive, got {self.iterations}, {self.time_limit_s}")
        if self.hessian not in ("exact", "limited-memory"):
            raise InputError(f"hessian must be 'exact' or 'limited-memory', got {self.hessian!r}")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solvers:
    cold: ca.Function
    warm: ca.Function
    linear_solver: str
    create_s: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _End:
    """Raw end of one start."""

    z: Array
    row_multipliers: Array
    bound_multipliers: Array
    return_status: str
    iterations: int
    evaluations: Evaluations
    time_s: float


def solve(
    problem: GaitProblem,
    *,
    starts: int = 1,
    seed: int = 0,
    x0: Sequence[float] | Array | None = None,
    fix: Mapping[str, float] | None = None,
    settings: IpoptSettings | None = None,
    progress: Callable[[StartOutcome], None] | None = None,
) -> Solution:
    """Best local optimum from several starts.

    Args:
        problem: with its current parameter values.
        starts: number of start points, from ``problem.start_point``.
        seed: of the start points.
        x0: first start point (n,); the remaining ``starts - 1`` are random.
        fix: variables held at a value.
        settings: of IPOPT.
        progress: called after each start.

    Returns:
        The best start that converged and is feasible for the exact functions; if none did, the least infeasible end point
        with the rows that stand in the way.

    Raises:
        InputError: no start, or x0 or a fixed value that is not allowed.
    """
    if starts < 1:
        raise InputError(f"starts must be at least 1, got {starts}")
    problem = problem.fix(**(fix or {}))
    settings = settings or IpoptSettings()
    points = _start_points(problem, starts, seed, x0)
    model, exact = nlp_model(problem), exact_model(problem)
    solvers = problem.built(f"ipopt {settings}", lambda: _create(model, settings))

    ends: list[_End] = []
    outcomes: list[StartOutcome] = []
    for index, point in enumerate(points):
        end = _run(model, solvers, problem, exact, point)
        outcome = _outcome(index, problem, exact, model, point, end)
        ends.append(end)
        outcomes.append(outcome)
        if progress is not None:
            progress(outcome)
    best = _best(problem, outcomes)
    return _solution(problem, exact, model, solvers, ends, outcomes, best, seed)


def _start_points(problem: GaitProblem, starts: int, seed: int, x0: Sequence[float] | Array | None) -> list[Array]:
    rng = np.random.default_rng(seed)
    points = [problem.start_point(rng) for _ in range(starts)]
    if x0 is not None:
        points[0] = np.clip(problem.check_x(x0), problem.lower, problem.upper)
    return points


def _create(model: NlpModel, settings: IpoptSettings) -> _Solvers:
    started = time.perf_counter()
    options = {
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.mu_strategy": "adaptive",
        "ipopt.tol": settings.tolerance,
        "ipopt.bound_relax_factor": 0.0,  # else optima violate the exact limits by what IPOPT relaxes them
        "ipopt.max_iter": settings.iterations,
        "ipopt.max_wall_time": settings.time_limit_s,
        "ipopt.hessian_approximation": settings.hessian,
    }
    cold = ca.nlpsol("cold", "ipopt", model.nlp, options)
    derivatives = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g"}
    if settings.hessian == "exact":
        derivatives["hess_lag"] = "nlp_hess_l"
    warm_options = {
        **options,
        **{option: cold.get_function(name) for option, name in derivatives.items()},
        "ipopt.mu_strategy": "monotone",
        "ipopt.mu_init": WARM_BARRIER,
        "ipopt.warm_start_init_point": "yes",
        "ipopt.warm_start_bound_push": 1e-6,
        "ipopt.warm_start_slack_bound_push": 1e-6,
        "ipopt.warm_start_mult_bound_push": 1e-6,
    }
    warm = ca.nlpsol("warm", "ipopt", model.nlp, warm_options)
    return _Solvers(cold=cold, warm=warm, linear_solver=_linear_solver(), create_s=time.perf_counter() - started)


def _linear_solver() -> str:
    """Linear solver that IPOPT uses by default in this installation, read from its own log."""
    x = ca.MX.sym("x")
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "ipopt.log"
        options = {
            "print_time": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.output_file": str(log),
            "ipopt.file_print_level": 5,
        }
        ca.nlpsol("probe", "ipopt", {"x": x, "f": x**2}, options)(x0=1.0)
        found = re.search(r"linear solver (\S+?)[,.\s]", log.read_text() if log.exists() else "")
    return found.group(1) if found else "unknown"


def _run(model: NlpModel, solvers: _Solvers, problem: GaitProblem, exact: ExactModel, x0: Array) -> _End:
    """All stages from one start point."""
    n, p = model.variables, problem.p
    lower, upper = (np.array(bound).ravel() for bound in model.row_bounds(p))
    free, ties = np.full(model.lifted, np.inf), np.zeros(model.lift_rows)
    bounds = {
        "lbx": np.concatenate([(problem.lower - model.offset) / model.scale, -free]),
        "ubx": np.concatenate([(problem.upper - model.offset) / model.scale, free]),
        "lbg": np.concatenate([lower, ties]),
        "ubg": np.concatenate([upper, ties + np.inf]),
    }
    z0 = (x0 - model.offset) / model.scale
    start = np.concatenate([z0, np.array(model.lift_start(z0, p, WIDTHS[0])).ravel()])
    guess: dict[str, ca.DM | Array] = {"x0": start}
    iterations, evaluations = 0, Evaluations()
    started = time.perf_counter()
    required = WIDTHS if model.smoothed else WIDTHS[-1:]
    for stage, width in enumerate((*required, *(NARROWER_WIDTHS if model.smoothed else ()))):
        solver = solvers.cold if stage == 0 else solvers.warm
        result = solver(p=np.append(p, width), **guess, **bounds)
        stats = solver.stats()
        iterations += int(stats["iter_count"])
        evaluations += _counts(stats)
        status = str(stats["return_status"])
        guess = {"x0": result["x"], "lam_x0": result["lam_x"], "lam_g0": result["lam_g"]}
        if stage + 1 < len(required):
            continue
        x = model.offset + model.scale * np.array(result["x"]).ravel()[:n]
        if status not in CONVERGED or float(exact.function(x, p)[1]) <= FEASIBILITY_TOLERANCE:
            break
    rows = len(model.row_names)
    return _End(
        z=np.clip(np.array(result["x"]).ravel()[:n], bounds["lbx"][:n], bounds["ubx"][:n]),
        row_multipliers=np.array(result["lam_g"]).ravel()[:rows],
        bound_multipliers=np.array(result["lam_x"]).ravel()[:n],
        return_status=status,
        iterations=iterations,
        evaluations=evaluations,
        time_s=time.perf_counter() - started,
    )


def _counts(stats: Mapping[str, int]) -> Evaluations:
    return Evaluations(
        f=int(stats.get("n_call_nlp_f", 0)),
        g=int(stats.get("n_call_nlp_g", 0)),
        gradient=int(stats.get("n_call_nlp_grad_f", 0)),
        jacobian=int(stats.get("n_call_nlp_jac_g", 0)),
        hessian=int(stats.get("n_call_nlp_hess_l", 0)),
    )


def _outcome(
    index: int, problem: GaitProblem, exact: ExactModel, model: NlpModel, x0: Array, end: _End
) -> StartOutcome:
    x = model.offset + model.scale * end.z
    cost, violation = (float(value) for value in exact.function(x, problem.p)[:2])
    status = STATUS_WORDS.get(end.return_status, end.return_status.replace("_", " ").lower())
    success = end.return_status in CONVERGED and violation <= FEASIBILITY_TOLERANCE
    if end.return_status in CONVERGED and not success:
        status += ", but the exact functions find it infeasible"
    return StartOutcome(
        index=index,
        success=success,
        status=status,
        objective=problem.objective.sign * cost,
        violation=violation,
        iterations=end.iterations,
        time_s=end.time_s,
        x0=problem.by_name(x0),
        x=problem.by_name(x),
    )


def _best(problem: GaitProblem, outcomes: Sequence[StartOutcome]) -> StartOutcome:
    def merit(outcome: StartOutcome) -> tuple[bool, float]:
        cost = problem.objective.sign * outcome.objective
        return (not outcome.success, cost if outcome.success else outcome.violation)

    return min(outcomes, key=merit)


def _solution(
    problem: GaitProblem,
    exact: ExactModel,
    model: NlpModel,
    solvers: _Solvers,
    ends: Sequence[_End],
    outcomes: Sequence[StartOutcome],
    best: StartOutcome,
    seed: int,
) -> Solution:
    end = ends[best.index]
    violations = row_violations(problem, exact, np.array(list(best.x.values())))
    status = best.status
    if not best.success:
        names = ", ".join(f"{row.name} (by {row.violation:.3g} {row.unit})" for row in violations[:3])
        status = f"no start converged to a feasible point; the least infeasible one {best.status}"
        status += f"; in the way: {names}; relax these limits or widen the bounds" if names else ""
    return Solution(
        problem=problem.name,
        options=dict(problem.options),
        parameters=dict(problem.values),
        success=best.success,
        status=status,
        objective=best.objective,
        objective_name=problem.objective.name,
        objective_unit=problem.objective.unit,
        x=best.x,
        violation=best.violation,
        worst_violations=tuple(violations[:10]),
        iterations=best.iterations,
        evaluations=sum((e.evaluations for e in ends), Evaluations()),
        time_s=SolveTime(build=model.build_s, compile=solvers.create_s, solve=sum(e.time_s for e in ends)),
        solver="ipopt",
        linear_solver=solvers.linear_solver,
        active_constraints=_active(problem, model, end) if best.success else (),
        starts=tuple(outcomes),
        seed=seed,
    )


def row_violations(problem: GaitProblem, exact: ExactModel, x: Array) -> list[RowViolation]:
    """Rows that the exact functions find violated at x by more than the tolerance, worst first."""
    _, _, g, lower, upper, _ = (np.array(value).ravel() for value in exact.function(x, problem.p))
    excess = np.maximum(np.maximum(lower - g, g - upper), 0.0)
    return [
        RowViolation(
            name=exact.row_names[i],
            value=float(g[i]),
            lower=float(lower[i]),
            upper=float(upper[i]),
            violation=float(excess[i]),
            unit=exact.row_units[i],
        )
        for i in np.argsort(-excess, kind="stable")
        if excess[i] > FEASIBILITY_TOLERANCE
    ]


def _active(problem: GaitProblem, model: NlpModel, end: _End) -> tuple[ActiveConstraint, ...]:
    """Bounds with a price: minus the multiplier is the change of the cost per unit of the bound."""
    lower, upper = (np.array(bound).ravel() for bound in model.row_bounds(problem.p))
    names = (*model.row_names, *(f"bounds[{name}]" for name in problem.names))
    units = (*model.row_units, *(variable.unit for variable in problem.variables))
    lowers, uppers = np.concatenate([lower, problem.lower]), np.concatenate([upper, problem.upper])
    prices = -problem.objective.sign * np.concatenate([end.row_multipliers, end.bound_multipliers / model.scale])
    spans = np.concatenate([np.ones(len(lower)), model.scale])
    unit = problem.objective.unit
    found = []
    for i in np.argsort(-np.abs(prices * spans), kind="stable"):
        if abs(prices[i]) * spans[i] < PRICE_TOLERANCE:
            break
        at_upper = prices[i] * problem.objective.sign < 0
        found.append(
            ActiveConstraint(
                name=names[i],
                side="upper" if at_upper else "lower",
                bound=float(uppers[i] if at_upper else lowers[i]),
                unit=units[i],
                price=float(prices[i]),
                price_unit=f"{unit} per {units[i]}" if unit != "1" else f"per {units[i]}",
            )
        )
    return tuple(found)
