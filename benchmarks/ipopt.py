"""Rows about IPOPT: our derivatives against CasADi's C code and virtual machine, few rows against all, many starts."""

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
from benchmarks.rows import Array, Row, ratio, scale_to_lanes, side_by_side
from nlp_gait.backends.derivatives.compiled import DERIVATIVES, CompiledNlp
from nlp_gait.backends.kernel.compiler import FOLDER_VARIABLE
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solve import count_workers
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.formulation.solution import Outcome

NAMES = ("nlp_f", "nlp_g", *DERIVATIVES.values())
SAME_OPTIMUM = 1e-4  # relative


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
            required=scale_to_lanes(12),
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
            note=f"of processor; {cold:.1f} s by the clock",
        ),
    ]


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


def few_rows(starts: int, name: str) -> list[Row]:
    """Time of a start of IPOPT that begins with the rows that matter, and with all rows, from the same points in turn."""
    problem = nlp_gait.load(name)
    solvers = {few: IpoptSettings(compiled=True, few_rows=few).prepare(problem) for few in (True, False)}
    rng = np.random.default_rng(0)
    times: dict[bool, list[float]] = {few: [] for few in solvers}
    ends: dict[bool, list[Outcome]] = {few: [] for few in solvers}
    for _ in range(starts):
        x0 = problem.start_point(rng)
        for few, solver in solvers.items():
            started = time.process_time()
            ends[few].append(solver.run(problem, x0))
            times[few].append(time.process_time() - started)
    best = min(end.cost for outcomes in ends.values() for end in outcomes if end.converged)
    reached = {
        few: sum(end.converged and end.cost <= best + SAME_OPTIMUM * abs(best) for end in outcomes)
        for few, outcomes in ends.items()
    }
    few, every = (1e3 * np.array(times[few]) for few in (True, False))
    return [
        Row(
            name=f"a start of {name}, all rows against few",
            value=ratio(every, few),
            unit="x",
            required=1.0,
            note=f"{np.median(every):.0f} and {np.median(few):.0f} ms of processor",
        ),
        Row(
            name=f"IPOPT on few rows, starts of {name} that reach the best",
            value=reached[True],
            unit=f"of {starts}",
            note=f"with all rows {reached[False]}",
        ),
    ]


def starts_at_once(rounds: int, starts: int = 20) -> list[Row]:
    """Starts in one process and in as many as there are processors."""
    problem, solver, workers = nlp_gait.load("nao-ssp"), IpoptSettings(compiled=True), count_workers()
    times = side_by_side(
        {
            str(count): lambda count=count: nlp_gait.solve(problem, starts=starts, solver=solver, workers=count)
            for count in (1, workers)
        },
        rounds,
    )
    return [
        Row(
            name=f"{starts} starts in processes against one after the other",
            value=ratio(times["1"], times[str(workers)]),
            unit="x",
            required=1.8 if workers > 1 else None,
            note=f"{workers} processors, wall time: others' load counts",
        )
    ]
