"""A problem under the lifted interpretation, as an NLP over scaled variables.

    minimise  sign * objective(x, s)   over z in [0, 1]^n and the lifted variables s
    subject to the problem's rows, and the rows that tie s to the expressions it replaces,

with x = default lower bound + z * default range. Samples are mapped, never unrolled.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.backends.exact import check_row_bounds
from nlp_gait.errors import LiftedSenseError
from nlp_gait.formulation import Array, GaitProblem, Point
from nlp_gait.symbolic.nonsmooth import Lift, Lifted

# Sigmoid widths of the stages in which a jump is approached, in units of the switch (metres for a balance margin).
WIDTHS = (1e-2, 5e-4)
# The sense of the lifting is checked at these fractions of the default ranges; a derivative below the tolerance is zero.
SENSE_POINTS = (0.25, 0.5, 0.75)
SENSE_TOLERANCE = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class NlpModel:
    """NLP of a problem."""

    nlp: dict[str, MX]  #: CasADi's dictionary: x = (z, s), p = (problem parameters, sigmoid width), f, g
    variables: int  #: n, the number of problem variables
    row_names: tuple[str, ...]  #: names of the problem's rows, the first rows of g
    offset: Array  #: (n,) x at z = 0
    scale: Array  #: (n,) range of x
    row_bounds: ca.Function  #: function p -> (lower, upper) of the problem's rows
    lift_start: ca.Function  #: function (z, p, width) -> s at the exact values
    lifted: int  #: number of lifted variables
    #: Upper bounds of the rows that tie them, the last rows of g: infinite, or 0 for an equation; the lower is 0
    tie_upper: Array
    #: (lifted,) 1 for a lifted variable that is its exact value or more, -1 for one that is it or less, 0 for one equal to it
    lift_sense: Array
    smoothed: bool  #: whether a jump is smoothed, so that the width matters
    build_s: float  #: time of the construction [s]

    @property
    def widths(self) -> tuple[float, ...]:
        """Sigmoid widths of a solver's stages, each of which starts from the last one; without a jump there is one stage."""
        return WIDTHS if self.smoothed else WIDTHS[-1:]

    def start(self, problem: GaitProblem, x: Array, width: float) -> Array:
        """Return (z, s) of a point x (n,), with s at the exact values for a sigmoid width."""
        z = (x - self.offset) / self.scale
        return np.concatenate([z, np.array(self.lift_start(z, problem.p, width)).ravel()])

    def point(self, w: Array) -> Array:
        """Return the decision variables (n,) of (z, s)."""
        return np.asarray(self.offset + self.scale * w[: self.variables])

    def bounds(self, problem: GaitProblem) -> dict[str, Array]:
        """Return the bounds of (z, s) and of g for a problem's parameter values, by CasADi's names."""
        lower, upper = (np.array(bound).ravel() for bound in self.row_bounds(problem.p))
        check_row_bounds(problem, self.row_names, lower, upper)
        free = np.full(self.lifted, np.inf)
        return {
            "lbx": np.concatenate([(problem.lower - self.offset) / self.scale, -free]),
            "ubx": np.concatenate([(problem.upper - self.offset) / self.scale, free]),
            "lbg": np.concatenate([lower, np.zeros(len(self.tie_upper))]),
            "ubg": np.concatenate([upper, self.tie_upper]),
        }


def build_nlp(problem: GaitProblem) -> NlpModel:
    """Return the NLP of a problem, built once for all its copies; raises LiftedSenseError where a lift would not be exact."""
    return problem.build_once(_build)


