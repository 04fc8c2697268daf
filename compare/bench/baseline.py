"""The rules of GaitBench 1, and its shipped baseline: final objectives and running times to targets of twelve solvers.

``python -m benchmarks.gaitbench.baseline`` writes the table from full records.
"""

import csv
import lzma
import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

from compare.analysis.record_statistics import ECDF_TARGETS
from compare.analysis.units import is_zero
from compare.study.record import History, RunRecord, Times
from compare.study.run import EVALUATIONS, GRADIENT_SOLVERS, Inputs, ProblemSpec, Run, plan_runs
from nlp_gait import gaitbench
from nlp_gait.errors import InputError, format_value
from nlp_gait.gaitbench.facts import Subset
from nlp_gait.gaitbench.generated import is_generated, make_id

# Rules: the same runs, budget and seeds for all solvers.
RUNS = 15
BASELINE = tuple("random pso ga aco aco-grid cma de pymoo:GA pymoo:DE pymoo:ISRES slsqp ipopt".split())
DRAWN_RUNS = 3  # on each drawn instance
TABLE = Path(__file__).with_name("baseline.csv.xz")
BELOW = 1.0 - 1e-8  # of a target's gap: that of the run when it was reached, so that no rounding leaves it above
SEEDS = re.compile(r"([0-9]{1,12}):([0-9]{1,12})")
MOST_SEEDS = 1000


def choose_instances(
    suite: Subset | Literal["drawn"], instances: str | None = None, families: str | None = None, seeds: str = "0:5"
) -> tuple[str, ...]:
    """Return the ids of instances: of a suite, or those of a list, or those that families draw by seeds; both as texts.

    Raises as ``parse_seeds``, and UnknownNameError if there is no such instance or family.
    """
    chosen = () if instances is None else tuple(name.strip() for name in instances.split(","))
    if families is not None:
        drawn = parse_seeds(seeds)
        chosen += tuple(make_id(family.strip(), seed) for family in families.split(",") for seed in drawn)
    chosen = chosen or (list_baselines(drawn=True) if suite == "drawn" else gaitbench.list_instances(suite))
    for id in chosen:
        gaitbench.load(id)  # raises for unknown ids
    return chosen


def parse_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of ``0:15``, of which 15 is not one; raises InputError."""
    match = SEEDS.fullmatch(text)
    seeds = range(int(match[1]), int(match[2])) if match else range(0)
    if not 0 < len(seeds) <= MOST_SEEDS:
        raise InputError(f"--seeds takes FIRST:END, at most {MOST_SEEDS} seeds, got {format_value(text)}")
    return tuple(seeds)


def plan_bench_runs(
    instances: Sequence[str], solvers: Mapping[str, str], *, runs: int = RUNS, evaluations: int = EVALUATIONS
) -> tuple[Run, ...]:
    """Return the runs of some solvers, each with its label or an empty text, on some instances; run k has the seed k."""
    problems, labelled = [ProblemSpec(name=id) for id in instances], [(label, name) for name, label in solvers.items()]
    return plan_runs(problems, labelled, runs=runs, starts=runs, evaluations=evaluations)


class BaselineRun(NamedTuple):
    """One run of the baseline."""

    instance: str
    solver: str
    run: int  #: also the seed
    objective: float  #: in the problem's sense; NaN if no feasible point was found
    in_history: bool  #: whether the history ends at it; IPOPT without convergence has reached no target
    evaluations: int  #: equivalent ones of the whole run
    times: tuple[int, ...]  #: evaluations until each of ``ECDF_TARGETS``, as far as they were reached


@cache
def load_table(path: Path = TABLE) -> Mapping[str, tuple[BaselineRun, ...]]:
    """Return the rows of each instance."""
    rows: dict[str, list[BaselineRun]] = {}
    with lzma.open(path, "rt", encoding="utf-8", newline="") as file:
        for instance, solver, run, objective, in_history, evaluations, times in csv.reader(file):
            costs = int(evaluations), tuple(map(int, times.split()))
            row = BaselineRun(instance, solver, int(run), float(objective), in_history == "1", *costs)
            rows.setdefault(instance, []).append(row)
    return {instance: tuple(group) for instance, group in rows.items()}


def list_baselines(*, drawn: bool = False) -> tuple[str, ...]:
    """Return the ids of the instances with a baseline: drawn ones, or all others."""
    return tuple(id for id in load_table() if is_generated(id) is drawn)


@cache
def get_reference(instance: str) -> float:
    """Return the objective from which the table's gaps are: the best known one; of a drawn instance, the best of its rows."""
    loaded = gaitbench.load(instance)
    sign = loaded.gait_problem.objective.sign
    if not is_generated(instance):
        return sign * loaded.best_known
    return sign * min(sign * row.objective for row in load_table()[instance] if not math.isnan(row.objective))


@cache
def load_baseline(instance: str) -> tuple[RunRecord, ...]:
    """Return the runs of the baseline on an instance; raises InputError if none are shipped.

    A record has what rankings read: its final objective without its point, and the best so far where a target was reached.
    """
    if instance not in load_table():
        raise InputError(f"no baseline of {instance!r} is shipped; available: {', '.join(load_table())}")
    return tuple(map(make_record, load_table()[instance]))


def make_record(row: BaselineRun) -> RunRecord:
    """Return the record of a run of the baseline."""
    problem = gaitbench.load(row.instance).gait_problem
    inputs = Inputs(
        problem={"name": "gaitbench", "options": {"instance": row.instance}, "parameters": {}},
        objective=problem.objective,
        solver=row.solver,
        seed=row.run,
        handling="" if row.solver in GRADIENT_SOLVERS else "deb",
    )
    reference = get_reference(row.instance)
    unit = problem.objective.sign * (1.0 if is_zero(reference) else abs(reference))
    gaps = {time: target * BELOW for time, target in zip(row.times, ECDF_TARGETS, strict=False)}
    values: dict[int, float | None] = {time: reference + unit * gap for time, gap in gaps.items()}
    feasible = not math.isnan(row.objective)
    values[row.evaluations] = row.objective if row.in_history else None
    times = sorted(values)
    return RunRecord(
        problem=row.instance,
        solver=row.solver,
        run=row.run,
        inputs=inputs,
        reported_feasible=row.in_history,
        x=dict.fromkeys(problem.names, math.nan),
        objective=row.objective,
        violation=0.0 if feasible else math.nan,
        feasible=feasible,
        counts={"f": row.evaluations},
        history=History(evaluations=tuple(times), objective=tuple(values[time] for time in times)),
        time_s=Times(history=(math.nan,) * len(times)),
    )
