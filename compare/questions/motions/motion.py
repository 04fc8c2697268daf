"""Least power over motions of rising order, with free joints, on a coarse grid, and for other objectives."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.questions.question import Work
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaits.biped.curves import SPANS
from nlp_gait.gaits.capabilities import FITTED_STARTS, resolve
from nlp_gait.symbolic.trajectories import refine_spline

PHASES = ("nao-ssp", "nao-dsp")
INTERVALS = 10  # of the papers
ORDERS = tuple(SPANS)[:-1]
FREE_ORDERS = ("spline-2", "spline-4", "spline-8", "spline-16")
# Samples in each interval, so that no motion bends between them: with 4, free joints on 16 spans hide a tenth of their power.
SAMPLES, FREE_SAMPLES = 4, 8
SMOOTH_ORDER = "spline-4"
SMOOTH = ("jerk", "torque-smoothness")
# A grid with as many samples as the papers', between which a spline can hide violations.
COARSE = 1
PLANNED, COARSE_KIND, SMOOTHED, FREED = "planned", "coarse", "smooth", "free"
# Many variables may take longer than a usual solve.
SOLVER = IpoptSettings(time_limit_s=3600.0, iterations=1000)


@dataclass(frozen=True, kw_only=True)
class MotionTask:
    """One problem to solve."""

    kind: str  #: ``"planned"``, the same ``"coarse"`` with the papers' number of samples, ``"smooth"``, or ``"free"``
    problem: str  #: name
    options: Mapping[str, Any]  #: of the problem
    starts: int  #: random starts next to the one from a simpler motion's optimum

    @property
    def spec(self) -> ProblemSpec:
        """The problem as plain data."""
        return ProblemSpec(name=self.problem, options=self.options)

    @property
    def trajectory(self) -> str:
        """Order of its curves."""
        return str(self.options["trajectory"])

    @property
    def label(self) -> str:
        """File name without ending."""
        return "-".join(str(part) for part in (self.kind, self.trajectory, self.options.get("objective", "power")))


@dataclass(frozen=True, kw_only=True)
class SolvedMotion:
    """Optimum of one task."""

    task: MotionTask  #: what was solved
    seed: int  #: of the random starts
    variables: int  #: number of them
    status: str  #: in words
    feasible: bool  #: at least one start converged to a feasible point
    power_W: float  #: on the problem's own samples
    dense_power_W: float  #: on the judge's dense grid
    objectives: Mapping[str, float]  #: values of what the smooth tasks minimise, by name with its unit
    worst: str  #: constraint with the largest violation on the dense grid, with the amount; empty if there is none
    converged: int  #: starts that ended in a feasible optimum, of ``attempts``
    attempts: int  #: number of starts
    #: power at the end of each start, the one from the simpler motion first; None where it is infeasible
    powers_W: tuple[float | None, ...] = ()
    iterations: int  #: of the reported start
    time_s: float  #: wall time of IPOPT, all starts
    x: Mapping[str, float]  #: by variable name

    @property
    def coefficients(self) -> int:
        """Variables beyond the paper's."""
        return sum("[" in name for name in self.x)


def check_phase(name: str) -> None:
    """Raise InputError if the problem is not a phase whose motions can be compared."""
    if name not in PHASES:
        raise InputError(f"motions are compared for {' and '.join(PHASES)}, got {name!r}")


def load_phase(name: str, robot: str = "nao-v5", intervals: int = INTERVALS) -> GaitProblem:
    """Return a phase by name, with a robot and a number of intervals; raises as ``check_phase``."""
    check_phase(name)
    return ProblemSpec(name=name, options={"robot": robot, "intervals": intervals}).load()


def make_tasks(
    phase: str,
    *,
    orders: Sequence[str] = ORDERS,
    free_orders: Sequence[str] = FREE_ORDERS,
    robot: str = "nao-v5",
    intervals: int = INTERVALS,
    starts: int = 1,
) -> list[MotionTask]:
    """Return the tasks of one phase, in an order in which each can start from an earlier one.

    Raises InputError for another phase, or orders that do not rise.
    """
    check_phase(phase)
    for given in (orders, free_orders):
        if list(given) != [order for order in SPANS if order in given]:
            raise InputError(f"orders must rise and be among {', '.join(SPANS)}, got {', '.join(given)}")
    if not orders:
        raise InputError("there must be at least one order")

    def make(kind: str, trajectory: str, problem: str = phase, starts: int = 0, **more: Any) -> MotionTask:
        options = {"robot": robot, "intervals": intervals, "trajectory": trajectory}
        options |= {"samples_per_interval": SAMPLES, **more}
        return MotionTask(kind=kind, problem=problem, options=options, starts=starts)

    planned = [make(PLANNED, order, starts=starts) for order in orders]
    coarse = [make(COARSE_KIND, orders[-1], samples_per_interval=COARSE)]
    smooth = [make(SMOOTHED, SMOOTH_ORDER, objective=name) for name in SMOOTH if SMOOTH_ORDER in orders]
    free = [make(FREED, order, f"{phase}-free", samples_per_interval=FREE_SAMPLES) for order in free_orders]
    return [*planned, *coarse, *smooth, *free]


