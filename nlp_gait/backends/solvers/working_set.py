"""IPOPT on the few rows of an NLP that matter: most limits of a gait are far away during the whole run.

A run begins with few rows. At its end those that are violated are added, and the run continues, until no row is violated. So
the result is a local optimum of the whole NLP; the multipliers of rows that were never added are zero.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX
from numpy.typing import NDArray

from nlp_gait.backends.derivatives.compiled import DERIVATIVES, NO_OTHERS
from nlp_gait.backends.solvers.solver import LONGEST_INFEASIBLE, IterationWatch, WatchedSolver
from nlp_gait.formulation import Array

Rows = NDArray[np.bool_]

ROUNDS = 8  # in which rows are added
UNSETTLED = "rows_were_violated_in_each_round"
VIOLATED = 1e-8  # IPOPT's tolerance
CACHED_SOLVERS = 16  # on different rows
LEAST_ROWS = 100  # of an NLP for which this pays


class WorkingSet:
    """IPOPT on few rows for the first stage of ``Ipopt``, with the interface of an ``nlpsol``."""

    def __init__(
        self,
        nlp: Mapping[str, MX],
        functions: Mapping[str, ca.Function],
        options: Mapping[str, Any],
        watch: IterationWatch,
        always: Rows,
        within: float | None = None,
    ) -> None:
        """Take the NLP, its functions by the names of ``nlpsol``, and IPOPT's options without derivatives and the watch.

        ``watch`` ends runs; these begin with ``always`` (m,), and the rows ``within`` a distance of a bound at their start.
        """
        self._nlp, self._functions, self._options = nlp, functions, options
        self._watch, self._begin, self._within = watch, always, within
        self._get_solver = lru_cache(CACHED_SOLVERS)(self._make_solver)
        self._stats: dict[str, Any] = {}

    def add_violated_rows(self, **arguments: Any) -> None:
        """Add the rows that are violated at a start point, or added in a run from it, to those with which runs begin."""
        self._begin = self._begin | self._find_violated(arguments["x0"], arguments)
        _, rows = self._solve_on_few_rows(arguments)
        if self._stats["success"]:
            self._begin = rows

    def __call__(self, **arguments: Any) -> Mapping[str, Any]:
        """Solve the NLP; multipliers of the start are ignored."""
        return self._solve_on_few_rows(arguments)[0]

    def stats(self) -> Mapping[str, Any]:
        """Return the statistics of the last call: sums over its runs."""
        return self._stats

    def _solve_on_few_rows(self, arguments: Mapping[str, Any]) -> tuple[Mapping[str, Any], Rows]:
        """Return a result, which violates no row where the statistics report success, and the rows that it used."""
        rows, start = self._begin, arguments["x0"]
        if self._within is not None:
            rows = rows | self._find_violated(start, arguments, -self._within)
        self._stats = {}
        for _ in range(ROUNDS):
            chosen = np.flatnonzero(rows)
            solver = self._get_solver(rows.tobytes())
            sides = {side: np.asarray(arguments[side])[chosen] for side in ("lbg", "ubg")}
            solved = solver(**{**arguments, **sides, "x0": start})
            stats = solver.stats()
            self._count(stats)
            multipliers = np.zeros(len(rows))
            multipliers[chosen] = np.asarray(solved["lam_g"]).ravel()
            result = {"x": solved["x"], "lam_x": solved["lam_x"], "lam_g": multipliers}
            violated = self._find_violated(solved["x"], arguments) & ~rows
            if self._watch.reason or not stats["success"] or not violated.any():
                return result, rows
            rows, start = rows | violated, solved["x"]
        self._stats |= {"success": False, "return_status": UNSETTLED}
        return result, rows

    def _find_violated(self, x: Any, arguments: Mapping[str, Any], most: float = VIOLATED) -> Rows:
        g = np.asarray(self._functions["nlp_g"](x, arguments["p"])).ravel()
        violations: Array = np.maximum(arguments["lbg"] - g, g - arguments["ubg"])
        return ~(violations <= most)  # NaN counts as violated

    def _count(self, stats: Mapping[str, Any]) -> None:
        """Add the calls and iterations of a run to those of earlier runs; the status is that of the last run."""
        self._stats = {
            name: value + self._stats.get(name, 0) if name.startswith(("n_call_", "iter_count")) else value
            for name, value in stats.items()
        }

    def _make_solver(self, chosen: bytes) -> WatchedSolver:
        """Make IPOPT on some of the rows, within milliseconds: it uses parts of the results of the functions of all rows."""
        rows = np.flatnonzero(np.frombuffer(chosen, dtype=bool)).tolist()
        functions, x, p = self._functions, self._nlp["x"], self._nlp["p"]
        nlp: dict[str, Any] = {"x": x, "p": p, "f": functions["nlp_f"](x, p), "g": functions["nlp_g"](x, p)[rows]}
        g, jacobian = functions["nlp_jac_g"](x, p)
        jac_g = ca.Function("nlp_jac_g", [x, p], [g[rows], jacobian[rows, :]])
        derivatives = {"grad_f": functions["nlp_grad_f"], "jac_g": jac_g}
        if "nlp_hess_l" in functions:
            weight, weights = MX.sym("lam_f"), MX.sym("lam_g", len(rows))
            all_weights = MX.zeros(self._nlp["g"].shape[0], 1)
            all_weights[rows] = weights
            hessian = functions["nlp_hess_l"](x, p, weight, all_weights)
            derivatives["hess_lag"] = ca.Function(DERIVATIVES["hess_lag"], [x, p, weight, weights], [hessian])
        watch = IterationWatch(nlp, self._watch.limits)
        options = {**self._options, **NO_OTHERS, **derivatives, "iteration_callback": watch}
        return WatchedSolver(ca.nlpsol("some_rows", "ipopt", nlp, options), watch, LONGEST_INFEASIBLE)
