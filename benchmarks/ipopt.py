"""Rows about IPOPT: the lifted formulation against the naive one, interpreted against compiled derivatives."""

from __future__ import annotations

import time
from functools import reduce

import casadi as ca
import numpy as np
from casadi import MX, SX

import nlp_gait
from benchmarks.rows import Row
from nlp_gait.backends.derivatives.compiled import CompiledNlp
from nlp_gait.backends.nlp import NlpModel, build_nlp
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.formulation import GaitProblem, Point
from nlp_gait.symbolic.nonsmooth import Angle, Exact

QUIET = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
LIFTED = {**QUIET, "ipopt.mu_strategy": "adaptive", "ipopt.bound_relax_factor": 0.0}
WIDTH = 1e-2  # of the sigmoid, in the first stage


class Naive(Exact):
    """What one writes first: roots in place of absolute values and minima, acos as it is."""

    SMOOTHING = 1e-3

    def acos(self, argument: SX, margin: SX) -> Angle:
        """NaN beyond 1."""
        first = -1 / ca.sqrt(1 - argument**2)
        return Angle(ca.acos(argument), first, first * argument / (1 - argument**2))

    def abs(self, v: MX) -> MX:
        """Root of v^2 and a little more."""
        return ca.sqrt(v**2 + self.SMOOTHING**2)

    def min(self, *values: MX) -> MX:
        """By the smooth absolute value."""
        return reduce(lambda a, b: (a + b - self.abs(a - b)) / 2, values)

    def step(self, switch: MX, below: MX, above: MX) -> MX:
        """A sigmoid."""
        return below + 0.5 * (1 + ca.tanh(switch / self.SMOOTHING)) * (above - below)


def formulations(starts: int) -> list[Row]:
    """Starts that converge and iterations, lifted and naive."""
    problem = nlp_gait.load("nao-ssp")
    solver, arguments = _naive(problem)
    rng = np.random.default_rng(0)
    converged, iterations = 0, []
    for _ in range(starts):
        solver(x0=rng.uniform(0.0, 1.0, len(problem.names)), **arguments)
        converged += solver.stats()["return_status"] == "Solve_Succeeded"
        iterations.append(solver.stats()["iter_count"])
    solution = nlp_gait.solve(problem, starts=starts, seed=0, solver=IpoptSettings())
    lifted = [start.iterations for start in solution.starts]
    return [
        Row(
            name="starts that converge, lifted",
            value=sum(start.converged for start in solution.starts) / starts,
            unit="",
            note=f"{starts} starts, median {np.median(lifted):g} iterations",
        ),
        Row(
            name="starts that converge, naive",
            value=converged / starts,
            unit="",
            note=f"9 variables, smoothed, plain acos; median {np.median(iterations):g} iterations, 300 at most",
        ),
    ]


def _naive(problem: GaitProblem) -> tuple[ca.Function, dict[str, object]]:
    symbols, z = problem.symbols(), MX.sym("z", len(problem.names))
    offset = np.array([variable.lower for variable in problem.variables])
    point = Point(x=offset + problem.scale * z, p=symbols.p, positions=symbols.positions)
    assembly = problem.assemble(point, Naive())
    rows = [constraint.columns for constraint in assembly.constraints]
    g, lower, upper = (ca.vertcat(*(row[i] for row in rows)) for i in range(3))
    bounds = ca.Function("bounds", [symbols.p], [lower, upper])(problem.p)
    nlp = {"x": z, "p": symbols.p, "f": assembly.objective, "g": g}
    solver = ca.nlpsol("naive", "ipopt", nlp, {**QUIET, "ipopt.max_iter": 300, "show_eval_warnings": False})
    return solver, {"p": problem.p, "lbx": 0.0, "ubx": 1.0, "lbg": bounds[0], "ubg": bounds[1]}


def compiled_derivatives(starts: int) -> list[Row]:
    """One start of the first stage with interpreted and with compiled derivatives."""
    problem = nlp_gait.load("nao-ssp")
    model = build_nlp(problem)
    interpreted = ca.nlpsol("interpreted", "ipopt", model.nlp, LIFTED)
    started = time.perf_counter()
    native = CompiledNlp(model.nlp, np.append(problem.p, WIDTH))
    build_s = time.perf_counter() - started
    compiled = ca.nlpsol("compiled", "ipopt", native.nlp, {**LIFTED, **native.options})
    rng = np.random.default_rng(0)
    times: dict[str, list[float]] = {"interpreted": [], "compiled": []}
    iterations = []
    for _ in range(starts):
        arguments = _start(problem, model, rng.uniform(0.0, 1.0, model.variables))
        for name, solver in (("interpreted", interpreted), ("compiled", compiled)):
            started = time.perf_counter()
            solver(**arguments)
            times[name].append(time.perf_counter() - started)
        iterations.append(compiled.stats()["iter_count"])
    fast, slow = float(np.median(times["compiled"])), float(np.median(times["interpreted"]))
    return [
        Row(
            name="lifted IPOPT, compiled, one start",
            value=fast * 1e3,
            unit="ms",
            required=50,
            ambition=30,
            at_most=True,
            note=f"median {np.median(iterations):g} iterations; interpreted {slow * 1e3:.0f} ms",
        ),
        Row(
            name="derivatives, compiled or loaded",
            value=build_s,
            unit="s",
            note=f"if compiled now, it pays from {build_s / max(slow - fast, 1e-9):.0f} starts",
        ),
    ]


def _start(problem: GaitProblem, model: NlpModel, z: np.ndarray) -> dict[str, np.ndarray]:
    lower, upper = (np.array(bound).ravel() for bound in model.row_bounds(problem.p))
    free, n = np.full(model.lifted, np.inf), model.variables
    return {
        "x0": np.concatenate([z, np.array(model.lift_start(z, problem.p, WIDTH)).ravel()]),
        "p": np.append(problem.p, WIDTH),
        "lbx": np.concatenate([np.zeros(n), -free]),
        "ubx": np.concatenate([np.ones(n), free]),
        "lbg": np.concatenate([lower, np.zeros(len(model.tie_upper))]),
        "ubg": np.concatenate([upper, model.tie_upper]),
    }
