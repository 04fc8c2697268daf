"""Runs of a reproduction, stored in its folder, and what its tables need to know about several records."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.util import find_spec
from itertools import count, product
from pathlib import Path
from typing import Any

import numpy as np

from compare.report.document import Table, Value
from compare.study.memo import Computation, Memo
from compare.study.record import RunRecord, group_by
from compare.study.run import IPOPT, ProblemSpec, Run
from compare.study.study import RECORDS, Study, name_record, run_study
from metaheuristics import minimize
from metaheuristics.interface import Algorithm
from metaheuristics.registry import make_algorithm
from nlp_gait.backends.exact import ExactModel, build_exact_model, identify_problem
from nlp_gait.backends.kernel.compiled import available_cores, compile_objective
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.interrupts import Progress, ignore_progress

CLOUD = 50  # most points of a cloud

Runs = dict[tuple[str, str], list[RunRecord]]
"""Records in the order of their runs, by title of the problem and of the solver."""


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much a reproduction computes; a paper adds its numbers of evaluations and so on."""

    runs: int = 0  # of each search; without any, claims on runs have no verdict


@dataclass(frozen=True, kw_only=True)
class Runner:
    """Runs tasks and other computations of a reproduction; results that an earlier call has stored in its folder are read."""

    folder: Path  # of the reproduction
    progress: Progress = ignore_progress  # receives a line for each run and each computation
    jobs: int = field(default_factory=available_cores)  # worker processes; 1 runs in this process
    scheduler: str | None = None  # address of a Dask scheduler for the runs; other computations stay on this machine
    records: list[RunRecord] = field(default_factory=list)  # of all tasks, filled by ``run_tasks``

    def run_tasks(self, tasks: Iterable[Run]) -> Runs:
        """Run tasks with different titles, and return their records.

        Raises:
            InputError: a run failed before it had a point.
        """
        chosen = tuple(tasks)
        if not chosen:
            return Runs()
        study = Study(runs=chosen, folder=self.folder, jobs=self.jobs, scheduler=self.scheduler)
        finished, runs = count(1), Runs()
        records = run_study(
            study,
            lambda record: self.progress(f"{next(finished)} of {len(study.runs)}: {record.name}"),
            lambda stored: self.progress(f"{len(study.runs)} runs, {stored} of them stored by an earlier call"),
        )
        for record in records:
            if not record.x:
                file = self.folder / RECORDS / f"{name_record(record)}.json"
                raise InputError(f"{record.name} {record.status}; fix this and delete {str(file)!r}")
            runs.setdefault((record.problem, record.solver), []).append(record)
        self.records.extend(records)
        return runs

    def compute(self, computations: Iterable[tuple[str, Computation]]) -> dict[str, Any]:
        """Return results by name; they are computed again when their inputs have changed."""
        return Memo(self.folder).compute_all(dict(computations), jobs=self.jobs, progress=self.progress)


def make_computation(
    name: str, spec: ProblemSpec, function: Callable[..., Any], **arguments: Any
) -> tuple[str, Computation]:
    """Return a name and a function of plain arguments as a computation, which depends on these and on a problem."""
    return name, ({**identify_problem(spec.load()), **arguments}, partial(function, **arguments))


def make_start_tasks(
    problem: ProblemSpec,
    count: int,
    *,
    first: Sequence[Mapping[str, float]] = (),
    seed: int = 0,
    settings: Mapping[str, Any] | None = None,
) -> list[Run]:
    """Return tasks of IPOPT from the first points, then from random ones, drawn from one seed as by ``nlp_gait.solve``."""
    model, rng = problem.load(), np.random.default_rng(seed)
    points = [*first, *(model.by_name(model.start_point(rng)) for _ in range(count))]
    return [
        Run(problem=problem, solver=IPOPT, settings=settings or {}, seed=seed, number=run, start=point)
        for run, point in enumerate(points)
    ]


def make_search_tasks(problem: ProblemSpec, algorithms: Mapping[str, Algorithm], runs: int, budget: int) -> list[Run]:
    """Return tasks of searches by label; run k has seed k."""
    searches = product(algorithms.items(), range(runs))
    return [Run(problem=problem, solver=s, label=label, evaluations=budget, number=k) for (label, s), k in searches]


