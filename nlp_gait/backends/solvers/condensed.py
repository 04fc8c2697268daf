"""An interior-point method of our own, whose Newton systems are condensed to the decision variables before they are factorised.

IPOPT factorises all variables, slacks and multipliers of the lifted NLP, for any structure. Here the structure is known: a lifted
variable meets few rows, so that it is eliminated in closed form as the slacks are, and nine unknowns are left of 1,586
(``native/interior_point.hpp``, compiled once for all problems).
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from nlp_gait.backends.interrupts import never
from nlp_gait.backends.kernel.compiler import find_compiler, lane_flags, native_lanes, native_source
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.backends.solvers.ipopt import WARM_BARRIER, Ipopt, IpoptSettings
from nlp_gait.backends.solvers.iteration_watch import INTERRUPTED, REASONS
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.backends.solvers.stages import StagedSolver
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import Outcome

HEADERS = ("nlp.hpp", "indefinite.hpp", "newton.hpp", "interior_point.hpp")
FLAGS = ("-std=c++17", "-O3", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")
SYMBOLS = ("nlp_gait_condensed", "nlp_gait_condensed_size")
# Of the dense matrix: beyond, sparse factorisation as IPOPT's wins.
LARGEST = 600
# In the order of the enumeration in ``native/nlp.hpp``: names as IPOPT's, and what they mean here.
STATUSES = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged to the acceptable level only",
    "Infeasible_Problem_Detected": "converged to a point of local infeasibility",
    "Maximum_Iterations_Exceeded": "stopped at the iteration limit",
    INTERRUPTED: REASONS[INTERRUPTED],
    "Search_Direction_Becomes_Too_Small": "search direction became too small",
    "Invalid_Number_Detected": "a function returned NaN or inf",
    "Error_In_Step_Computation": "the Newton system could not be solved",
}
_VALUES, _SLOPES, _CURVATURE, _ITERATION = range(4)
_Call = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int)
_ARRAYS = ("jacobian_columns", "jacobian_rows", "hessian_columns", "hessian_rows")
_SHARED = ("x", "f", "g", "gradient", "jacobian", "factor", "multipliers", "hessian")


class _Nlp(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int) for name in ("variables", "rows", "leading")),
        *((name, ctypes.c_void_p) for name in (*_ARRAYS, *_SHARED)),
        ("call", _Call),
    ]


class _Settings(ctypes.Structure):
    _fields_ = [
        ("tolerance", ctypes.c_double),
        ("iterations", ctypes.c_int),
        ("warm", ctypes.c_int),
        ("barrier", ctypes.c_double),
    ]


@dataclass(frozen=True, kw_only=True)
class CondensedSettings(Solver):
    """The condensed interior-point method with its settings.

    Attributes:
        tolerance: of the scaled optimality conditions, as IPOPT's ``tol``.
        iterations: limit of iterations for each stage.
        time_limit_s: limit of wall time for all stages of a run [s]; checked after each iteration.
        compiled: compile the NLP's functions and derivatives, as for IPOPT.
    """

    name: ClassVar[str] = "condensed"

    tolerance: float = 1e-8
    iterations: int = 300
    time_limit_s: float = 300.0
    compiled: bool | None = None

    def __post_init__(self) -> None:
        """Refuse what IPOPT refuses."""
        self._ipopt()

    def ready_for(self, problem: GaitProblem, solves: int = 1) -> Condensed:
        """The method for a problem, made once for all its copies.

        Raises:
            InputError: there is no compiler, or the dense matrix would be too large.
            CompilerError: compiled functions are demanded, and the compiler fails.
        """
        ipopt = self._ipopt().ready_for(problem, solves)
        return problem.built(f"condensed {self} {ipopt.compiled}", lambda: Condensed(problem, self, ipopt))

    def check(self, problem: GaitProblem) -> None:
        """See ``Solver``."""
        self.ready_for(problem)

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        """See ``Solver``."""
        return self.ready_for(problem).run(problem, x0, stop)

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        """See ``Solver``."""
        return self.ready_for(problem).run_from(problem, near, stop)

    def _ipopt(self) -> IpoptSettings:
        """IPOPT with the same settings, whose functions are called."""
        return IpoptSettings(
            tolerance=self.tolerance,
            iterations=self.iterations,
            time_limit_s=self.time_limit_s,
            hessian="exact",
            compiled=self.compiled,
        )


class Condensed(StagedSolver):
    """The method made for one problem's mathematics, cold and warm."""

    name: ClassVar[str] = CondensedSettings.name
    words = STATUSES

    def __init__(self, problem: GaitProblem, settings: CondensedSettings, ipopt: Ipopt) -> None:
        started = time.perf_counter()
        self.model, self.watch, self.compiled = ipopt.model, ipopt.watch, ipopt.compiled
        self.linear_solver, self.time_limit_s = "", settings.time_limit_s
        cold, warm = (
            _Method(
                ipopt.functions(),
                self.model.variables,
                lambda: bool(self.watch.eval(None)[0]),
                _Settings(settings.tolerance, settings.iterations, warm, WARM_BARRIER),
            )
            for warm in (False, True)
        )
        self.cold, self.warm = cold, warm
        bounds = self.model.bounds(problem)
        size = cold.size(bounds["lbg"] == bounds["ubg"])
        if size > LARGEST:
            raise InputError(
                f"condensed would factorise a dense matrix of {size} x {size} for {problem.name}, {LARGEST} at most: too many "
                "of its variables or rows depend on each other; use ipopt"
            )
        self.create_s = ipopt.create_s + time.perf_counter() - started


