"""An NLP's values and derivatives in arrays that are allocated once."""

from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from nlp_gait.backends.nlp import build_nlp
from nlp_gait.formulation import Array, GaitProblem


class NlpFunctions:
    """Values at a point (w, p) after ``evaluate``, derivatives there after ``differentiate``."""

    def __init__(self, problem: GaitProblem, functions: Mapping[str, ca.Function]) -> None:
        """Take the functions that ``nlpsol`` uses, by its names."""
        self.model = model = build_nlp(problem)
        size, n = model.nlp["x"].shape[0], model.variables
        rows = model.nlp["g"].shape[0]
        self.w, self.p = np.zeros(size), np.append(problem.p, model.widths[-1])
        self.cost, self.g = np.zeros(1), np.zeros(rows)
        self.gradient, self.multipliers = np.zeros(size), np.zeros(rows)
        #: (m,) bounds of the rows
        self.lower, self.upper = np.zeros(rows), np.concatenate([np.zeros(len(model.row_names)), model.tie_upper])
        self._own_p = np.zeros(len(problem.p))
        jacobian, hessian = functions["nlp_jac_g"].sparsity_out(1), functions["nlp_hess_l"].sparsity_out(0)
        self._jacobian, self._hessian = np.zeros(jacobian.nnz()), np.zeros(hessian.nnz())
        self._run = {
            name: _bind(functions[name], inputs, outputs)
            for name, inputs, outputs in (
                ("nlp_f", (self.w, self.p), (self.cost,)),
                ("nlp_g", (self.w, self.p), (self.g,)),
                ("nlp_grad_f", (self.w, self.p), (None, self.gradient)),
                ("nlp_jac_g", (self.w, self.p), (None, self._jacobian)),
                ("nlp_hess_l", (self.w, self.p, np.ones(1), self.multipliers), (self._hessian,)),
            )
        }
        self._run_bounds = _bind(model.row_bounds, (self._own_p,), (self.lower, self.upper))
        row, column = (np.array(part, dtype=int) for part in jacobian.get_triplet())
        of_z = column < n
        self._of_z, self._place = np.flatnonzero(of_z), row[of_z] * n + column[of_z]
        #: (m, n) Jacobian by the problem's variables
        self.rows_by_z = np.zeros((rows, n))
        of_s = np.flatnonzero(~of_z)
        order = np.lexsort((column[of_s], row[of_s]))
        self._of_s = of_s[order]
        starts = np.searchsorted(row[self._of_s], np.arange(rows + 1))
        #: (m, lifted) Jacobian by the lifted variables
        self.rows_by_s = sparse.csr_array((np.zeros(len(of_s)), column[self._of_s] - n, starts), shape=(rows, size - n))
        #: its transpose, of the same numbers
        self.s_by_rows = sparse.csc_array(
            (self.rows_by_s.data, self.rows_by_s.indices, self.rows_by_s.indptr), shape=(size - n, rows)
        )
        row, column = (np.array(part, dtype=int) for part in hessian.get_triplet())
        above = np.flatnonzero(row < column)
        both = np.concatenate([np.arange(len(row)), above])
        places = np.concatenate([row, column[above]]), np.concatenate([column, row[above]])
        order = np.lexsort(places[::-1])
        self._both = both[order]
        starts = np.searchsorted(places[0][order], np.arange(size + 1))
        #: (N, N) Hessian of the Lagrangian
        self.hessian = sparse.csr_array((np.zeros(len(both)), places[1][order], starts), shape=(size, size))

    def set_parameters(self, p: Array) -> None:
        """Set the problem's parameters (k,), and the bounds of its rows."""
        self.p[:-1] = self._own_p[:] = p
        self._run_bounds()

    def evaluate(self, w: Array) -> None:
        """Compute the cost and the rows at w."""
        self.w[:] = w
        self._run["nlp_f"]()
        self._run["nlp_g"]()

    def differentiate(self, multipliers: Array) -> None:
        """Compute all derivatives at the last point; multipliers (m,) of the rows are those of the Lagrangian."""
        self.multipliers[:] = multipliers
        self._run["nlp_grad_f"]()
        self._run["nlp_jac_g"]()
        self._run["nlp_hess_l"]()
        self.rows_by_z.ravel()[self._place] = self._jacobian[self._of_z]
        self.rows_by_s.data[:] = self._jacobian[self._of_s]
        self.hessian.data[:] = self._hessian[self._both]


def _bind(function: ca.Function, inputs: tuple[Array, ...], outputs: tuple[Array | None, ...]) -> Callable[[], None]:
    buffer: Any
    buffer, call = function.buffer()
    for i, array in enumerate(inputs):
        buffer.set_arg(i, array.data)
    for i, result in enumerate(outputs):
        if result is not None and result.size:
            buffer.set_res(i, result.data)
    keep = (function, buffer, inputs, outputs)  # the buffer stores addresses only

    def run(_: object = keep) -> None:
        call()

    return run