def solve_motion(task: MotionTask, earlier: Sequence[SolvedMotion], seed: int, work: Work) -> SolvedMotion:
    """Return the optimum of a task, which may start from an earlier motion."""
    problem = task.spec.load()
    x0 = find_start(task, problem, earlier)
    start = None if x0 is None else x0.tolist()
    inputs = {**fingerprint(problem), "task": asdict(task), "seed": seed, "start": start}
    function = partial(_solve_motion, task, problem, x0, seed, work.solver(SOLVER))
    name = f"{task.problem}-{task.label}-{{key}}"
    return work.compute(SolvedMotion, name, inputs, function, code=[sys.modules[__name__]])


def _solve_motion(task: MotionTask, problem: GaitProblem, x0: Array | None, seed: int, solver: Solver) -> SolvedMotion:
    first = None if x0 is None else np.clip(x0, problem.lower, problem.upper)
    solution = solve(problem, starts=task.starts + 1, seed=seed, x0=first, solver=solver)
    x = problem.check_x(solution.x)
    verdict = evaluate(problem, x, prove=False)
    return SolvedMotion(
        task=task,
        seed=seed,
        variables=len(problem.names),
        status=solution.status,
        feasible=solution.converged,
        power_W=verdict.indexes["power_W"],
        dense_power_W=(verdict.dense or {})["power_W"],
        objectives=_compute_objectives(task, x),
        worst="".join(f"{row.name} by {row.violation:.2g} {row.unit}" for row in verdict.dense_violations[:1]),
        converged=sum(start.converged for start in solution.starts),
        attempts=len(solution.starts),
        powers_W=tuple(start.objective if start.converged else None for start in solution.starts),
        iterations=solution.iterations,
        time_s=solution.time_s.solve,
        x=solution.x,
    )


def find_start(task: MotionTask, problem: GaitProblem, earlier: Sequence[SolvedMotion]) -> Array | None:
    """Return the richest earlier motion that this one contains; if there is none, free joints are fitted to a planned one."""
    spans = SPANS[task.trajectory]
    solved = [motion for motion in reversed(earlier) if motion.feasible and motion.task.kind in (PLANNED, FREED)]
    for motion in solved:
        simpler = motion.task.spec.with_options(trajectory=task.trajectory)
        if SPANS[motion.task.trajectory] <= spans and set(simpler.load().names) <= set(problem.names):
            return _embed(motion.x, problem.names, spans)
    if task.kind == FREED and solved:
        planned = solved[0].task.spec.load()
        start: Array = resolve(FITTED_STARTS, task.problem)(task.trajectory, planned, planned.check_x(solved[0].x))
        return start
    return None


def _embed(x: Mapping[str, float], names: Sequence[str], spans: int) -> Array:
    """The same motion with more spans, and zeros for curves that it lacks."""
    curves: dict[str, list[float]] = {}
    for name, value in x.items():
        curves.setdefault(name.partition("[")[0], []).append(value)
    values = [np.array(curves[name]) for name in names if "[" not in name]
    for curve in dict.fromkeys(name.partition("[")[0] for name in names if "[" in name):
        values.append(refine_spline(np.array(curves.get(curve, [])), spans))
    return np.concatenate(values)


def _compute_objectives(task: MotionTask, x: Array) -> dict[str, float]:
    """Jerk and torque rate of a motion, where some task minimises these."""
    if task.trajectory != SMOOTH_ORDER or task.kind not in (PLANNED, SMOOTHED):
        return {}
    problems = [task.spec.with_options(objective=name).load() for name in SMOOTH]
    return {f"{p.objective.name} [{p.objective.unit}]": build_exact_model(p).at(x, p.p).cost for p in problems}


def extrapolate(powers: Sequence[float]) -> float | None:
    """Return the limit of a sequence whose differences shrink by a constant factor, from its last three terms.

    None if they do not shrink, or if the limit would be farther away than the last two terms are apart.

    Source:
        Aitken's extrapolation, which is Richardson's for an unknown order.
    """
    if len(powers) < 3:
        return None
    first, second = powers[-3] - powers[-2], powers[-2] - powers[-1]
    return powers[-1] - second**2 / (first - second) if 0.0 < second <= first / 2 else None
