"""Baseline of GaitBench: ``python -m benchmarks.gaitbench.baseline --work DIR``.

Runs every solver of the baseline on every instance, one instance after the other, and packs an instance for shipping as soon as
all its runs are there. Finished runs stay in DIR, so that the same call continues with what is missing.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

from compare.bench.baseline import BASELINE, RUNS, load_baseline, make_bench_study, pack_records
from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec
from compare.study.task import Task
from nlp_gait import gaitbench

# A run of a gradient method on some thousand rows may take minutes; what it has by then counts.
GRADIENT_LIMIT_S = 60.0


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
    arguments = parser.parse_args()
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


def limited(task: Task) -> Task:
    """The task, with a time limit for gradient methods."""
    return task if task.is_search else replace(task, stop=replace(task.stop, time_limit_s=GRADIENT_LIMIT_S))


if __name__ == "__main__":
    main()