class _Method:
    """The compiled method on one NLP, called as an ``nlpsol`` is.

    The arrays that are shared with the library belong to the functions' buffers too, so that nothing is copied.
    """

    def __init__(
        self, functions: Mapping[str, ca.Function], leading: int, ends: Callable[[], bool], settings: _Settings
    ) -> None:
        f, g, slope, jacobian, hessian = functions.values()
        self._library, self._settings, self._stats = _library(), settings, dict[str, Any]()
        n, m = jacobian.size1_in(0), jacobian.size1_out(1)
        columns, curvature = jacobian.sparsity_out(1), hessian.sparsity_out(0)
        self._p, dense_g, dense_slope = (np.zeros(count) for count in (f.nnz_in(1), g.nnz_out(0), slope.nnz_out(1)))
        shared = {name: np.zeros(n) for name in ("x", "gradient")} | {
            name: np.zeros(m) for name in ("g", "multipliers")
        }
        shared |= {name: np.zeros(1) for name in ("f", "factor")}
        shared |= {"jacobian": np.zeros(columns.nnz()), "hessian": np.zeros(curvature.nnz())}
        self._shared = shared
        where_g, where_slope = (
            np.array(s.get_triplet(), dtype=int).max(axis=0) for s in (g.sparsity_out(0), slope.sparsity_out(1))
        )
        point = (shared["x"], self._p)
        cost_at, rows_at = _Buffered(f, point, (shared["f"],)), _Buffered(g, point, (dense_g,))
        slope_at, jacobian_at = (
            _Buffered(slope, point, (None, dense_slope)),
            _Buffered(jacobian, point, (None, shared["jacobian"])),
        )
        hessian_at = _Buffered(hessian, (*point, shared["factor"], shared["multipliers"]), (shared["hessian"],))
        self._calls, self._error = np.zeros(4, dtype=int), list[BaseException]()

        def answer(request: int) -> int:
            try:
                self._calls[request] += 1
                if request == _VALUES:
                    cost_at()
                    rows_at()
                    shared["g"][where_g] = dense_g
                elif request == _SLOPES:
                    slope_at()
                    jacobian_at()
                    shared["gradient"][where_slope] = dense_slope
                elif request == _CURVATURE:
                    hessian_at()
                else:
                    return int(ends())
            except BaseException as error:  # raised again where Python called
                self._error.append(error)
                return 1
            return 0

        self._structure = [
            np.array(part, dtype=np.intc)
            for part in (columns.colind(), columns.row(), curvature.colind(), curvature.row())
        ]
        arrays: list[np.ndarray[Any, Any]] = [*self._structure, *(shared[name] for name in _SHARED)]
        pointers = [array.ctypes.data for array in arrays]
        self._nlp = _Nlp(n, m, leading, *pointers, _Call(answer))

    def size(self, equations: Array) -> int:
        """Rows of the matrix that is factorised, if these rows (m,) are equations."""
        mask = np.ascontiguousarray(equations, dtype=np.int8)
        return int(self._library.nlp_gait_condensed_size(ctypes.byref(self._nlp), ctypes.c_void_p(mask.ctypes.data)))

    def __call__(self, **arguments: Array) -> dict[str, Array]:
        """See ``stages.Method``; multipliers of bounds are found anew."""
        n, m = len(self._shared["x"]), len(self._shared["g"])
        self._p[:], self._calls[:] = arguments["p"], 0
        self._error.clear()
        x, rows, sides = np.array(arguments["x0"], dtype=float), np.zeros(m), np.zeros(n)
        rows[:] = arguments.get("lam_g0", 0.0)
        limits = [np.ascontiguousarray(arguments[name], dtype=float) for name in ("lbx", "ubx", "lbg", "ubg")]
        iterations = ctypes.c_int(0)
        status = self._library.nlp_gait_condensed(
            ctypes.byref(self._nlp),
            ctypes.byref(self._settings),
            *(ctypes.c_void_p(array.ctypes.data) for array in (x, rows, sides, *limits)),
            ctypes.byref(iterations),
        )
        if self._error:
            raise self._error[0]
        values, slopes, curvature, _ = self._calls.tolist()
        self._stats = {
            "return_status": list(STATUSES)[status],
            "iter_count": iterations.value,
            "n_call_nlp_f": values,
            "n_call_nlp_g": values,
            "n_call_nlp_grad_f": slopes,
            "n_call_nlp_jac_g": slopes,
            "n_call_nlp_hess_l": curvature,
        }
        return {"x": x, "lam_g": rows, "lam_x": sides}

    def stats(self) -> dict[str, Any]:
        """See ``stages.Method``."""
        return self._stats


class _Buffered:
    """A CasADi function that reads nonzeros from arrays and writes them to arrays, None for an output that nobody wants."""

    def __init__(self, function: ca.Function, inputs: tuple[Array, ...], outputs: tuple[Array | None, ...]) -> None:
        self._kept = function, inputs, outputs
        self._buffer, self._trigger = function.buffer()
        for i, array in enumerate(inputs):
            self._buffer.set_arg(i, array.data)  # type: ignore[call-arg]  # the stub knows another form
        for i, output in enumerate(outputs):
            if output is not None:
                self._buffer.set_res(i, output.data)  # type: ignore[call-arg]

    def __call__(self) -> None:
        self._trigger()


@cache
def _library() -> ctypes.CDLL:
    """The method as machine code; raises InputError without a compiler."""
    source = native_source("nlp_gait.backends.solvers", *HEADERS)
    try:
        return load_library(source, find_compiler(), (*FLAGS, *lane_flags(native_lanes())), SYMBOLS)[0]
    except CompilerError as error:
        raise InputError(
            f"condensed is compiled where it runs, and needs a C++ compiler: {error}; use ipopt"
        ) from error
