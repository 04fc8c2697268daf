"""IPOPT on the few rows of an NLP that matter: most of a gait's limits are far away on the whole way to its optimum.

The time of an iteration grows with the rows, and limits stand at every sample. A run begins with few of them. Where it ends, all
are looked at: those that are violated join, and it goes on from there, until none is. So what is returned keeps every row, and
is a local optimum of the whole NLP; the multipliers of rows that never joined are zero. Where IPOPT does not converge on some of
the rows, it begins again with all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX
from numpy.typing import NDArray

from nlp_gait.backends.derivatives.compiled import DERIVATIVES, NO_OTHERS
from nlp_gait.backends.solvers.iteration_watch import IterationWatch
from nlp_gait.formulation import Array

Rows = NDArray[np.bool_]

ROUNDS = 8  # in which rows join, before all of them do
VIOLATED = 1e-8  # IPOPT's own tolerance
KEPT_SOLVERS = 16  # of different rows
LEAST_ROWS = 100  # for fewer it does not pay


class WorkingSet:
    """A ``Method`` for the first stage of ``StagedSolver``."""

    def __init__(
        self,
        nlp: Mapping[str, MX],
        functions: Mapping[str, ca.Function],
        options: Mapping[str, Any],
        whole: ca.Function,
        watch: IterationWatch,
        always: Rows,
    ) -> None:
        """Keep what solvers of some rows are made of.

        Args:
            nlp: CasADi's dictionary of x, p, f, g.
            functions: of the NLP, and their derivatives, by the names that ``nlpsol`` gives them.
            options: of ``nlpsol``, those that take over derivatives and the watch left out.
            whole: IPOPT on all rows.
            watch: of ``whole``; it ends runs on some of the rows too.
            always: (m,) True for rows that every run begins with.
        """
        self._nlp, self._functions, self._options = nlp, functions, options
        self._whole, self._watch = whole, watch
        self._begin = always
        self._solvers: dict[bytes, tuple[ca.Function, IterationWatch]] = {}
        self._stats: dict[str, Any] = {}

    def learn(self, **arguments: Any) -> None:
        """Begin every later run with the rows, too, that are violated at a start point, and that join on the way from there."""
        self._begin = self._begin | self._violated(arguments["x0"], arguments)
        result, rows = self._joined(arguments)
        if result is not None:
            self._begin = rows

    def __call__(self, **arguments: Any) -> Mapping[str, Any]:
        """See ``Method``; multipliers of a start are not taken."""
        self._stats = {}
        result, _ = self._joined(arguments)
        if result is None:
            result = self._whole(**arguments)
            self._count(self._whole.stats())
        return result

    def stats(self) -> Mapping[str, Any]:
        """Of all runs of the last call, see ``Method``."""
        return self._stats

    def _joined(self, arguments: Mapping[str, Any]) -> tuple[Mapping[str, Any] | None, Rows]:
        """Result of a run on some of the rows that violates none, and these rows; None where all of them are needed."""
        rows, start = self._begin, arguments["x0"]
        for _ in range(ROUNDS):
            chosen = np.flatnonzero(rows)
            solver = self._solver(rows)
            sides = {side: np.asarray(arguments[side])[chosen] for side in ("lbg", "ubg")}
            found = solver(**{**arguments, **sides, "x0": start})
            stats = solver.stats()
            self._count(stats)
            multipliers = np.zeros(len(rows))
            multipliers[chosen] = np.asarray(found["lam_g"]).ravel()
            result = {"x": found["x"], "lam_x": found["lam_x"], "lam_g": multipliers}
            if self._watch.reason:
                return result, rows
            if not stats["success"]:
                break
            violated = self._violated(found["x"], arguments) & ~rows
            if not violated.any():
                return result, rows
            rows, start = rows | violated, found["x"]
        return None, rows

    def _violated(self, x: Any, arguments: Mapping[str, Any]) -> Rows:
        g = np.asarray(self._functions["nlp_g"](x, arguments["p"])).ravel()
        excess: Array = np.maximum(arguments["lbg"] - g, g - arguments["ubg"])
        return ~(excess <= VIOLATED)  # also what is not a number

    def _count(self, stats: Mapping[str, Any]) -> None:
        """Add the calls and iterations of a run to those before it; the status is that of the last."""
        self._stats = {
            name: value + self._stats.get(name, 0) if name.startswith(("n_call_", "iter_count")) else value
            for name, value in stats.items()
        }

    def _solver(self, rows: Rows) -> ca.Function:
        key = rows.tobytes()
        if key not in self._solvers:
            if len(self._solvers) == KEPT_SOLVERS:
                del self._solvers[next(iter(self._solvers))]
            self._solvers[key] = self._made(np.flatnonzero(rows).tolist())
        return self._solvers[key][0]

    def _made(self, rows: list[int]) -> tuple[ca.Function, IterationWatch]:
        """IPOPT on some of the rows, made in milliseconds: it takes parts of what the functions of all rows give."""
        functions, x, p = self._functions, self._nlp["x"], self._nlp["p"]
        nlp: dict[str, Any] = {"x": x, "p": p, "f": functions["nlp_f"](x, p), "g": functions["nlp_g"](x, p)[rows]}
        g, jacobian = functions["nlp_jac_g"](x, p)
        derivatives = {
            "grad_f": functions["nlp_grad_f"],
            "jac_g": ca.Function("nlp_jac_g", [x, p], [g[rows], jacobian[rows, :]]),
        }
        if "nlp_hess_l" in functions:
            weight, weights = MX.sym("lam_f"), MX.sym("lam_g", len(rows))
            of_all = MX.zeros(self._nlp["g"].shape[0], 1)
            of_all[rows] = weights
            hessian = functions["nlp_hess_l"](x, p, weight, of_all)
            derivatives["hess_lag"] = ca.Function(DERIVATIVES["hess_lag"], [x, p, weight, weights], [hessian])
        watch = IterationWatch(nlp, beside=self._watch)
        options = {**self._options, **NO_OTHERS, **derivatives, "iteration_callback": watch}
        return ca.nlpsol("some_rows", "ipopt", nlp, options), watch
