"""CasADi functions compiled to SIMD code that evaluates batches of rows with threads."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.backends.functions.function_source import SYMBOLS, apply_to_symbols, make_kernel, write_rows_source
from nlp_gait.backends.kernel.compiled import CHECK_POINTS, check_agreement, check_parallelism
from nlp_gait.backends.kernel.compiler import BASE_FLAGS, find_compiler, lane_flags
from nlp_gait.backends.kernel.evaluators import get_address
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.backends.kernel.threads import RowThreads
from nlp_gait.errors import InputError, format_value, unknown
from nlp_gait.formulation import Array
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.numbers import to_floats


class CompiledFunction:
    """A CasADi function as native code, for many rows at once.

    Several threads and forked processes may call it. It can be pickled: it is compiled, or loaded from the cache folder, where it
    is unpickled.
    """

    def __init__(self, function: ca.Function, kernel: ca.Function, threads: int, lanes: int) -> None:
        """Use ``compile_function`` instead; ``kernel`` is the function that is compiled."""
        compiler = find_compiler()
        flags = (*BASE_FLAGS, *lane_flags(lanes), f"-DLANES={lanes}")
        library, self.library = load_library(write_rows_source(kernel), compiler, flags, SYMBOLS)
        self.function = function  #: CasADi's
        self.argument_names = tuple(function.name_in())
        self.result_names = tuple(function.name_out())
        #: shape of one row of each argument and result: () for a scalar, (n,) for a vector, (r, c) for a matrix
        self.argument_shapes = [_row_shape(function.size_in(i)) for i in range(function.n_in())]
        self.result_shapes = [_row_shape(function.size_out(i)) for i in range(function.n_out())]
        self.description = f"compiled by {compiler.summary}, {lanes} rows at a time"  #: in words
        self._native = library.nlp_gait_evaluate_rows
        library.nlp_gait_rows_memory.restype = ctypes.c_longlong
        self._memory_size = int(library.nlp_gait_rows_memory())
        self._local = threading.local()
        self._parallelism = threads, lanes
        self._threads = RowThreads(threads)

    def __call__(self, *arguments: Any) -> Array | tuple[Array, ...]:
        """Return the result, or a tuple of all results, for arguments with one row per evaluation.

        An argument is (P, n) for a vector, (P,) for a scalar, (P, r, c) for a matrix. One without the first axis is used in all
        rows. Results have shapes by the same rule; without any P, they are those of one evaluation. NaN and infinity are computed
        with as by CasADi.

        Raises:
            InputError: an argument is missing, has another shape or another number of rows, or does not consist of numbers.
        """
        if len(arguments) != len(self.argument_names):
            wanted = ", ".join(self.argument_names)
            raise InputError(f"{self.function.name()} has the arguments {wanted}; got {len(arguments)} arguments")
        pieces = [self._check(*each) for each in zip(self.argument_names, self.argument_shapes, arguments, strict=True)]
        counts = {len(values) for values, shared in pieces if not shared}
        if len(counts) > 1:
            raise InputError(
                f"the arguments of {self.function.name()} must have equally many rows, got {sorted(counts)}; an argument without "
                "the first axis is used in all rows"
            )
        rows = counts.pop() if counts else 1
        results = [np.empty((rows, *shape[::-1])) for shape in self.result_shapes]
        self._threads.run(rows, lambda cut: self._evaluate(pieces, results, cut))
        found = [result.swapaxes(1, 2) if result.ndim == 3 else result for result in results]
        if all(shared for _, shared in pieces):
            found = [result[0] for result in found]
        return found[0] if len(found) == 1 else tuple(found)

    @lock_casadi
    def jacobian(self, result: int | str = 0, argument: int | str = 0) -> CompiledFunction:
        """Return the compiled derivative of a result by an argument, as a function of the same arguments.

        It is (P, m, n) for a vector (m,) by a vector (n,), and (P, n), the gradient, for a scalar. Matrices count column by
        column.

        Raises:
            UnknownNameError: no result or argument has this name.
            InputError: the derivative uses an operation that is not supported.
            CompilerError: the compiler fails.
        """
        i, k = _find("result", result, self.result_names), _find("argument", argument, self.argument_names)
        symbols, results = apply_to_symbols(self.function)
        name = f"{self.result_names[i]}_by_{self.argument_names[k]}"
        slope = ca.jacobian(ca.vec(results[i]), symbols[k])
        derivative = ca.Function(name, symbols, [slope], list(self.argument_names), [name])
        return _compile(derivative, *self._parallelism)

    def __reduce__(self) -> tuple[Callable[..., CompiledFunction], tuple[Any, ...]]:
        return _compile, (self.function, *self._parallelism)

    def _check(self, name: str, shape: tuple[int, ...], values: Any) -> tuple[Array, bool]:
        """Return an argument as contiguous rows, and whether all rows share it."""
        array = to_floats(f"argument {name} of {self.function.name()}", values)
        if array.shape[max(array.ndim - len(shape), 0) :] != shape or not 0 <= array.ndim - len(shape) <= 1:
            sizes = "".join(f", {size}" for size in shape)
            raise InputError(
                f"argument {name} of {self.function.name()} must have the shape (P{sizes or ','}), or {shape} for all rows, got "
                f"{array.shape}"
            )
        if len(shape) == 2:
            array = array.swapaxes(-2, -1)  # CasADi's order
        return np.require(array, requirements=("C", "A")), array.ndim == len(shape)

    def _evaluate(self, pieces: Sequence[tuple[Array, bool]], results: Sequence[Array], cut: slice) -> None:
        if not hasattr(self._local, "memory"):  # scratch memory of the calling thread
            self._local.memory = np.empty(-(-self._memory_size // 8))
            self._local.address = ctypes.c_void_p(get_address(self._local.memory))
        inputs = [get_address(values if shared else values[cut]) for values, shared in pieces]
        outputs = [get_address(result[cut]) for result in results]
        failed = self._native(
            (ctypes.c_void_p * len(inputs))(*inputs),
            bytes(shared for _, shared in pieces),
            (ctypes.c_void_p * len(outputs))(*outputs),
            ctypes.c_longlong(cut.stop - cut.start),
            self._local.address,
        )
        if failed:
            raise RuntimeError(f"{self.function.name()} reported a failure")


def compile_function(
    function: ca.Function, *, threads: int | None = None, lanes: int | None = None
) -> CompiledFunction:
    """Return a CasADi function compiled for batches: it evaluates several rows with each instruction, and uses threads.

    The library is built once and stored in the user's cache folder. Mapped functions stay loops.

    Args:
        function: of dense arguments, SX or MX; sparse results become dense.
        threads: largest number of threads for a large batch; None for all cores. Results do not depend on it.
        lanes: rows that one instruction works on, 1, 2, 4 or 8; None for what the CPU does best.

    Raises:
        InputError: not a function, a sparse argument, an operation that is not supported, or a count that is not allowed.
        CompilerError: there is no compiler, or it fails.
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
    points = [
        np.array([[draw() for _ in range(rows * columns)] for _ in range(CHECK_POINTS)]) for rows, columns in sizes
    ]
    results = [np.empty((CHECK_POINTS, function.numel_out(i))) for i in range(function.n_out())]
    compiled._evaluate([(values, False) for values in points], results, slice(0, CHECK_POINTS))
    expected = [
        function.call([ca.reshape(ca.DM(part), *size) for part, size in zip(point, sizes, strict=True)])
        for point in zip(*points, strict=True)
    ]
    flat = [np.concatenate([ca.vec(ca.densify(value)).full().ravel() for value in values]) for values in expected]
    check_agreement(np.concatenate(results, axis=1), np.array(flat), compiled.library)
    return compiled


def _row_shape(size: tuple[int, int]) -> tuple[int, ...]:
    """Return the shape of one row: a scalar and a vector have no axis of length one."""
    return () if size == (1, 1) else (max(size),) if 1 in size else tuple(size)


def _find(kind: str, which: int | str, names: Sequence[str]) -> int:
    if which in names:
        return names.index(which)
    if isinstance(which, int) and 0 <= which < len(names):
        return which
    raise unknown(kind, str(which), [*names, *map(str, range(len(names)))])
