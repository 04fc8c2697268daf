"""Rows about the derivatives that IPOPT calls: our code against CasADi's C code and its virtual machine."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping
from unittest.mock import patch

import casadi as ca
import numpy as np

import nlp_gait
from benchmarks.casadi_code import FLAGS, compiled_functions
from benchmarks.rows import Array, Row, ratio, side_by_side
from nlp_gait.backends.derivatives.compiled import DERIVATIVES, CompiledNlp
from nlp_gait.backends.kernel.library_cache import FOLDER_VARIABLE
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solvers.ipopt import Ipopt, IpoptSettings
from nlp_gait.formulation import GaitProblem

NAMES = ("nlp_f", "nlp_g", *DERIVATIVES.values())
# Problems whose starts take long, with their options.
LONG = (
    ("nao-cycle", {}),
    ("nao-ssp-free", {"trajectory": "spline-8"}),
    ("stairs-track", {}),
    ("stairs-ideal", {}),
)
ITERATIONS = 5


def iteration(rounds: int) -> list[Row]:
    """All functions of one iteration at a new point, and the time to compile them."""
    problem = nlp_gait.load("nao-ssp")
    model = build_nlp(problem)
    p = np.append(problem.p, model.widths[0])
    with tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, {FOLDER_VARIABLE: folder}):
        started, worked = time.perf_counter(), _processor_s()
        CompiledNlp(model.nlp, p)
        cold, effort = time.perf_counter() - started, _processor_s() - worked
    usual = ca.nlpsol("usual", "ipopt", model.nlp, {"print_time": False})
    interpreted = {name: usual.get_function(name) for name in NAMES}
    listed = list(interpreted.values())
    usually, optimised = (
        dict(zip(NAMES, compiled_functions(listed, (optimisation, *FLAGS)), strict=True))
        for optimisation in ("-O0", "-O1")
    )
    w = model.start(problem, (problem.lower + problem.upper) / 2, model.widths[0])
    ours = CompiledNlp(model.nlp, p).functions
    ways = {"ours": ours, "usually": usually, "optimised": optimised, "interpreted": interpreted}
    callers = {name: _caller(functions, w, p) for name, functions in ways.items()}
    times = side_by_side(
        callers, max(rounds, 20), time.thread_time
    )  # many calls are shorter than a slice of a busy machine
    micro = {name: float(np.median(values)) * 1e6 for name, values in times.items()}
    return [
        Row(
            name="derivatives of an iteration, against CasADi's C code",
            value=ratio(times["usually"], times["ours"]),
            unit="x",
            required=12,
            ambition=25,
            note=f"f, g, gradient, Jacobian, Hessian: {micro['ours']:.0f} us against {micro['usually']:.0f} us at -O0, "
            "as they were compiled for IPOPT",
        ),
        Row(
            name="derivatives of an iteration, against CasADi's C code at -O1",
            value=ratio(times["optimised"], times["ours"]),
            unit="x",
            note=f"{micro['optimised']:.0f} us; it compiles four times as long as at -O0",
        ),
        Row(
            name="derivatives of an iteration, against the virtual machine",
            value=ratio(times["interpreted"], times["ours"]),
            unit="x",
        ),
        Row(
            name="time to compile derivatives, cold",
            value=effort,
            unit="s",
            required=3,
            ambition=1.5,
            at_most=True,
            note=f"processor time; {cold:.1f} s by the clock",
        ),
    ]


def long_starts() -> list[Row]:
    """The first iterations of a start of long problems, in processor time: compiled and interpreted take the same path."""
    rows = []
    for name, options in LONG:
        problem = nlp_gait.load(name, **options)
        x0 = problem.start_point(np.random.default_rng(0))
        seconds = {}
        for compiled in (True, False):
            solver = Ipopt(problem, IpoptSettings(compiled=compiled, iterations=ITERATIONS, hessian="exact"))
            seconds[compiled] = _start_s(solver, problem, x0)
        rows.append(
            Row(
                name=f"a start of {problem.address}, compiled",
                value=seconds[False] / seconds[True],
                unit="x",
                required=3,
                ambition=10,
                note=f"{ITERATIONS} iterations: {seconds[True]:.2f} s against {seconds[False]:.2f} s interpreted",
            )
        )
    return rows


def _start_s(solver: Ipopt, problem: GaitProblem, x0: Array) -> float:
    before = time.process_time()
    solver.run(problem, x0)
    return time.process_time() - before


def _processor_s() -> float:
    """Of this process and of those that it waited for."""
    return sum(os.times()[:4])


def _caller(functions: Mapping[str, ca.Function], w: Array, p: Array) -> Callable[[], None]:
    """Calls all functions at a point that is new each time, with arrays that are there already."""
    w, triggers = w.copy(), []
    weights = (np.ones(1), np.ones(functions["nlp_g"].nnz_out(0)))
    kept = []
    for name in NAMES:
        buffer, trigger = functions[name].buffer()
        given = (w, p, *(weights if name == "nlp_hess_l" else ()))
        for i, array in enumerate(given):
            buffer.set_arg(i, memoryview(array))
        results = [np.zeros(functions[name].nnz_out(i)) for i in range(functions[name].n_out())]
        for i, array in enumerate(results):
            buffer.set_res(i, memoryview(array))
        kept.append((buffer, results))
        triggers.append(trigger)

    def call() -> None:
        w[0] += 1e-9
        for trigger in triggers:
            trigger()

    call.kept = kept  # type: ignore[attr-defined]  # the buffers live as long as the function
    return call
