"""CasADi functions compiled to SIMD code, CasADi's C over lanes, that evaluates batches of rows with threads."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from random import Random
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiled import CHECK_POINTS, NativeRows, RowThreads, check_agreement, check_parallelism
from nlp_gait.backends.kernel.compiler import find_compiler
from nlp_gait.backends.kernel.kernel_source import write_rows_source
from nlp_gait.errors import InputError, format_value, unknown
from nlp_gait.formulation import Array
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.numbers import to_floats

NAMES: dict[int, str] = {value: name for name, value in vars(ca).items() if name.startswith("OP_")}
_SCALAR = (
    "ASSIGN ADD SUB MUL DIV NEG EXP LOG POW CONSTPOW SQRT SQ TWICE SIN COS TAN ASIN ACOS ATAN LT LE EQ NE NOT AND OR FLOOR CEIL "
    "FMOD FABS SIGN COPYSIGN IF_ELSE_ZERO ERF FMIN FMAX INV SINH COSH TANH ASINH ACOSH ATANH ATAN2 CONST INPUT OUTPUT LOG1P "
    "EXPM1 HYPOT REMAINDER"
)
# Operations on whole matrices whose C code does the same for all lanes; others are expanded to scalar operations.
_MATRIX = (
    "CALL MTIMES TRANSPOSE DOT BILIN RANK1 HORZCAT VERTCAT DIAGCAT HORZSPLIT VERTSPLIT DIAGSPLIT RESHAPE SUBREF GETNONZEROS "
    "ADDNONZEROS SETNONZEROS PROJECT NORM2 NORM1 NORMF HORZREPMAT HORZREPSUM LIFT SPARSITY_CAST"
)
SCALAR = frozenset(getattr(ca, f"OP_{name}") for name in _SCALAR.split())
OPERATIONS = {"SXFunction": SCALAR, "MXFunction": SCALAR | {getattr(ca, f"OP_{name}") for name in _MATRIX.split()}}
# What expanding would leave out without a word.
NOT_EXPANDED = {f"the operation {name}" for name in ("assertion", "monitor", "printme", "dump")}
# Longer functions keep their loops and matrices: straight-line code is faster, but its compile time grows with its length.
MOST_EXPANDED = 5000
LOOPS = ("Map", "ThreadMap", "MapSum")


def make_kernel(function: ca.Function) -> ca.Function:
    """Return a function ``kernel`` with the same arguments and dense results; raises InputError where that is impossible."""
    for i, name in enumerate(function.name_in()):
        if not function.sparsity_in(i).is_dense():
            raise InputError(f"argument {name} of {function.name()} is sparse; make it dense with casadi.densify")
    if any(_find_unsupported(function)) or _count_operations(function) <= MOST_EXPANDED:
        function = _expand(function)
    symbols, results = apply_to_symbols(function)
    return ca.Function("kernel", symbols, [ca.densify(result) for result in results])


def apply_to_symbols(function: ca.Function) -> tuple[list[Any], list[Any]]:
    """Return symbols for the arguments, SX or MX as the function has them, and the results as expressions of these."""
    scalar = function.is_a("SXFunction")
    symbols: list[Any] = function.sx_in() if scalar else function.mx_in()
    return symbols, function.call(symbols, not scalar, False)


def _expand(function: ca.Function) -> ca.Function:
    unsupported = set(_find_unsupported(function))
    if not unsupported & NOT_EXPANDED:
        with suppress(RuntimeError):  # an operation has no form of scalar operations
            scalar = function.expand()
            unsupported = set(_find_unsupported(scalar))
            if not unsupported:
                return scalar
    raise InputError(
        f"{function.name()} cannot be compiled: {min(unsupported)} is not supported; compute it outside, or write it with "
        "arithmetic, comparisons and elementary functions"
    )


def _count_operations(function: ca.Function) -> int:
    if function.is_a("SXFunction"):
        return function.n_instructions()
    if function.class_name() in LOOPS:
        inner = function.find_functions(0)[0]
        counts = [function.numel_in(i) // max(1, inner.numel_in(i)) for i in range(function.n_in())]
        return _count_operations(inner) * max(counts)
    total = 0
    for k in range(function.n_instructions()):
        operation, node = function.instruction_id(k), function.instruction_MX(k)
        if operation == ca.OP_CALL:
            total += _count_operations(node.which_function())
        elif operation == ca.OP_MTIMES:
            total += 2 * node.nnz() * node.dep(1).size2()
        elif operation != ca.OP_OUTPUT:
            total += node.nnz()
    return total


def _find_unsupported(function: ca.Function) -> Iterator[str]:
    for called in (function, *function.find_functions()):
        kind = called.class_name()
        if kind in OPERATIONS:
            operations = {called.instruction_id(k) for k in range(called.n_instructions())} - OPERATIONS[kind]
            yield from (f"the operation {NAMES[operation][3:].lower()}" for operation in sorted(operations))
        elif kind not in LOOPS:
            yield f"the function {called.name()} ({kind})"


class CompiledFunction:
    """A CasADi function as native code, for many rows at once.

    Several threads and forked processes may call it. It can be pickled: it is compiled or loaded again where it is unpickled.
    """

    def __init__(self, function: ca.Function, kernel: ca.Function, threads: int, lanes: int) -> None:
        """Use ``compile_function`` instead; ``kernel`` is the function that is compiled."""
        self._native = NativeRows(write_rows_source(kernel), find_compiler(), lanes)
        self.function = function  #: CasADi's
        self.argument_names = tuple(function.name_in())
        self.result_names = tuple(function.name_out())
        #: shape of one row of each argument and result: () for a scalar, (n,) for a vector, (r, c) for a matrix
        self.argument_shapes = [_find_row_shape(function.size_in(i)) for i in range(function.n_in())]
        self.result_shapes = [_find_row_shape(function.size_out(i)) for i in range(function.n_out())]
        self.description = self._native.description  #: in words
        self._parallelism = threads, lanes
        self._threads = RowThreads(threads)

    def __call__(self, *arguments: Any) -> Array | tuple[Array, ...]:
        """Return the result, or a tuple of all results, for arguments with one row per evaluation.

        An argument is (P, n) for a vector, (P,) for a scalar, (P, r, c) for a matrix. One without the first axis is used in all
        rows. Results have shapes by the same rule; without any P, they are those of one evaluation. NaN and infinity are computed
        with as by CasADi. Raises InputError for a missing argument, another shape or number of rows, or what is not numbers.
        """
        if len(arguments) != len(self.argument_names):
            wanted = ", ".join(self.argument_names)
            raise InputError(f"{self.function.name()} has the arguments {wanted}; got {len(arguments)} arguments")
        described = zip(self.argument_names, self.argument_shapes, arguments, strict=True)
        inputs = [self._check(name, shape, values) for name, shape, values in described]
        counts = {len(values) for values, shared in inputs if not shared}
        if len(counts) > 1:
            raise InputError(
                f"the arguments of {self.function.name()} must have equally many rows, got {sorted(counts)}; an argument without "
                "the first axis is used in all rows"
            )
        rows = counts.pop() if counts else 1
        results = [np.empty((rows, *shape[::-1])) for shape in self.result_shapes]
        self._threads.run(rows, lambda cut: self._evaluate(inputs, results, cut))
        results = [result.swapaxes(1, 2) if result.ndim == 3 else result for result in results]
        if all(shared for _, shared in inputs):
            results = [result[0] for result in results]
        return results[0] if len(results) == 1 else tuple(results)

    @lock_casadi
    def jacobian(self, result: int | str = 0, argument: int | str = 0) -> "CompiledFunction":
        """Return the compiled derivative of a result by an argument, as a function of the same arguments.

        It is (P, m, n) for a vector (m,) by a vector (n,), and (P, n), the gradient, for a scalar. Matrices count column by
        column. Raises UnknownNameError, InputError for an operation that is not supported, or CompilerError.
        """
        i, k = _find("result", result, self.result_names), _find("argument", argument, self.argument_names)
        symbols, results = apply_to_symbols(self.function)
        name = f"{self.result_names[i]}_by_{self.argument_names[k]}"
        slope = ca.jacobian(ca.vec(results[i]), symbols[k])
        derivative = ca.Function(name, symbols, [slope], list(self.argument_names), [name])
        return _compile(derivative, *self._parallelism)

    def __reduce__(self) -> tuple[Callable[..., "CompiledFunction"], tuple[Any, ...]]:
        return _compile, (self.function, *self._parallelism)

    def _check(self, name: str, shape: tuple[int, ...], values: Any) -> tuple[Array, bool]:
        """Return an argument as contiguous rows, and whether all rows share it."""
        array = to_floats(f"argument {name} of {self.function.name()}", values)
        if array.shape[max(array.ndim - len(shape), 0) :] != shape or not 0 <= array.ndim - len(shape) <= 1:
            sizes = "".join(f", {size}" for size in shape)
            wanted = f"(P{sizes or ','}), or {shape} for all rows"
            raise InputError(
                f"argument {name} of {self.function.name()} must have the shape {wanted}, got {array.shape}"
            )
        if len(shape) == 2:
            array = array.swapaxes(-2, -1)  # CasADi's order
        return np.require(array, requirements=("C", "A")), array.ndim == len(shape)

    def _evaluate(self, inputs: Sequence[tuple[Array, bool]], results: Sequence[Array], cut: slice) -> None:
        rows = [values if shared else values[cut] for values, shared in inputs]
        outputs = [result[cut] for result in results]
        self._native(rows, bytes(shared for _, shared in inputs), outputs, cut.stop - cut.start)


def compile_function(
    function: ca.Function, *, threads: int | None = None, lanes: int | None = None
) -> CompiledFunction:
    """Return a CasADi function compiled for batches: it evaluates several rows with each instruction, and uses threads.

    The library is built once and stored in the user's cache folder. Mapped functions stay loops.

    Args:
        function: of dense arguments, SX or MX; sparse results become dense.
        threads: largest number of threads for a large batch; None for all cores. Results do not depend on it.
        lanes: rows that one instruction works on, 1, 2, 4 or 8; None for what the CPU does best.

    Raises InputError for a sparse argument, an operation that is not supported, or a count that is not allowed; CompilerError.
    """
    if not isinstance(function, ca.Function):
        raise InputError(f"function must be a casadi.Function, got {format_value(function)}")
    return _compile(function, *check_parallelism(threads, lanes))


@lock_casadi
def _compile(function: ca.Function, threads: int, lanes: int) -> CompiledFunction:
    """Compile a function, and check it against the virtual machine at random points."""
    if function.is_null() or not function.n_in() or not function.n_out():
        raise InputError("function must have at least one argument and one result")
    compiled = CompiledFunction(function, make_kernel(function), threads, lanes)
    draw = Random(0).random
    sizes = [function.size_in(i) for i in range(function.n_in())]
    points = [np.array([[draw() for _ in range(math.prod(s))] for _ in range(CHECK_POINTS)]) for s in sizes]
    results = [np.empty((CHECK_POINTS, function.numel_out(i))) for i in range(function.n_out())]
    compiled._evaluate([(values, False) for values in points], results, slice(0, CHECK_POINTS))
    check_agreement(function, points, results, compiled._native.library)
    return compiled


def _find_row_shape(size: tuple[int, int]) -> tuple[int, ...]:
    """Return the shape of one row: a scalar and a vector have no axis of length one."""
    return () if size == (1, 1) else (max(size),) if 1 in size else tuple(size)


def _find(kind: str, which: int | str, names: Sequence[str]) -> int:
    if which in names:
        return names.index(which)
    if isinstance(which, int) and 0 <= which < len(names):
        return which
    raise unknown(kind, str(which), [*names, *map(str, range(len(names)))])
