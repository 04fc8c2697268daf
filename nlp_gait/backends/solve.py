"""Solve a problem from several starts, and judge every end point by the exact functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from nlp_gait.backends.exact import row_violations
from nlp_gait.backends.interrupts import Interrupted, deferred_interrupts
from nlp_gait.backends.solvers.ipopt import Ipopt, IpoptSettings, ipopt_for
from nlp_gait.backends.solvers.ipopt_end import End
from nlp_gait.errors import InputError
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import ActiveConstraint, Evaluations, Solution, SolveTime, StartOutcome

# A bound whose price, times the bound's scale, is below this is numerical dust and not reported.
PRICE_TOLERANCE = 1e-6


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
        The best start that converged and is feasible for the exact functions; if none did, the best feasible end point, and
        if there is none, the least infeasible one with the rows that stand in the way.

    Raises:
        InputError: no start, x0 or a fixed value that is not allowed, or a linear solver that does not run here.
        Interrupted: Ctrl-C; carries the solution from the starts until then, the one in progress where it was.
    """
    if starts < 1:
        raise InputError(f"starts must be at least 1, got {starts}")
    problem = problem.fix(**(fix or {}))
    settings = settings or IpoptSettings()
    points = _start_points(problem, starts, seed, x0)
    ipopt = ipopt_for(problem, settings, starts)
    ends: list[End] = []
    outcomes: list[StartOutcome] = []
    with deferred_interrupts() as interrupted:
        for index, point in enumerate(points):
            ends.append(ipopt.run(problem, point, interrupted))
            outcomes.append(outcome_of(index, problem, point, ends[-1]))
            if progress is not None:
                progress(outcomes[-1])
            if interrupted():
                break
    solution = solution_of(problem, ipopt, ends, outcomes, seed)
    if interrupted():
        sentence = f"interrupted in start {len(ends)} of {starts}"
        raise Interrupted(sentence, replace(solution, status=f"{sentence}; {solution.status}"))
    return solution


def _start_points(problem: GaitProblem, starts: int, seed: int, x0: Sequence[float] | Array | None) -> list[Array]:
    rng = np.random.default_rng(seed)
    points = [problem.start_point(rng) for _ in range(starts)]
    if x0 is not None:
        points[0] = np.clip(problem.check_x(x0), problem.lower, problem.upper)
    return points


def outcome_of(index: int, problem: GaitProblem, x0: Array, end: End) -> StartOutcome:
    """Plain account of one start."""
    return StartOutcome(
        index=index,
        success=end.success,
        status=end.status,
        objective=problem.objective.sign * end.cost,
        violation=end.violation,
        iterations=end.iterations,
        time_s=end.time_s,
        x0=problem.by_name(x0),
        x=problem.by_name(end.x),
    )


def solution_of(
    problem: GaitProblem, ipopt: Ipopt, ends: Sequence[End], outcomes: Sequence[StartOutcome], seed: int
) -> Solution:
    """Solution from the ends of all starts: the cheapest that succeeded, else that is feasible, else the least infeasible."""
    best = min(ends, key=lambda end: end.rank)
    violations = row_violations(problem, best.x)
    status = best.status
    if not best.success:
        names = ", ".join(f"{row.name} (by {row.violation:.3g} {row.unit})" for row in violations[:3])
        status = f"no start converged; the best feasible one {best.status}"
        if not best.feasible:
            status = f"no start converged to a feasible point; the least infeasible one {best.status}"
        status += f"; in the way: {names}; relax these limits or widen the bounds" if names else ""
        status += "" if np.isfinite(best.cost) else f"; {problem.objective.name} is {best.cost} there"
    return Solution(
        problem=problem.name,
        options=dict(problem.options),
        parameters=dict(problem.values),
        success=best.success,
        status=status,
        objective=problem.objective.sign * best.cost,
        objective_name=problem.objective.name,
        objective_unit=problem.objective.unit,
        x=problem.by_name(best.x),
        violation=best.violation,
        worst_violations=tuple(violations[:10]),
        iterations=best.iterations,
        evaluations=sum((end.evaluations for end in ends), Evaluations()),
        time_s=SolveTime(build=ipopt.model.build_s, compile=ipopt.create_s, solve=sum(end.time_s for end in ends)),
        solver="ipopt",
        linear_solver=ipopt.linear_solver,
        functions="compiled" if ipopt.compiled else "interpreted",
        active_constraints=_active(problem, ipopt, best) if best.success else (),
        starts=tuple(outcomes),
        seed=seed,
    )


def _active(problem: GaitProblem, ipopt: Ipopt, end: End) -> tuple[ActiveConstraint, ...]:
    """Bounds with a price: minus the multiplier is the change of the cost per unit of the bound.

    Equations of the problem always hold and are left out; a variable that is fixed has a price.
    """
    model = ipopt.model
    lower, upper = (np.array(bound).ravel() for bound in model.row_bounds(problem.p))
    names = (*model.row_names, *(f"bounds[{name}]" for name in problem.names))
    units = (*model.row_units, *(variable.unit for variable in problem.variables))
    lowers, uppers = np.concatenate([lower, problem.lower]), np.concatenate([upper, problem.upper])
    slopes = -np.concatenate([end.row_multipliers, end.bound_multipliers / model.scale])
    weights = np.abs(slopes) * np.concatenate([np.ones(len(lower)), model.scale])
    unit = problem.objective.unit
    found = []
    for i in np.argsort(-weights, kind="stable"):
        if weights[i] < PRICE_TOLERANCE:
            break
        if i < len(lower) and lower[i] == upper[i]:
            continue
        at_upper = slopes[i] < 0  # a higher upper bound lowers the cost, a higher lower bound raises it
        found.append(
            ActiveConstraint(
                name=names[i],
                side="upper" if at_upper else "lower",
                bound=float(uppers[i] if at_upper else lowers[i]),
                unit=units[i],
                price=float(problem.objective.sign * slopes[i]),
                price_unit=f"{unit} per {units[i]}" if unit != "1" else f"per {units[i]}",
            )
        )
    return tuple(found)
