"""Baseline of GaitBench: ``python -m benchmarks.gaitbench.baseline --work DIR``.

Runs every solver of the baseline on every instance, one instance after the other, and packs an instance for shipping as soon as
all its runs are there. Finished runs stay in DIR, so that the same call continues with what is missing. With --pack drawn
instances in DIR are packed with their best known points, after ``nlp-gait bench --instances gb2:... --against ... --out DIR``.
"""

from __future__ import annotations

import argparse
import gzip
import json
import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from compare.bench.baseline import BASELINE, RUNS, load_baseline, locate_records, make_bench_study
from compare.study.definition import select_shared
from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.record_files import read_records
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec
from compare.study.task import Task
from nlp_gait import gaitbench
from nlp_gait.backends.identity import PROBES
from nlp_gait.errors import InputError
from nlp_gait.files import make_folder, replace_file, replace_nan, write_json

# A run of a gradient method on some thousand rows may take minutes; what it has by then counts.
GRADIENT_LIMIT_S = 60.0
DIGITS = 12  # of numbers in packed histories
DRAWN_FACTS = Path(__file__).parents[2] / "nlp_gait" / "gaitbench" / "drawn_facts.json"


def main() -> None:
    """Run what is missing."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.gaitbench.baseline", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--work", type=Path, required=True, help="folder of the records")
    parser.add_argument("--subset", choices=("small", "full"), default="full")
    parser.add_argument("--instance", action="append", help="only this one; repeatable")
    parser.add_argument(
        "--solvers", default=",".join(BASELINE), help="only these, separated by commas; the others stay"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--pack", action="store_true", help="pack the drawn instances of DIR instead")
    arguments = parser.parse_args()
    if arguments.pack:
        pack_drawn(arguments.work)
        return
    solvers = arguments.solvers.split(",")
    for id in arguments.instance or gaitbench.list_instances(arguments.subset):
        records: list[RunRecord] = []
        for solver in solvers:
            started = time.perf_counter()
            study = Study(
                tasks=tuple(map(limited, make_bench_study([id], SolverSpec(name=solver)).tasks())),
                folder=arguments.work,
                jobs=arguments.jobs,
            )
            done = run_study(study)
            records += done
            feasible = sum(record.verdict.feasible for record in done)
            took = time.perf_counter() - started
            print(f"{id}, {solver}: {feasible} of {RUNS} feasible ({took:.1f} s)", flush=True)
        if set(solvers) != set(BASELINE):
            records += [record for record in load_baseline(id) if record.solver not in solvers]
        records.sort(key=lambda record: (BASELINE.index(record.solver), record.run))
        path = pack_records(id, records)
        print(f"{id}: {path.stat().st_size / 1e3:.0f} kB", flush=True)


def pack_drawn(folder: Path) -> None:
    """Pack the records of drawn instances, and write their facts."""
    facts = {}
    for id, found in group_by_problem(read_records(folder)).items():
        records = sorted(found, key=lambda record: (BASELINE.index(record.solver), record.run))
        print(f"{id}: {len(records)} runs, {pack_records(id, records).stat().st_size / 1e3:.0f} kB", flush=True)
        facts[id] = replace_nan(asdict(gaitbench.load(id).facts))
    write_json(DRAWN_FACTS, facts)


def pack_records(instance: str, records: Sequence[RunRecord], folder: Path | None = None) -> Path:
    """Write the records of one instance, and return the file. Equal records give an equal file."""
    packed = [shorten(record) for record in records]
    shared: dict[str, Any] = {}
    for record in packed:
        if record.problem != instance:
            raise InputError(f"a record of {record.problem!r} does not belong to {instance!r}")
        definition = select_shared(record.definition)
        if shared.setdefault(record.solver, definition) != definition:
            raise InputError(f"runs of {record.solver!r} on {instance!r} differ in their settings")
    text = json.dumps([record.to_json() for record in packed], separators=(",", ":"))
    path = locate_records(instance, folder)
    make_folder(path.parent)
    with replace_file(path) as temporary:
        temporary.write_bytes(gzip.compress(text.encode(), compresslevel=9, mtime=0))
    return path


def shorten(record: RunRecord) -> RunRecord:
    """Return a record without what the leaderboard does not read; of its history, the changes of the best and the last entry."""
    counts, best, verdict = record.history.evaluations, record.history.objective, record.verdict
    kept = [k for k, value in enumerate(best) if value != (best[k - 1] if k else None) or k == len(best) - 1]
    # The instance has probes of its own in its facts.
    problem = {key: value for key, value in record.definition["problem"].items() if key != PROBES}
    return replace(
        record,
        definition={**record.definition, "problem": problem},
        x={name: _round(value) for name, value in record.x.items()},
        verdict=Verdict.make_plain(verdict.objective, verdict.violation, verdict.feasible),
        active_constraints=(),
        history=History(
            evaluations=tuple(counts[k] for k in kept),
            objective=tuple(None if (value := best[k]) is None else _round(value) for k in kept),
        ),
        time_s=Times.make_unknown(_round(record.time_s.solve, 4), (math.nan,) * len(kept)),
        origin=None,
    )


def _round(value: float, digits: int = DIGITS) -> float:
    return float(f"{value:.{digits}g}")


def group_by_problem(records: Iterable[RunRecord]) -> dict[str, list[RunRecord]]:
    """Return records by their problem."""
    groups: dict[str, list[RunRecord]] = {}
    for record in records:
        groups.setdefault(record.problem, []).append(record)
    return dict(sorted(groups.items()))


def limited(task: Task) -> Task:
    """The task, with a time limit for gradient methods."""
    return task if task.is_search else replace(task, stop=replace(task.stop, time_limit_s=GRADIENT_LIMIT_S))


if __name__ == "__main__":
    main()
