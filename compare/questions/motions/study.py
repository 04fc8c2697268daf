"""What the papers' cubics cost: least power over motions of rising order, with free joints, and for other objectives."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.questions.motions.tasks import FREED, PLANNED, SMOOTH, SMOOTH_ORDER, SMOOTHED, MotionTask
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.decoding import decode
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaits.biped.curves import SPANS
from nlp_gait.gaits.nao.free_joints import fit_joints
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.symbolic.splines import refine_spline

# A study of many variables may take longer than a single solve of few.
TIME_LIMIT_S, ITERATIONS = 3600.0, 1000
CODE = [sys.modules[__name__]]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Optimum of one task.

    Attributes:
        task: what was solved.
        seed: of the random starts.
        variables: number of them.
        status: in words.
        success: at least one start converged to a feasible point.
        power_W: on the problem's own samples.
        dense_power_W: on the judge's dense grid.
        objectives: values of what the smooth tasks minimise, by name with its unit.
        worst: row that the dense grid finds violated most, with the amount; empty if none is.
        converged: starts that ended in a feasible optimum, of ``attempts``.
        attempts: number of starts.
        powers_W: power at the end of each start, the one from the simpler motion first; None where it is infeasible.
        iterations: of the start that is reported.
        time_s: wall time of IPOPT, all starts.
        x: by variable name.
    """

    task: MotionTask
    seed: int
    variables: int
    status: str
    success: bool
    power_W: float
    dense_power_W: float
    objectives: Mapping[str, float]
    worst: str
    converged: int
    attempts: int
    powers_W: tuple[float | None, ...] = ()
    iterations: int
    time_s: float
    x: Mapping[str, float]

    @property
    def coefficients(self) -> int:
        """Variables beyond the paper's."""
        return sum("[" in name for name in self.x)


def motions(
    study: Sequence[MotionTask],
    *,
    seed: int = 0,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> list[Motion]:
    """Solve all tasks; load the results that are stored.

    Args:
        study: see ``tasks``.
        seed: of the random starts.
        store: of finished results; None stores nothing.
        progress: told of each task when it is done.

    Raises:
        OutputError: a motion cannot be stored.
    """
    store = store or Store()
    solver = store_runs(store, IpoptSettings(time_limit_s=TIME_LIMIT_S, iterations=ITERATIONS))
    found: list[Motion] = []
    for task in study:
        problem = task.spec.load()
        x0 = _start(task, problem, found)
        start = None if x0 is None else x0.tolist()
        inputs = {**fingerprint(problem), "task": asdict(task), "seed": seed, "start": start}
        solved = partial(_solved, task, problem, x0, seed, solver)
        found.append(decode(Motion, store.compute(f"{task.problem}-{task.label}", inputs, solved, code=CODE)))
        progress(task.label)
    return found


def _solved(task: MotionTask, problem: GaitProblem, x0: Array | None, seed: int, solver: Solver) -> dict[str, Any]:
    """A motion as plain data."""
    solution = solve(
        problem,
        starts=task.starts + 1,
        seed=seed,
        x0=None if x0 is None else np.clip(x0, problem.lower, problem.upper),
        solver=solver,
    )
    x = problem.check_x(solution.x)
    verdict = evaluate(problem, x)
    dense = verdict.dense or {}
    motion = Motion(
        task=task,
        seed=seed,
        variables=len(problem.names),
        status=solution.status,
        success=solution.converged,
        power_W=verdict.indexes["power_W"],
        dense_power_W=dense["power_W"],
        objectives=_objectives(task, x),
        worst="".join(f"{row.name} by {row.violation:.2g} {row.unit}" for row in verdict.dense_violations[:1]),
        converged=sum(start.converged for start in solution.starts),
        attempts=len(solution.starts),
        powers_W=tuple(start.objective if start.converged else None for start in solution.starts),
        iterations=solution.iterations,
        time_s=solution.time_s.solve,
        x=solution.x,
    )
    return asdict(motion)


def _start(task: MotionTask, problem: GaitProblem, earlier: Sequence[Motion]) -> Array | None:
    """Start point from the richest earlier motion that this one contains, or if there is none, fitted to a planned one."""
    spans = SPANS[task.trajectory]
    solved = [m for m in reversed(earlier) if m.success and m.task.kind in (PLANNED, FREED)]
    for motion in solved:
        simpler = motion.task.spec.with_options(trajectory=task.trajectory)
        if SPANS[motion.task.trajectory] <= spans and set(simpler.load().names) <= set(problem.names):
            return _embedded(motion.x, problem.names, spans)
    for motion in solved if task.kind == FREED else ():
        planned = motion.task.spec.load()
        return fit_joints(task.trajectory, planned, planned.check_x(motion.x))  # type: ignore[arg-type]
    return None


def _embedded(x: Mapping[str, float], names: Sequence[str], spans: int) -> Array:
    """The same motion with more spans, and with the curves that it lacks at zero."""
    curves: dict[str, list[float]] = {}
    for name, value in x.items():
        curves.setdefault(name.partition("[")[0], []).append(value)
    found = [np.array(curves[name]) for name in names if "[" not in name]
    for curve in dict.fromkeys(name.partition("[")[0] for name in names if "[" in name):
        found.append(refine_spline(np.array(curves.get(curve, [])), spans))
    return np.concatenate(found)


def _objectives(task: MotionTask, x: Array) -> dict[str, float]:
    """Jerk and torque rate of a motion, where the study minimises these."""
    if task.trajectory != SMOOTH_ORDER or task.kind not in (PLANNED, SMOOTHED):
        return {}
    problems = [task.spec.with_options(objective=name).load() for name in SMOOTH]
    return {f"{p.objective.name} [{p.objective.unit}]": build_exact_model(p).at(x, p.p).cost for p in problems}


def limit(powers: Sequence[float]) -> float | None:
    """Limit of a sequence whose differences shrink by a constant factor, from its last three terms.

    None if they do not shrink, or if the limit would be farther away than the last two terms are apart.

    Source:
        Aitken's extrapolation, which is Richardson's for an unknown order.
    """
    if len(powers) < 3:
        return None
    first, second = powers[-3] - powers[-2], powers[-2] - powers[-1]
    return powers[-1] - second**2 / (first - second) if 0.0 < second <= first / 2 else None
