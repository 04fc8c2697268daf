"""Where a run of IPOPT ended, how that is said, and the start that it gives to a neighbouring problem."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nlp_gait.backends.exact import FEASIBILITY_TOLERANCE
from nlp_gait.backends.solvers.iteration_watch import INTERRUPTED, TIME_IS_UP
from nlp_gait.problem import Array
from nlp_gait.problem.solution import Evaluations

STATUS_WORDS = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged to IPOPT's acceptable level only",
    "Infeasible_Problem_Detected": "converged to a point of local infeasibility",
    "Maximum_Iterations_Exceeded": "stopped at the iteration limit",
    TIME_IS_UP: "stopped at the time limit",
    "Restoration_Failed": "restoration of feasibility failed",
    "Search_Direction_Becomes_Too_Small": "search direction became too small",
    "Diverging_Iterates": "iterates diverged",
    "Invalid_Number_Detected": "a function returned NaN or inf",
    "Error_In_Step_Computation": "the linear solver failed",
    INTERRUPTED: "was interrupted",
}
CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True, kw_only=True, eq=False)
class Guess:
    """Primal and dual start of IPOPT: scaled variables with the lifted ones, multipliers of bounds and rows.

    ``width`` is the sigmoid width of the stage that they come from.
    """

    primal: Array
    bounds: Array
    rows: Array
    width: float


@dataclass(frozen=True, kw_only=True, eq=False)
class End:
    """Where one run ended.

    Attributes:
        x: (n,) decision variables, within their bounds.
        cost: exact value of what is minimised.
        violation: exact total violation.
        row_multipliers: of the problem's rows.
        bound_multipliers: of the scaled variables' bounds.
        return_status: IPOPT's own word.
        iterations: over all stages.
        evaluations: over all stages.
        time_s: wall time [s].
        guess: start for a neighbouring problem.
    """

    x: Array
    cost: float
    violation: float
    row_multipliers: Array
    bound_multipliers: Array
    return_status: str
    iterations: int
    evaluations: Evaluations
    time_s: float
    guess: Guess

    @property
    def feasible(self) -> bool:
        """Whether the exact functions find it feasible, with a finite cost."""
        return self.violation <= FEASIBILITY_TOLERANCE and math.isfinite(self.cost)

    @property
    def success(self) -> bool:
        """Converged, and feasible for the exact functions."""
        return self.return_status in CONVERGED and self.feasible

    @property
    def rank(self) -> tuple[float, float]:
        """Smaller is better: what succeeded by cost, then what is feasible by cost, then the rest by violation."""
        if self.feasible:
            return (0.0 if self.success else 1.0), self.cost
        return 2.0, math.inf if math.isnan(self.violation) else self.violation

    @property
    def status(self) -> str:
        """How it ended, in words."""
        words = STATUS_WORDS.get(self.return_status, self.return_status.replace("_", " ").lower())
        refused = self.return_status in CONVERGED and not self.success
        return words + (", but the exact functions find it infeasible" if refused else "")
