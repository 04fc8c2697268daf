"""Baseline of GaitBench: ``python -m benchmarks.gaitbench.baseline --work DIR``.

Runs every solver of the baseline on every instance, one instance after the other, and packs an instance for shipping as soon as
all its runs are there. Finished runs stay in DIR, so that the same call continues with what is missing. With --pack drawn
instances in DIR are packed with their best known points, after ``nlp-gait bench --instances gb2:... --against ... --out DIR``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path

from compare.bench.baseline import BASELINE, RUNS, load_baseline, make_bench_study, pack_records
from compare.study.record import RunRecord
from compare.study.record_files import read_records
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec
from compare.study.task import Task
from nlp_gait import gaitbench
from nlp_gait.files import replace_nan, write_json

# A run of a gradient method on some thousand rows may take minutes; what it has by then counts.
GRADIENT_LIMIT_S = 60.0
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
    for id in arguments.instance or gaitbench.names(arguments.subset):
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
