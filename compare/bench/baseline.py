"""The rules of GaitBench 1, and the shipped records of its baseline: one compressed file for each instance.

A packed record lacks time histories, the dense grid, prices and indexes.
"""

from __future__ import annotations

import gzip
import json
import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop
from nlp_gait import gaitbench
from nlp_gait.backends.identity import HASH
from nlp_gait.disk import make_folder
from nlp_gait.errors import InputError
from nlp_gait.files import replace_file, replace_nan
from nlp_gait.gaitbench.definitions import Subset
from nlp_gait.gaitbench.generated import list_test_seeds, make_id

# Rules: the same runs, budget and seeds for all solvers.
RUNS = 15
EVALUATIONS = 10_000  # as in the papers: 50 candidates, 200 generations
BASELINE = tuple("random pso ga aco aco-grid cma de pymoo:GA pymoo:DE pymoo:ISRES slsqp ipopt".split())
FOLDER = Path(__file__).with_name("records")
SEEDS = re.compile(r"([0-9]{1,12}):([0-9]{1,12})")
MOST_SEEDS = 1000
DIGITS = 12  # of numbers in the histories


def choose_instances(
    suite: Subset, instances: str | None = None, families: str | None = None, seeds: str = "0:5"
) -> tuple[str, ...]:
    """Return the ids of instances: of a suite, or those of a list, or those that families draw by seeds; both as texts.

    Raises:
        InputError: seeds that are not FIRST:LAST or numbers with commas.
        UnknownNameError: no such instance or family.
    """
    chosen = () if instances is None else tuple(name.strip() for name in instances.split(","))
    if families is not None:
        drawn = parse_seeds(seeds)
        chosen += tuple(make_id(family.strip(), seed) for family in families.split(",") for seed in drawn)
    chosen = chosen or gaitbench.names(suite)
    for id in chosen:
        gaitbench.load(id)  # raises for unknown ids
    return chosen


def parse_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of ``0:15`` (15 is not among them), ``3,5,8`` or ``test:5``, today's; raises InputError."""
    if text.startswith("test:") and text.removeprefix("test:").isdecimal():
        return list_test_seeds(datetime.now(UTC).date(), int(text.removeprefix("test:")))
    match = SEEDS.fullmatch(text)
    seeds = tuple(range(int(match[1]), int(match[2]))) if match else ()
    if not match and all(part.strip().isdecimal() for part in text.split(",")):
        seeds = tuple(int(part) for part in text.split(","))
    if not 0 < len(seeds) <= MOST_SEEDS:
        raise InputError(
            f"--seeds takes FIRST:END, test:COUNT or numbers with commas, at most {MOST_SEEDS}, got {text!r}"
        )
    return seeds


def make_bench_study(
    instances: Sequence[str], *solvers: SolverSpec, runs: int = RUNS, evaluations: int = EVALUATIONS
) -> StudySettings:
    """Return the study of some solvers on some instances; run k has the seed k."""
    problems = tuple(ProblemSpec(name=id) for id in instances)
    return StudySettings(problems=problems, solvers=solvers, runs=runs, starts=runs, stop=Stop(evaluations=evaluations))


def pack_records(instance: str, records: Sequence[RunRecord], folder: Path = FOLDER) -> Path:
    """Write the records of one instance, and return the file. Equal records give an equal file."""
    solvers: dict[str, dict[str, Any]] = {}
    for record in records:
        if record.problem != instance:
            raise InputError(f"a record of {record.problem!r} does not belong to {instance!r}")
        shared = {key: value for key, value in record.definition.items() if key != "seed"}
        # An instance is identified by its probe values: the hash of its mathematics depends on the version of CasADi.
        shared["problem"] = {key: value for key, value in shared["problem"].items() if key != HASH}
        entry = solvers.setdefault(record.solver, {"definition": shared, "settings": record.settings, "runs": []})
        if entry["definition"] != shared:
            raise InputError(f"runs of {record.solver!r} on {instance!r} differ in their settings")
        entry["runs"].append(_pack(record))
    text = json.dumps(replace_nan({"instance": instance, "solvers": solvers}), separators=(",", ":"))
    path = folder / f"{instance}.json.gz"
    make_folder(folder)
    with replace_file(path) as temporary:
        temporary.write_bytes(gzip.compress(text.encode(), compresslevel=9, mtime=0))
    return path


def list_instances(folder: Path = FOLDER) -> tuple[str, ...]:
    """Return the ids of the instances with baseline records."""
    return tuple(sorted(path.name.removesuffix(".json.gz") for path in folder.glob("*.json.gz")))


@cache
def load_baseline(instance: str, folder: Path = FOLDER) -> tuple[RunRecord, ...]:
    """Return the records of all solvers of the baseline on an instance; raises InputError if none are shipped."""
    path = folder / f"{instance}.json.gz"
    if not path.is_file():
        raise InputError(
            f"no baseline records of {instance!r} are shipped; available: {', '.join(list_instances(folder))}"
        )
    solvers = json.loads(gzip.decompress(path.read_bytes()))["solvers"]
    return tuple(_unpack(instance, solver, entry, run) for solver, entry in solvers.items() for run in entry["runs"])


def _pack(record: RunRecord) -> dict[str, Any]:
    """Return a run with the entries of its history at which the best changed, and the last one."""
    evaluations, objective = [], []
    last = len(record.history.objective) - 1
    before: float | None = None
    for k, (count, value) in enumerate(zip(record.history.evaluations, record.history.objective, strict=True)):
        if value != before or k == last:
            evaluations.append(count)
            objective.append(None if value is None else float(f"{value:.{DIGITS}g}"))
        before = value
    return {
        "run": record.run,
        "seed": record.seed,
        "status": record.status,
        "claimed": record.claimed,
        "x": [float(f"{value:.{DIGITS}g}") for value in record.x.values()],
        "claim": [record.claimed_objective, record.claimed_violation],
        "judged": [record.verdict.objective, record.verdict.violation, record.verdict.feasible],
        "calls": record.evaluations,
        "failed": record.failed_evaluations,
        "iterations": record.iterations,
        "solve_s": float(f"{record.time_s.solve:.4g}"),
        "history": [evaluations, objective],
    }


def _unpack(instance: str, solver: str, entry: dict[str, Any], run: dict[str, Any]) -> RunRecord:
    objective, violation, feasible = run["judged"]
    evaluations, values = run["history"]
    return RunRecord(
        problem=instance,
        solver=solver,
        run=run["run"],
        seed=run["seed"],
        definition={**entry["definition"], "seed": run["seed"]},
        settings=entry["settings"],
        status=run["status"],
        claimed=run["claimed"],
        x={str(k): value for k, value in enumerate(run["x"])},
        claimed_objective=run["claim"][0],
        claimed_violation=run["claim"][1],
        verdict=Verdict.make_plain(
            math.nan if objective is None else objective, math.inf if violation is None else violation, feasible
        ),
        evaluations=run["calls"],
        failed_evaluations=run["failed"],
        iterations=run["iterations"],
        active_constraints=(),
        history=History(evaluations=tuple(evaluations), objective=tuple(values)),
        time_s=Times.make_unknown(run["solve_s"], (math.nan,) * len(evaluations)),
    )
