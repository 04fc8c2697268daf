"""Compiled functions that are not gaits against CasADi, NumPy and JAX.

One core; ratios are medians over rounds in which the paths take turns, of processor time. CasADi is called with
NumPy arrays, as ours is, and through its buffers, without conversions (columns with a star); its C code is compiled
with -O2 -march=native and called by its map.
"""

from __future__ import annotations

import importlib.util
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

import nlp_gait
from benchmarks.casadi_code import compiled_functions
from benchmarks.rows import Array, Row, ratio, scale_to_lanes, side_by_side
from nlp_gait.backends.kernel.compiler import native_lanes

BATCH, SHARE = 4096, 16  # CasADi's paths get a share of the batch
REPEATS = 20  # calls of a path in its turn, so that its data are in the cache
C_FLAGS = ("-O2", "-march=native", "-fvisibility=hidden", "-DGCC_HASCLASSVISIBILITY", "-w")
VARIABLES, STEPS, SAMPLES, HIDDEN = 20, 40, 50, 32
RNG = np.random.default_rng(0)
WEIGHTS = [RNG.normal(0.0, 0.4, size) for size in ((HIDDEN, 8), (HIDDEN, HIDDEN), (1, HIDDEN))]
TIMES = np.linspace(0.0, 5.0, SAMPLES)
DATA = 2.0 * np.exp(-0.7 * TIMES) + np.exp(-2.5 * TIMES) + RNG.normal(0.0, 0.01, SAMPLES)
PATHS = {
    "machine": "CasADi's map",
    "machine, buffers": "CasADi's map through buffers",
    "c": "CasADi's C code, -O2 -march=native",
    "c, buffers": "CasADi's C code through buffers",
    "numpy": "NumPy",
    "jax": "JAX",
}
REQUIRED = {"machine": 25, "c": 10}  # with eight lanes


class PlainFunction(NamedTuple):
    """A function of one vector, and the same for all rows of a batch over a module such as NumPy."""

    name: str
    function: ca.Function  # (n,) to (m,)
    vectorised: Callable[[Any, Any], Any]  # module, and X (P, n), to (P, m)
    lower: float  # of all entries of x
    upper: float


def make_functions() -> list[PlainFunction]:
    """Return the functions: SX and MX, with and without a loop."""
    x, u, w = ca.SX.sym("x", VARIABLES), ca.SX.sym("u", STEPS), ca.MX.sym("w", 8)
    rate, t, y, rates = ca.SX.sym("rate", 4), ca.SX.sym("t"), ca.SX.sym("y"), ca.MX.sym("rates", 4)
    error = ca.Function("error", [rate, t, y], [_decay(ca, rate.elements(), t, y)]).map(SAMPLES)
    errors = error(ca.repmat(rates, 1, SAMPLES), TIMES[None], DATA[None])
    first, second, third = WEIGHTS
    network = third @ ca.tanh(second @ ca.tanh(first @ w))
    return [
        PlainFunction(
            "rosenbrock",
            ca.Function("rosenbrock", [x], [_rosenbrock(x.elements())]),
            lambda xp, X: _rosenbrock(list(X.T)),
            -2.0,
            2.0,
        ),
        PlainFunction(
            "cart-pole",
            ca.Function("cart_pole", [u], [_cart_pole(ca, u.elements())]),
            lambda xp, X: _cart_pole(xp, list(X.T)),
            -10.0,
            10.0,
        ),
        PlainFunction(
            "network",
            ca.Function("network", [w], [network]),
            lambda xp, X: xp.tanh(xp.tanh(X @ first.T) @ second.T) @ third.T,
            -2.0,
            2.0,
        ),
        PlainFunction(
            "decay fit",
            ca.Function("fit", [rates], [ca.sum2(errors)]),
            lambda xp, X: _decay(xp, [X[:, i, None] for i in range(4)], TIMES, DATA).sum(axis=1),
            0.0,
            3.0,
        ),
    ]


def _rosenbrock(x: list[Any]) -> Any:
    """Sum of 100 (x[i+1] - x[i]^2)^2 + (1 - x[i])^2."""
    return sum(100.0 * (b - a * a) ** 2 + (1.0 - a) ** 2 for a, b in zip(x, x[1:], strict=False))


def _cart_pole(xp: Any, forces: list[Any]) -> Any:
    """Cost of a rollout of a cart (1 kg) with a pole (0.1 kg, half length 0.5 m) from rest, semi-implicit Euler, 20 ms."""
    position, angle, speed, rate, cost = 0.0, 0.1 + 0.0 * forces[0], 0.0, 0.0, 0.0
    for force in forces:
        s, c = xp.sin(angle), xp.cos(angle)
        push = (force + 0.05 * rate * rate * s) / 1.1
        turn = (9.81 * s - c * push) / (0.5 * (4.0 / 3.0 - 0.1 * c * c / 1.1))
        speed = speed + 0.02 * (push - 0.05 * turn * c / 1.1)
        rate = rate + 0.02 * turn
        position = position + 0.02 * speed
        angle = angle + 0.02 * rate
        cost = cost + position * position + 10.0 * angle * angle + 1e-3 * force * force
    return cost


def _decay(xp: Any, rates: list[Any], t: Any, y: Any) -> Any:
    """Squared error of the sum of two exponentials at a time."""
    return (rates[0] * xp.exp(-rates[1] * t) + rates[2] * xp.exp(-rates[3] * t) - y) ** 2


def measure(plain: PlainFunction, rounds: int) -> tuple[float, dict[str, float], float]:
    """Return the time of a row [us], how many times longer the others take, and the largest difference of a value."""
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
    casadis = ("machine", "machine, buffers", "c", "c, buffers")
    ratios = {
        name: ratio(times[name], times["ours"], SHARE if name in casadis else 1) for name in times if name != "ours"
    }
    difference = float((np.abs(found - expected) / np.maximum(1.0, np.abs(expected))).max())
    return float(np.median(times["ours"])) / BATCH / REPEATS * 1e6, ratios, difference


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


def rows(rounds: int) -> list[Row]:
    """Rows of the benchmarks' table."""
    found = []
    for plain in make_functions():
        time_us, ratios, difference = measure(plain, rounds)
        note = f"{time_us:.3f} us a row of {plain.function.size1_in(0)}, {native_lanes()} lanes, one core"
        found += [
            Row(
                name=f"{plain.name} against {PATHS[path]}",
                value=value,
                unit="x",
                required=scale_to_lanes(REQUIRED[path]) if path in REQUIRED else None,
                note=note,
            )
            for path, value in ratios.items()
        ]
        found.append(Row(name=f"{plain.name}: difference", value=difference, unit="", required=1e-12, at_most=True))
    return found
