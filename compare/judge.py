"""The judge: exact values at a point, whatever a solver claims: at the problem's samples, and on a dense grid between them.

For rows that are functions of time, it is also proven which are satisfied at every instant.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from nlp_gait.backends.exact import build_exact_model, find_violated_rows
from nlp_gait.errors import InputError, format_value
from nlp_gait.files import read_json
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, ConstraintValue
from nlp_gait.proofs.guarantee import Guarantee, guarantee

SLIGHT = 1e-3  # violation, as a share of a row's scale, and error of an objective that printed digits explain
SHOWN = 3  # violated rows
DENSE_INTERVALS = 1000  # least number of intervals of the dense grid


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Exact values of a problem at a point."""

    problem: str
    options: Mapping[str, Any]
    parameters: Mapping[str, float]  #: values that differ from the defaults
    x: Mapping[str, float]  #: by variable name
    objective: Mapping[str, Any]  #: name, value and unit
    metrics: Mapping[str, float]  #: performance figures at the problem's samples
    constraints: tuple[ConstraintValue, ...]  #: all rows, the variables' bounds last
    violation: float  #: total over all rows, each divided by its scale
    feasible: bool  #: total violation at most 1e-6
    dense: Mapping[str, float] | None  #: the same metrics on the dense grid; None for a problem without samples
    #: Rows violated on the dense grid, worst first; times are samples of that grid
    dense_violations: tuple[ConstraintValue, ...]
    dense_intervals: int | None  #: number of intervals of the dense grid
    #: What is proven between the samples; None for an infeasible point, or without ``prove``
    guaranteed: Guarantee | None

    @property
    def violations(self) -> tuple[ConstraintValue, ...]:
        """Violated rows, worst first."""
        return find_violated_rows(self.constraints)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; the robot is next to the problem's name."""
        robot = {"robot": self.options["robot"]} if "robot" in self.options else {}
        return {"schema": 1, "problem": self.problem, **robot, **asdict(self)}


def evaluate(
    problem: GaitProblem,
    x: Sequence[float] | Array | Mapping[str, float],
    *,
    prove: bool = True,
) -> Evaluation:
    """Return the exact values at x (n,), in the problem's order or by name; raises InputError for a wrong length or NaN.

    Without ``prove`` nothing is proven of a feasible point: ``guaranteed`` is None.
    """
    point = problem.check_x(x)
    exact = build_exact_model(problem)
    values = exact.at(point, problem.p)
    parts = DENSE_INTERVALS if problem.grid is None else problem.grid.parts
    factor = math.ceil(DENSE_INTERVALS / parts)
    dense = problem.dense(factor)
    dense_values = None if dense is None else build_exact_model(dense).at(point, dense.p)
    objective = problem.objective
    return Evaluation(
        problem=problem.load_name,
        options=dict(problem.options),
        parameters=dict(problem.values),
        x=problem.by_name(point),
        objective={"name": objective.name, "value": objective.sign * values.cost, "unit": objective.unit},
        metrics=values.metrics,
        constraints=exact.rows(values),
        violation=values.violation,
        feasible=values.violation <= FEASIBILITY_TOLERANCE,
        dense=None if dense_values is None else dense_values.metrics,
        dense_violations=()
        if dense is None or dense_values is None
        else build_exact_model(dense).find_violated(dense_values),
        dense_intervals=None if dense is None else factor * parts,
        guaranteed=guarantee(problem, point) if prove and values.violation <= FEASIBILITY_TOLERANCE else None,
    )


def find_faults(result: Result, path: Path) -> list[str]:
    """Return in words what is wrong with a gait from a file: rows and bounds that it violates, an objective that it has not.

    Raises InputError if its objective is not a finite number, or that in the file is not a number.
    """
    problem, stated = result.problem, read_json(path, "result").get("objective")
    model = build_exact_model(problem)
    values, scales = model.at(result.x, problem.p), dict(zip(model.row_names, model.row_scales.tolist(), strict=True))
    rows = [row for row in model.find_violated(values) if not row.violation <= SLIGHT * scales[row.name]]
    of_variables = model.row_names[-len(problem.names) :]
    worst = [
        f"{row.name} = {row.value:.4g} {row.unit}".removesuffix(" 1") + ", outside of its bounds "
        f"{'-inf' if row.lower is None else f'{row.lower:.4g}'} to {'inf' if row.upper is None else f'{row.upper:.4g}'}"
        for row in sorted(rows, key=lambda row: row.name not in of_variables)[:SHOWN]
    ]
    violated = "; ".join([*worst, *([f"and {len(rows) - SHOWN} more"] if len(rows) > SHOWN else [])])
    sentences = [f"The gait is not feasible; violated: {violated}"] if rows else []
    value = problem.objective.sign * values.cost
    if not math.isfinite(value):
        reason = f"result {str(path)!r}: {problem.objective.name} is {value} at this x"
        raise InputError("; ".join(filter(None, (reason, violated))))
    stated = stated.get("value") if isinstance(stated, dict) else stated
    if stated is not None and (isinstance(stated, bool) or not isinstance(stated, int | float)):
        raise InputError(f"result {str(path)!r}: objective must be a number, got {format_value(stated)}")
    if stated is not None and not abs(stated - value) <= SLIGHT * abs(value):
        unit = problem.objective.unit
        sentences.append(f"The file says {problem.objective.name} {stated:.6g} {unit}, and it is {value:.6g} {unit}")
    return sentences