def _build(problem: GaitProblem) -> NlpModel:
    started = time.perf_counter()
    n = len(problem.variables)
    offset = np.array([variable.lower for variable in problem.variables])
    symbols = problem.symbols()
    z, p, width = MX.sym("z", n), symbols.p, MX.sym("width")
    ops = Lifted(width)
    point = Point(x=ca.DM(offset) + ca.DM(problem.scale) * z, p=p, positions=symbols.positions)
    assembly = problem.assemble(point, ops)
    rows = [constraint.columns for constraint in assembly.constraints]
    values, lower, upper = (ca.vertcat(*(row[i] for row in rows)) for i in range(3))
    bounds = ca.Function("row_bounds", [p], [ca.densify(lower), ca.densify(upper)])
    cost = problem.objective.sign * assembly.objective
    row_names = tuple(name for constraint in assembly.constraints for name in constraint.row_names)
    lifted = ca.vertcat(*(lift.variable for lift in ops.lifts))
    ties = ca.vertcat(*(lift.rows for lift in ops.lifts))
    exact: list[MX] = []
    for i, lift in enumerate(ops.lifts):
        earlier = [previous.variable for previous in ops.lifts[:i]]  # which a lift may contain
        exact += ca.graph_substitute([lift.value], earlier, exact) if earlier else [lift.value]
    model = NlpModel(
        nlp={"x": ca.vertcat(z, lifted), "p": ca.vertcat(p, width), "f": cost, "g": ca.vertcat(values, ties)},
        variables=n,
        row_names=row_names,
        offset=offset,
        scale=problem.scale,
        row_bounds=bounds,
        lift_start=ca.Function("lift_start", [z, p, width], [ca.vertcat(*exact)]),
        lifted=lifted.shape[0],
        tie_upper=_repeat([0.0 if lift.tight else np.inf for lift in ops.lifts], [lift.rows for lift in ops.lifts]),
        lift_sense=_repeat([lift.sense for lift in ops.lifts], [lift.variable for lift in ops.lifts]),
        smoothed=ops.smoothed,
        build_s=0.0,
    )
    if model.lift_sense.any():
        _check_sense(problem, model, ops.lifts)
    return replace(model, build_s=time.perf_counter() - started)


def _repeat(values: Sequence[float], columns: Sequence[MX]) -> Array:
    """Return each value as often as its column has rows."""
    return np.repeat(np.array(values, dtype=float), np.array([column.shape[0] for column in columns], dtype=int))


def _check_sense(problem: GaitProblem, model: NlpModel, lifts: list[Lift]) -> None:
    """Check that moving a lifted variable away from its exact value never helps; only then is the lifting exact.

    The check uses the signs of the first derivatives of the cost, of each row and of the rows that define the other lifted
    variables, at points inside the bounds. A tight lift cannot move.
    """
    nlp, is_loose = model.nlp, model.lift_sense != 0.0
    column_owner = _repeat(range(len(lifts)), [lift.variable for lift in lifts])[is_loose]
    away = model.lift_sense[is_loose]
    moved = ca.vertcat(*(lift.variable for lift in lifts if not lift.tight))
    slopes = ca.Function("slopes", [nlp["x"], nlp["p"]], [ca.jacobian(ca.vertcat(nlp["f"], nlp["g"]), moved)])
    lower, upper = (np.array(bound).ravel() for bound in model.row_bounds(problem.p))
    tight = model.tie_upper == 0.0
    # +1: growing hurts (cost, rows with an upper bound); -1: growing helps (rows with a lower bound); 0: no bound.
    hurts = np.concatenate([[1.0], np.isfinite(upper) * 1.0 - np.isfinite(lower), tight - 1.0])
    two_sided = np.concatenate([[False], np.isfinite(lower) & np.isfinite(upper), tight])
    # The rows that define a lifted variable let it move: they do not count.
    row_owner = np.repeat(np.arange(-1, len(lifts)), [1 + len(lower), *(lift.rows.shape[0] for lift in lifts)])
    row, column = (np.array(indices) for indices in slopes.sparsity_out(0).get_triplet())
    foreign = row_owner[row] != column_owner[column]
    for share in SENSE_POINTS:
        w = np.concatenate([np.full(model.variables, share), np.zeros(model.lifted)])
        slope = foreign * np.array(slopes(w, np.append(problem.p, 1e-3)).nonzeros())
        helps = slope * away[column] * hurts[row] < -SENSE_TOLERANCE
        helps |= two_sided[row] & (np.abs(slope) > SENSE_TOLERANCE)
        if helps.any():
            first = int(row[helps].min())
            where = "another abs or min"
            if row_owner[first] < 0:
                where = f"row {model.row_names[first - 1]}" if first else "the objective"
            raise LiftedSenseError(
                f"{problem.name}: {where} gains from moving a lifted variable away from its exact value, so the lifted "
                "NLP would be wrong; use abs only where it is minimised or bounded from above, min only where it is "
                "maximised or bounded from below, and ops.step for a true jump"
            )