@cache
def _build(name: str | GaitProblem, options: tuple[tuple[str, Any], ...]) -> tuple[GaitProblem, ExactModel]:
    problem = ProblemSpec(name=name, options=dict(options)).load()
    return problem, build_exact_model(problem)


def evaluate_point(spec: ProblemSpec, x: Sequence[float]) -> Mapping[str, float]:
    """Return objective and metrics at x (n,) by the exact functions, which are built once for equal options."""
    problem, model = _build(spec.name, tuple(sorted(spec.options.items())))
    point = model.at(problem.check_x(x), problem.with_values(**spec.values).p)
    return {problem.objective.name: problem.objective.sign * point.cost, **point.metrics}


def collect_cloud(spec: ProblemSpec, algorithm: str, evaluations: int, seed: int = 0) -> list[list[float]]:
    """Return variables and objective (n + 1,) of feasible points in the order of a search, at most ``CLOUD`` of them."""
    parts = list[Array]()
    minimize(
        compile_objective(spec.load()),
        make_algorithm(algorithm),
        evaluations=evaluations,
        seed=seed,
        callback=lambda X, f, violation: parts.append(np.column_stack([X, f])[violation <= 0.0]),
    )
    points = np.concatenate(parts)
    chosen = np.unique(np.linspace(0, len(points) - 1, min(CLOUD, len(points))).astype(int))
    return [points[k].tolist() for k in chosen]


def simulate_point(spec: ProblemSpec, x: Sequence[float]) -> dict[str, float | None]:
    """Return what the engine measures of a gait that drives follow open loop; nothing without MuJoCo.

    Time of a fall [s], None without one; largest tilt [deg], landing error [m], rise of the torso [m], and the number of joints
    outside their limits.
    """
    if find_spec("mujoco") is None:
        return {}
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import measure
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.simulate import simulate_plan

    problem = spec.load()
    plan = make_plan(Result(problem=problem, x=problem.check_x(x)))
    simulation = simulate_plan(plan)
    measured = measure(plan, simulation, Drive())
    return {
        "fell_at_s": measured.fell_at_s,
        "tilt_deg": measured.largest_tilt_deg,
        "landing_m": max(measured.landing_errors_m.values(), default=0.0),
        "rise_m": float(simulation.torso[-1, 2] - simulation.torso[0, 2]),
        "outside": len(measured.joint_limits),
    }


def tabulate(name: str, caption: str, rows: Sequence[Mapping[str, Value]], *, prose: bool = False) -> Table:
    """Return a table of rows by heading, numbers to five digits."""
    columns, values = dict.fromkeys(rows[0], ".5g"), [[*row.values()] for row in rows]
    return Table(name=name, columns=columns, rows=values, caption=caption, prose=prose)


def tabulate_runs(records: Iterable[RunRecord]) -> Table:
    """Return how the runs of each solver end, on problems with runs of a search."""
    groups = group_by(records, lambda record: (record.problem, record.solver))
    searched = {problem for problem, solver in groups if solver != IPOPT}
    rows = list[Mapping[str, Value]]()
    for (problem, solver), runs in sorted(groups.items()):
        if problem in searched:
            ends = [run.objective for run in runs if run.feasible]
            least, median, largest = np.percentile(ends, (0, 50, 100)).tolist() if ends else (None, None, None)
            row: dict[str, Value] = {"problem": problem, "solver": solver, "runs": len(runs), "feasible": len(ends)}
            row |= {"least": least, "median": median, "largest": largest, "unit": runs[0].inputs.objective.unit}
            rows.append(row)
    return tabulate("runs", "Objective at the ends of the runs", rows)


def choose_best(records: Iterable[RunRecord]) -> RunRecord:
    """Return the best run: first those reported as feasible, then feasible ones, both by objective, then the least violation."""

    def rank(record: RunRecord) -> tuple[bool, bool, float]:
        by = record.inputs.objective.sign * record.objective if record.feasible else record.violation
        return not record.reported_feasible, not record.feasible, by

    return min(records, key=rank)


def get_history(record: RunRecord, points: int) -> Array:
    """Return the best objective (points,) at equal shares of the evaluations of a search; NaN before a feasible one."""
    counts, best = np.array(record.history.evaluations), np.array(record.history.objective, dtype=float)
    shares = np.linspace(counts[-1] / points, counts[-1], points)
    places = np.searchsorted(counts, shares, side="right") - 1
    return np.where(places < 0, np.nan, best[np.maximum(places, 0)])
