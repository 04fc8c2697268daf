"""Compiled functions that are not gaits against CasADi, NumPy and JAX: ``python -m benchmarks.functions [--rounds N]``.

One core for all but the last columns; ratios are medians over rounds in which the paths take turns, of processor time. CasADi is
called with NumPy arrays, as ours is, and through its buffers, without conversions (columns with a star); its C code is compiled
with -O2 -march=native and called by its map.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import casadi as ca
import numpy as np

import nlp_gait
from benchmarks.casadi_code import compiled_functions
from benchmarks.plain_functions import PlainFunction, plain_functions
from benchmarks.rows import Array, Row, ratio, side_by_side
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.kernel.compiler import native_lanes

BATCH, SHARE, LARGE_BATCH = 4096, 16, 200_000  # CasADi's paths get a share of the batch
REPEATS = 20  # calls of a path in its turn, so that its data are in the cache
C_FLAGS = ("-O2", "-march=native", "-fvisibility=hidden", "-DGCC_HASCLASSVISIBILITY", "-w")


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One function by all paths."""

    name: str
    variables: int
    time_us: float  #: of one row, ours
    machine: float  #: ratios: how many times longer the others take; CasADi's virtual machine
    machine_buffers: float
    c_code: float
    c_buffers: float
    numpy: float
    jax: float | None  #: None where it is not installed
    threads: dict[int, float]  #: speed of several threads against one
    difference: float  #: largest to the virtual machine, relative to max(1, |value|)


def measure(plain: PlainFunction, rounds: int) -> Measurement:
    """Time a function by all paths, and compare its values."""
    f, n = plain.function, plain.function.size1_in(0)
    X = np.random.default_rng(1).uniform(plain.lower, plain.upper, (BATCH, n))
    ours = nlp_gait.compile_function(f, threads=1)
    few = X[: BATCH // SHARE]
    (c_code,) = compiled_functions([f], C_FLAGS)
    mapped, mapped_c = f.map(len(few)), c_code.map(len(few))
    machine_buffers, expected = _use_buffers(mapped, few, f.size1_out(0))
    c_buffers, _ = _use_buffers(mapped_c, few, f.size1_out(0))
    paths: dict[str, Callable[[], object]] = {
        "ours": lambda: ours(X),
        "machine": lambda: np.array(mapped(few.T)).T,
        "machine, buffers": machine_buffers,
        "c": lambda: np.array(mapped_c(few.T)).T,
        "c, buffers": c_buffers,
        "numpy": lambda: plain.vectorised(np, X),
    }
    with _one_core():
        if importlib.util.find_spec("jax"):
            paths["jax"] = _jax_path(plain, X)
        times = side_by_side({name: _repeat(path) for name, path in paths.items()}, rounds, time.process_time)
    found = np.asarray(ours(few)).reshape(len(few), -1)
    by_numpy = np.asarray(plain.vectorised(np, few)).reshape(len(few), -1)
    np.testing.assert_allclose(by_numpy, expected, rtol=1e-9, atol=1e-9)  # all paths compute the same function
    return Measurement(
        name=plain.name,
        variables=n,
        time_us=float(np.median(times["ours"])) / BATCH / REPEATS * 1e6,
        machine=ratio(times["machine"], times["ours"], SHARE),
        machine_buffers=ratio(times["machine, buffers"], times["ours"], SHARE),
        c_buffers=ratio(times["c, buffers"], times["ours"], SHARE),
        c_code=ratio(times["c"], times["ours"], SHARE),
        numpy=ratio(times["numpy"], times["ours"]),
        jax=ratio(times["jax"], times["ours"]) if "jax" in times else None,
        threads=_scale(f, np.resize(X, (LARGE_BATCH, n)), rounds),
        difference=float((np.abs(found - expected) / np.maximum(1.0, np.abs(expected))).max()),
    )


def _repeat(path: Callable[[], object]) -> Callable[[], None]:
    def call_often() -> None:
        for _ in range(REPEATS):
            path()

    return call_often


def _use_buffers(mapped: ca.Function, X: Array, size: int) -> tuple[Callable[[], object], Array]:
    """Return a call of CasADi's map over the rows of X without conversions, and the array (P, size) that it writes to."""
    results = np.empty((len(X), size))
    buffer, call = mapped.buffer()
    buffer.set_arg(0, memoryview(X))
    buffer.set_res(0, memoryview(results))

    def evaluate(keep: tuple[object, ...] = (buffer, X, mapped)) -> None:
        call()

    evaluate()
    return evaluate, results


def _jax_path(plain: PlainFunction, X: Array) -> Callable[[], object]:
    import jax

    jax.config.update("jax_enable_x64", True)
    compiled, placed = jax.jit(lambda rows: plain.vectorised(jax.numpy, rows)), jax.device_put(X)
    return lambda: compiled(placed).block_until_ready()


@contextmanager
def _one_core() -> Iterator[None]:
    """Restrict this thread, and those that it starts, to one core where the system can do that."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def _scale(f: ca.Function, X: Array, rounds: int) -> dict[int, float]:
    counts = [count for count in (1, 2, 4, 8, 16) if count <= available_cores()]
    paths = {str(count): nlp_gait.compile_function(f, threads=count) for count in counts}
    times = side_by_side({name: (lambda g=g: g(X)) for name, g in paths.items()}, max(3, rounds // 3))
    return {count: ratio(times["1"], times[str(count)]) for count in counts[1:]}


def rows(rounds: int) -> list[Row]:
    """Rows of the benchmarks' table."""
    found = []
    for each in (measure(plain, rounds) for plain in plain_functions()):
        note = f"{each.time_us:.3f} us a row of {each.variables}, {native_lanes()} lanes, one core"
        name = f"{each.name}, compiled function"
        found += [
            Row(name=f"{name} against CasADi's map", value=each.machine, unit="x", required=25, note=note),
            Row(name=f"{name} against CasADi's C code, -O2 -march=native", value=each.c_code, unit="x", required=10),
            Row(name=f"{name} against CasADi's map through buffers", value=each.machine_buffers, unit="x"),
            Row(name=f"{name} against CasADi's C code through buffers", value=each.c_buffers, unit="x"),
            Row(name=f"{name} against NumPy", value=each.numpy, unit="x"),
            Row(name=f"{name}: difference", value=each.difference, unit="", required=1e-12, at_most=True),
            *(Row(name=f"{name}, {count} threads", value=value, unit="x") for count, value in each.threads.items()),
        ]
        if each.jax is not None:
            found.append(Row(name=f"{name} against JAX", value=each.jax, unit="x"))
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.functions", description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="rounds in which the paths take turns")
    rounds = parser.parse_args().rounds
    print(f"{native_lanes()} lanes, batch {BATCH}; how many times longer the others take, on one core")
    counts = "".join(f"  {count} threads" for count in (2, 4, 8, 16) if count <= available_cores())
    print(f"{'function':12}  n  us a row   map  map*  C code  C code*  NumPy    JAX  difference{counts}")
    for plain in plain_functions():
        each = measure(plain, rounds)
        jax = "    -" if each.jax is None else f"{each.jax:5.1f}"
        casadi = f"{each.machine:4.0f}  {each.machine_buffers:4.0f}  {each.c_code:6.1f}  {each.c_buffers:7.1f}"
        scaling = "".join(f"  {value:8.2f}x" for value in each.threads.values())
        others = f"{each.numpy:5.1f}  {jax}  {each.difference:10.0e}{scaling}"
        print(f"{each.name:12} {each.variables:2d}  {each.time_us:8.4f}  {casadi}  {others}", flush=True)


if __name__ == "__main__":
    main()
