"""Other NLP solvers of the CasADi wheel on the same lifted NLP as IPOPT."""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.interrupts import deferred_interrupts, never
from nlp_gait.backends.nlp import NlpModel, nlp_model
from nlp_gait.backends.solvers.ipopt import WIDTHS
from nlp_gait.backends.solvers.ipopt_end import STATUS_WORDS
from nlp_gait.backends.solvers.iteration_watch import INTERRUPTED, IterationWatch
from nlp_gait.errors import InputError
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import Evaluations

# Options that keep each solver from printing; a solver joins by a line here.
OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "fatrop": {"fatrop.print_level": 0},
    "sqpmethod": {
        "print_header": False,
        "print_iteration": False,
        "print_status": False,
        "qpsol_options": {"printLevel": "none", "error_on_fail": False},
    },
    "uno": {"uno.logger": "SILENT"},
}
# Those that can be ended between two iterations, at a time limit or by Ctrl-C; fatrop never asks.
WATCHED = ("sqpmethod", "uno")
PROBE_TIME_LIMIT_S = 60.0
PROBE = """
import sys
import casadi as ca
x = ca.MX.sym("x", 2)
problem = {"x": x, "f": (x[0] - 1) ** 2 + (x[1] - 2) ** 2, "g": x[0] + x[1]}
result = ca.nlpsol("probe", sys.argv[1], problem, {"print_time": False})(x0=0, ubg=2)
sys.exit(0 if abs(float(result["x"][0]) - 0.5) < 1e-4 else "wrong optimum")
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class NlpEnd:
    """Where a solver ended.

    Attributes:
        x: (n,) decision variables, within their bounds.
        success: as the solver itself claims.
        status: in the solver's own words.
        iterations: over all stages, where the solver tells.
        evaluations: over all stages; products with the Hessian count as gradients.
        build_s: time to make the solver, 0 if it was there [s].
        time_s: time of the solver [s].
    """

    x: Array
    success: bool
    status: str
    iterations: int
    evaluations: Evaluations
    build_s: float
    time_s: float


@cache
def probe(name: str) -> str | None:
    """Why a solver does not run in this installation, or None if it does.

    It is tried in another process on a small problem: a solver may be listed and still fail to load, or crash.

    Raises:
        InputError: not one of ``OPTIONS``.
    """
    if name not in OPTIONS:
        raise InputError(f"NLP solver must be one of {', '.join(OPTIONS)}, got {name!r}")
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE, name],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PROBE_TIME_LIMIT_S,
        )
    except subprocess.TimeoutExpired:
        return f"it does not end within {PROBE_TIME_LIMIT_S:g} s"
    if done.returncode == 0:
        return None
    said = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return said[-1] if said else f"it ends with status {done.returncode}"


def solve_with(name: str, problem: GaitProblem, x0: Array, time_limit_s: float | None = None) -> NlpEnd:
    """One run of a solver, with its own default settings, in IPOPT's stages of sigmoid width.

    Args:
        name: of the solver.
        problem: what is solved.
        x0: (n,) start point.
        time_limit_s: of wall time for all stages [s], checked after each iteration.

    Raises:
        InputError: the solver does not run here, or takes no time limit.
    """
    check_time_limit(name, time_limit_s)
    model = nlp_model(problem)
    started = time.perf_counter()
    solver, watch = problem.built(f"nlpsol {name}", lambda: _make(name, model))
    build_s = time.perf_counter() - started
    z0 = (np.clip(x0, problem.lower, problem.upper) - model.offset) / model.scale
    widths = WIDTHS if model.smoothed else WIDTHS[-1:]
    primal = np.concatenate([z0, np.array(model.lift_start(z0, problem.p, widths[0])).ravel()])
    bounds = model.bounds(problem)
    iterations, evaluations, stats = 0, Evaluations(), {}
    started = time.perf_counter()
    with deferred_interrupts() if name in WATCHED else contextlib.nullcontext(never) as interrupted:
        watch.begin(interrupted, math.inf if time_limit_s is None else started + time_limit_s)
        for width in widths:
            with _silent():
                result = solver(x0=primal, p=np.append(problem.p, width), **bounds)
            primal = np.array(result["x"]).ravel()
            stats = solver.stats()
            iterations += int(stats.get("iter_count") or 0)
            evaluations += _counts(stats)
            if watch.reason:
                break
    if watch.reason == INTERRUPTED or interrupted():
        raise KeyboardInterrupt
    finite = bool(np.isfinite(primal).all())
    said = STATUS_WORDS.get(watch.reason, f"{name} says {stats.get('return_status')!r}")
    x = model.offset + model.scale * primal[: model.variables] if finite else problem.lower
    return NlpEnd(
        x=np.clip(x, problem.lower, problem.upper),
        success=bool(stats["success"]) and finite and not watch.reason,
        status=said if finite else "it returned NaN or inf",
        iterations=iterations,
        evaluations=evaluations,
        build_s=build_s,
        time_s=time.perf_counter() - started,
    )


def check_time_limit(name: str, time_limit_s: float | None) -> None:
    """Refuse a time limit for a solver that cannot heed it.

    Raises:
        InputError: it cannot.
    """
    if time_limit_s is not None and name not in WATCHED:
        raise InputError(f"{name} cannot be stopped at a time limit; leave out {name}, or the limit")


def claimed(problem: GaitProblem, x: Array) -> tuple[float, float]:
    """Exact cost and total violation at a point."""
    cost, violation = exact_model(problem).function(x, problem.p)[:2]
    return float(cost), float(violation)


def _make(name: str, model: NlpModel) -> tuple[ca.Function, IterationWatch]:
    reason = probe(name)
    if reason is not None:
        raise InputError(f"NLP solver {name!r} does not run in this installation: {reason}")
    watch = IterationWatch(model.nlp)
    options = {"print_time": False, "error_on_fail": False, "iteration_callback": watch, **OPTIONS[name]}
    with _silent():
        return ca.nlpsol(name, name, model.nlp, options), watch


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Nothing written to stdout inside, not by C code either: qpOASES prints its licence whatever the options."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # else what C has buffered appears later
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def _counts(stats: Mapping[str, Any]) -> Evaluations:
    def calls(*names: str) -> int:
        return sum(int(stats.get(f"n_call_nlp_{name}", 0)) for name in names)

    products = int(stats.get("n_call_fwd1_nlp_grad_l", 0))
    return Evaluations(
        f=calls("f", "fg"),
        g=calls("g", "fg"),
        gradient=calls("grad_f", "jac_fg") + products,
        jacobian=calls("jac_g", "jac_fg"),
        hessian=calls("hess_l"),
    )
