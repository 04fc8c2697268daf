"""A problem's exact functions as an objective for searches, for many candidates at once: compiled, or interpreted.

Several threads may call one objective at once. Without a compiler CasADi's virtual machine evaluates the rows.
"""

import ctypes
import logging
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from random import Random
from typing import Any, Literal

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiler import (
    BASE_FLAGS,
    SYMBOLS,
    Compiler,
    find_compiler,
    lane_flags,
    load_library,
    native_lanes,
    write_rows_source,
)
from nlp_gait.errors import CompilerError, InputError, check_count, format_value
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.assembly import to_floats
from nlp_gait.formulation.locking import lock_casadi

_INTEGER, _POINTER = ctypes.c_longlong, ctypes.c_void_p
# Of the inputs of an objective, which all candidates share: parameters, lower and upper bounds, weights.
SHARED = b"\0\1\1\1\1"
BLOCK = 64  # candidates in one call of the virtual machine; more would only use more memory


class NativeRows:
    """Evaluates the rows of a batch in a compiled library; safe to call from several threads at once."""

    backend: Literal["compiled"] = "compiled"

    def __init__(self, source: str, compiler: Compiler, lanes: int, *, scalar_functions: bool = False) -> None:
        """Build the library for 1, 2, 4 or 8 lanes, or load it from the cache; raises CompilerError.

        With ``scalar_functions``, sines and the like take one lane after the other, so that no bit depends on the lane count.
        """
        scalar = ("-DNO_VECTOR_LIBM",) if scalar_functions else ()
        flags = (*BASE_FLAGS, *lane_flags(lanes), f"-DLANES={lanes}", *scalar)
        loaded, self.library = load_library(source, compiler, flags, SYMBOLS)
        self._evaluate = loaded.nlp_gait_evaluate_rows
        self._evaluate.argtypes = [_POINTER, _POINTER, _POINTER, _INTEGER, _POINTER]
        loaded.nlp_gait_rows_memory.restype = _INTEGER
        self._memory_size = int(loaded.nlp_gait_rows_memory())
        self._local = threading.local()

    def __call__(self, inputs: Sequence[Array], shared: bytes, outputs: Sequence[Array | None], rows: int) -> None:
        """Fill the outputs that are not None; all arrays contiguous, aligned doubles; 1 in ``shared``: one row for all."""
        local = self._local
        if not hasattr(local, "address"):  # scratch memory of the calling thread
            local.memory = np.empty(-(-self._memory_size // 8))
            local.inputs, local.outputs = (_POINTER * len(inputs))(), (_POINTER * len(outputs))()
            local.address = get_address(local.memory)
        local.inputs[:] = [get_address(array) for array in inputs]
        local.outputs[:] = [None if array is None else get_address(array) for array in outputs]
        if self._evaluate(local.inputs, shared, local.outputs, rows, local.address):
            raise RuntimeError("the compiled kernel reported a failure")

    def bind(self, inputs: Sequence[Array], outputs: Sequence[Array | None]) -> Callable[[], object]:
        """Return a function that evaluates one row of inputs and outputs that live as long as it, for one thread."""
        memory = np.empty(-(-self._memory_size // 8))
        given, results = (_POINTER * len(inputs))(), (_POINTER * len(outputs))()
        given[:] = [get_address(array) for array in inputs]
        results[:] = [None if array is None else get_address(array) for array in outputs]
        shared, address = bytes(len(inputs)), get_address(memory)
        return lambda: memory is not None and self._evaluate(given, shared, results, 1, address)


def get_address(array: Array) -> int:
    """Return the address of an array's first number."""
    address: int = array.__array_interface__["data"][0]
    return address


class InterpretedRows:
    """Evaluates an objective in CasADi's virtual machine, one thread at a time: many times slower, the same numbers."""

    backend: Literal["interpreted"] = "interpreted"

    def __init__(self, problem: GaitProblem) -> None:
        self._function = build_exact_model(problem).function

    @lock_casadi
    def __call__(self, inputs: Sequence[Array], shared: bytes, outputs: Sequence[Array | None], rows: int) -> None:
        """Fill the outputs as ``NativeRows`` of an objective, whose inputs share all but the first."""
        for first in range(0, rows, BLOCK):
            cut = slice(first, min(first + BLOCK, rows))
            X = inputs[0][cut]
            values = [np.array(value).T for value in self._function(X.T, inputs[1])[:3]]
            cost, violation = (np.where(np.isfinite(X).all(axis=1), value[:, 0], np.inf) for value in values[:2])
            for output, value in zip(outputs, (cost, values[2], violation), strict=True):
                if output is not None:
                    output[cut] = value


# Detects a wrong library, not rounding: compiled and interpreted values agree to about 1e-12.
CHECK_TOLERANCE = 1e-6
CHECK_POINTS = 5
LANE_COUNTS = (1, 2, 4, 8)


class CompiledObjective:
    """Objective and total violation of many candidates at once.

    Several threads and forked processes may call it. It can be pickled if its problem can, and is compiled or loaded again.
    """

    def __init__(
        self,
        problem: GaitProblem,
        evaluate_rows: NativeRows | InterpretedRows,
        rebuild: Callable[..., "CompiledObjective"],
    ) -> None:
        """Use ``compile_objective`` instead; ``rebuild`` makes this objective from its problem."""
        model = build_exact_model(problem)
        self.problem = problem  #: with the parameter values to use
        self.names = problem.names  #: (n,) variables
        self.lower = problem.lower  #: (n,) current lower bounds
        self.upper = problem.upper  #: (n,) current upper bounds
        self.row_names = model.row_names  #: (m,) constraint rows, in the order of ``constraints``
        self.backend: Literal["compiled", "interpreted"] = evaluate_rows.backend
        self._evaluate_rows = evaluate_rows
        self._shared = (np.array(problem.p), *model.row_bounds(problem), 1.0 / model.row_scales)
        #: (m - n,) names of the rows without their places, those of the variables left out
        self.groups = model.row_groups[: -len(self.names)]
        self._rebuild = rebuild
        self._local = threading.local()

    def __call__(self, X: Array | Mapping[str, float]) -> tuple[Array, Array]:
        """Return (P,) costs and (P,) violations of candidates X (P, n), or of one candidate by name, as in ``solution.x``.

        The cost is minimised: the objective, negated if the problem maximises it. The violation is summed over all
        constraint rows and bounds, each in units of its scale, zero if feasible. Both are infinite where X is not finite.
        Raises InputError if X has another shape, or does not consist of numbers.
        """
        X = self._check(X)
        f, violation = np.empty(len(X)), np.empty(len(X))
        self._evaluate(X, f, violation, None)
        return f, violation

    def point(self, x: Array | Sequence[float] | Mapping[str, float]) -> tuple[float, float]:
        """Return cost and violation of one candidate x (n,): several times faster than a batch of one."""
        local = self._local
        if not hasattr(local, "evaluate"):  # arrays of the calling thread
            local.x, local.values = np.empty(len(self.names)), np.empty(2)
            inputs, outputs = (local.x, *self._shared), (local.values[:1], None, local.values[1:])
            if isinstance(self._evaluate_rows, NativeRows):
                local.evaluate = self._evaluate_rows.bind(inputs, outputs)
            else:
                inputs = (local.x[None], *self._shared)
                local.evaluate = partial(self._evaluate_rows, inputs, SHARED, outputs, 1)
        if type(x) is np.ndarray and x.dtype == local.x.dtype and x.shape == local.x.shape:
            local.x[:] = x
        else:
            local.x[:] = self._check(x if isinstance(x, Mapping) else [x])[0]
        if local.evaluate():
            raise RuntimeError("the compiled kernel reported a failure")
        f, violation = local.values.tolist()
        return f, violation

    def constraints(self, X: Array | Mapping[str, float]) -> Array:
        """Return (P, m) values of all constraint rows, named by ``row_names``; the last n are the variables."""
        X = self._check(X)
        f, violation, g = np.empty(len(X)), np.empty(len(X)), np.empty((len(X), len(self.row_names)))
        self._evaluate(X, f, violation, g)
        return g

    def __reduce__(self) -> tuple[Callable[..., "CompiledObjective"], tuple[Any, ...]]:
        return self._rebuild, (self.problem,)

    def _evaluate(self, X: Array, f: Array, violation: Array, g: Array | None) -> None:
        self._evaluate_rows((X, *self._shared), SHARED, (f, g, violation), len(X))

    def _check(self, X: object) -> Array:
        if isinstance(X, Mapping):
            return self.problem.check_x(X)[None]
        array = np.require(to_floats(f"X of {self.problem.name}", X), requirements=("C", "A"))
        if array.ndim != 2 or array.shape[1] != len(self.names):
            wanted = f"one candidate per row and {len(self.names)} columns ({', '.join(self.names)})"
            raise InputError(f"X of {self.problem.name} must have {wanted}, got shape {array.shape}")
        return array


def compile_objective(
    problem: GaitProblem, *, require_compiler: bool = False, lanes: int | None = None
) -> CompiledObjective:
    """Return the exact objective and violation of a problem for batches of candidates.

    The library is built once and stored in the user's cache folder; other parameter values and bounds need no other library.

    Args:
        problem: with the parameter values to use.
        require_compiler: raise rather than fall back to the interpreter.
        lanes: candidates that one instruction works on, 1, 2, 4 or 8; None for what the CPU does best.

    Raises InputError for a count that is not allowed or a problem that is not searchable; CompilerError for ``require_compiler``.
    """
    if not isinstance(problem, GaitProblem):
        raise InputError(f"problem must be a problem from load, got {format_value(problem)}")
    if not isinstance(require_compiler, bool):
        raise InputError(f"require_compiler must be True or False, got {format_value(require_compiler)}")
    if not problem.searchable:
        n = len(problem.names)
        raise InputError(f"{problem.name} has {n} variables tied by equations, which no search can satisfy; use solve")
    if lanes is not None and check_count("lanes", lanes) not in LANE_COUNTS:
        raise InputError(f"lanes must be 1, 2, 4 or 8, got {lanes}")
    evaluate_rows: NativeRows | InterpretedRows
    try:
        evaluate_rows = problem.build_once(_build_native, find_compiler(), lanes or native_lanes())
    except CompilerError as error:
        if require_compiler:
            raise
        slow = "the objective is interpreted, which is many times slower: %s"
        logging.getLogger("nlp_gait").warning(slow, error)
        evaluate_rows = problem.build_once(InterpretedRows)
    rebuild = partial(compile_objective, require_compiler=require_compiler, lanes=lanes)
    return CompiledObjective(problem, evaluate_rows, rebuild)


def _build_native(problem: GaitProblem, compiler: Compiler, lanes: int) -> NativeRows:
    """Build the library, and check it against the virtual machine: CompilerError if half of the points differ.

    Not if a few of them do: where rounding decides a jump, both may be right.
    """
    model = build_exact_model(problem)
    source = write_rows_source(model.kernel, objective=True)
    native = NativeRows(source, compiler, lanes, scalar_functions=problem.hints.amplifies_rounding)
    draw = Random(0).random  # NumPy's generators would take a tenth of a process's start to import
    shares = np.array([[draw() for _ in problem.names] for _ in range(CHECK_POINTS)])
    X = problem.lower + shares * (problem.upper - problem.lower)
    inputs = X, np.array(problem.p), *model.row_bounds(problem), 1.0 / model.row_scales
    f, violation, g = np.empty(CHECK_POINTS), np.empty(CHECK_POINTS), np.empty((CHECK_POINTS, len(model.row_names)))
    native(inputs, SHARED, (f, g, violation), CHECK_POINTS)
    points = [model.at(x, problem.p) for x in X]
    computed, expected = np.column_stack([f, g]), [np.append(point.cost, point.g) for point in points]
    alike = np.isclose(computed, expected, rtol=CHECK_TOLERANCE, atol=CHECK_TOLERANCE, equal_nan=True).all(axis=1)
    if 2 * np.count_nonzero(alike) <= CHECK_POINTS:
        raise CompilerError(
            f"{native.library} computes other values than the virtual machine; delete it, and try another compiler (CXX)"
        )
    return native


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
