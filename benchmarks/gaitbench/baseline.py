"""Baseline of GaitBench: ``python -m benchmarks.gaitbench.baseline --work DIR``.

Runs every solver of the baseline on every instance, frozen or drawn, and writes their rows of the shipped table. The full records
stay in DIR, so that the same call continues with what is missing.
"""

from __future__ import annotations

import argparse
import csv
import io
import lzma
import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import ECDF_TARGETS
from compare.bench.leaderboard import (
    BASELINE,
    DRAWN_RUNS,
    RUNS,
    TABLE,
    BaselineRun,
    get_reference,
    list_baselines,
    load_table,
    plan_bench_runs,
)
from compare.study.record import RunRecord
from compare.study.run import Run
from compare.study.study import Study, run_study
from nlp_gait import gaitbench
from nlp_gait.files import replace_file, replace_nan, write_json
from nlp_gait.gaitbench.generated import is_generated

# A run of a gradient method on some thousand rows may take minutes; what it has by then counts.
GRADIENT_LIMIT_S = 60.0
DRAWN_FACTS = Path(__file__).parents[2] / "nlp_gait" / "gaitbench" / "drawn_facts.json"


def main() -> None:
    """Run what is missing, and write the table after each instance."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.gaitbench.baseline", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--work", type=Path, required=True, help="folder of the records")
    parser.add_argument("--instance", action="append", help="only this one; repeatable")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    ids = arguments.instance or (*gaitbench.list_instances(), *list_baselines(drawn=True))
    table = {id: list(rows) for id, rows in load_table().items()}
    for id in ids:
        started = time.perf_counter()
        tasks = plan_bench_runs([id], dict.fromkeys(BASELINE, ""), runs=DRAWN_RUNS if is_generated(id) else RUNS)
        study = Study(runs=tuple(map(limit_time, tasks)), folder=arguments.work, jobs=arguments.jobs)
        table[id] = make_rows(run_study(study))
        write_table(row for rows in table.values() for row in rows)
        print(f"{id}: {len(table[id])} runs ({time.perf_counter() - started:.1f} s)", flush=True)
    write_json(DRAWN_FACTS, {id: replace_nan(asdict(gaitbench.load(id).facts)) for id in table if is_generated(id)})


def limit_time(task: Run) -> Run:
    """Return the task, with a time limit for gradient methods."""
    return task if task.is_search else replace(task, time_limit_s=GRADIENT_LIMIT_S)


def make_rows(records: Sequence[RunRecord]) -> list[BaselineRun]:
    """Return the rows of all runs on one instance, by the order of solvers in the baseline."""
    id = records[0].problem
    references = {} if is_generated(id) else {id: get_reference(id)}
    (comparison,) = compare_problems(records, references=references)
    rows = []
    for solver in sorted(comparison.solvers, key=lambda s: BASELINE.index(s.name)):
        for record, curve in zip(solver.records, solver.curves, strict=True):
            times = [curve.cost_to_reach(target) for target in ECDF_TARGETS]
            row = BaselineRun(
                instance=comparison.problem,
                solver=solver.name,
                run=record.run,
                objective=record.objective if record.feasible else math.nan,
                in_history=len(curve.gap) > 0 and math.isfinite(curve.gap[-1]),
                evaluations=round(curve.total_cost()),
                times=tuple(round(time) for time in times if math.isfinite(time)),
            )
            rows.append(row)
    return rows


def write_table(rows: Iterable[BaselineRun], path: Path = TABLE) -> None:
    """Write the table; equal rows give an equal file."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in rows:
        numbers = repr(row.objective), int(row.in_history), row.evaluations, " ".join(map(str, row.times))
        writer.writerow((row.instance, row.solver, row.run, *numbers))
    with replace_file(path) as temporary:
        temporary.write_bytes(lzma.compress(text.getvalue().encode(), preset=9 | lzma.PRESET_EXTREME))


if __name__ == "__main__":
    main()
