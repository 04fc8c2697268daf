"""Any other NLP solver that CasADi has, on the same lifted NLP as IPOPT."""

import contextlib
import ctypes
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solvers import solver as base
from nlp_gait.backends.solvers.solver import IterationWatch, Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.solution import Evaluations, Outcome
from nlp_gait.interrupts import defer_interrupts, never

PROBE_TIME_LIMIT_S = 60.0
# An infeasible step of a plugin's own solver of quadratic programs is a status, not an error.
OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "sqpmethod": {"qpsol_options": {"printLevel": "none", "error_on_fail": False}}
}
PROBE = """
import sys
import casadi as ca
x = ca.MX.sym("x", 2)
problem = {"x": x, "f": (x[0] - 1) ** 2 + (x[1] - 2) ** 2, "g": x[0] + x[1]}
result = ca.nlpsol("probe", sys.argv[1], problem, {"print_time": False})(x0=0, ubg=2)
sys.exit(0 if abs(float(result["x"][0]) - 0.5) < 1e-4 else "wrong optimum")
"""


@cache
def probe(name: str) -> str | None:
    """Return why a solver does not run in this installation, or None if it does.

    It solves a small problem in a separate process: a solver may be listed and still fail to load, or crash.
    """
    try:
        command, limit_s = [sys.executable, "-P", "-c", PROBE, name], PROBE_TIME_LIMIT_S
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=limit_s)
    except subprocess.TimeoutExpired:
        return f"it does not return within {PROBE_TIME_LIMIT_S:g} s"
    if done.returncode == 0:
        return None
    messages = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return messages[-1] if messages else f"it exits with status {done.returncode}"


@dataclass(frozen=True, kw_only=True)
class Nlpsol(Solver):
    """Any plugin of CasADi's ``nlpsol`` with its defaults, in IPOPT's stages of sigmoid width, each started from x alone."""

    name: ClassVar[str] = "nlpsol"

    plugin: str = "sqpmethod"  #: its name in CasADi: sqpmethod, uno, fatrop, ...
    #: limit of wall time for all stages [s], checked after each iteration (fatrop: after each stage); None for no limit
    time_limit_s: float | None = None

    def check(self, problem: GaitProblem) -> None:
        reason = probe(self.plugin)
        if reason is not None:
            raise InputError(f"nlpsol's plugin {self.plugin!r} does not run in this installation: {reason}")

    def to_dict(self) -> dict[str, Any]:
        return {"kind": self.name, "plugin": self.plugin}

    @lock_casadi
    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        self.check(problem)
        model = build_nlp(problem)
        solver, watch, create_s = problem.build_once(_build_solver, self.plugin)
        widths, bounds = model.widths, model.bounds(problem)
        primal = model.start(problem, x0, widths[0])
        iterations, evaluations = 0, Evaluations()
        stats: dict[str, Any] = {}
        started = time.perf_counter()
        with defer_interrupts() if stop is never else contextlib.nullcontext(stop) as pressed:
            watch.begin(pressed, math.inf if self.time_limit_s is None else started + self.time_limit_s)
            for width in widths:
                try:
                    with _silence_stdout():
                        result = solver(x0=primal, p=np.append(problem.p, width), **bounds)
                except RuntimeError as error:  # of the solver itself
                    stats = {"success": False, "return_status": str(error).strip().rpartition(": ")[2]}
                    break
                primal = np.array(result["x"]).ravel()
                stats = solver.stats()
                iterations += int(stats.get("iter_count") or 0)
                evaluations += base.count_evaluations(stats)
                if watch.reason or (width != widths[-1] and watch.eval(None) == [1]):
                    break
        if stop is never and (watch.reason == base.INTERRUPTED or pressed()):
            raise KeyboardInterrupt
        finite = bool(np.isfinite(primal).all())
        status = base.REASONS.get(watch.reason, f"{self.plugin} returned {stats.get('return_status')!r}")
        return base.judge_point(
            self.name,
            problem,
            x0,
            model.point(primal) if finite else problem.lower,
            claimed=bool(stats["success"]) and finite and not watch.reason,
            status=status if finite else "it returned NaN or inf",
            iterations=iterations,
            evaluations=evaluations,
            build_s=model.build_s,
            compile_s=create_s,
            time_s=time.perf_counter() - started,
        )


def _build_solver(problem: GaitProblem, plugin: str) -> tuple[ca.Function, IterationWatch, float]:
    """Return the solver of a problem's NLP, the watch of its iterations, and the time to build them [s]."""
    started = time.perf_counter()
    nlp = build_nlp(problem).nlp
    watch = IterationWatch(nlp)
    options = {"print_time": False, "error_on_fail": False, "iteration_callback": watch, **OPTIONS.get(plugin, {})}
    with _silence_stdout():
        return ca.nlpsol(plugin, plugin, nlp, options), watch, time.perf_counter() - started


@contextlib.contextmanager
def _silence_stdout() -> Iterator[None]:
    """Discard everything written to stdout inside, also by C code: qpOASES always prints its licence."""
    sys.stdout.flush()
    stdout, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # else what C has buffered appears later
        os.dup2(stdout, 1)
        os.close(stdout)
        os.close(nowhere)
