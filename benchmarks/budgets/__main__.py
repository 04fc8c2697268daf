"""Who is best at which budget: ``python -m benchmarks.budgets --work DIR [--problem NAME ...] [--out DIR]``.

Runs every opponent on every problem until it is within 0.01 % of the best objective that IPOPT finds, or its budget ends, then
writes tables and a figure. Finished runs stay in DIR, so that the same call continues with what is missing.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from benchmarks.budgets.opponents import OPPONENTS, reference_of, reference_tasks, tasks_of
from benchmarks.budgets.page import Curves, curves_of, write_page
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec


def main() -> None:
    """Run what is missing, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.budgets", description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder of the records")
    parser.add_argument("--out", type=Path, help="folder of the page; DIR/page without it")
    parser.add_argument("--problem", action="append", help="repeatable; nao-ssp, nao-dsp and walk12 without it")
    parser.add_argument("--runs", type=int, default=5, help="of each opponent (bayes: at most 3)")
    parser.add_argument("--solvers", help="only these labels, separated by commas; the others' records are read")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    specs = [ProblemSpec(name=name) for name in arguments.problem or ("nao-ssp", "nao-dsp", "walk12")]
    chosen = arguments.solvers.split(",") if arguments.solvers else [opponent.label for opponent in OPPONENTS]
    references = {}
    found: dict[str, Curves] = {}
    for spec in specs:
        starts = run_study(Study(tasks=reference_tasks(spec), folder=arguments.work, jobs=arguments.jobs))
        references[spec.title] = reference_of(spec, starts)
        found[spec.title] = {"ipopt": curves_of(spec, starts, references[spec.title])}
        print(f"{spec.title}: best of {len(starts)} starts of IPOPT {references[spec.title]:.9g}", flush=True)
    for opponent in OPPONENTS:  # the dear ones come last, on every problem
        if opponent.label not in chosen:
            continue
        for spec in specs:
            started = time.perf_counter()
            tasks = tasks_of(spec, opponent, arguments.runs, references[spec.title])
            records = run_study(Study(tasks=tasks, folder=arguments.work, jobs=arguments.jobs))
            found[spec.title][opponent.label] = curves_of(spec, records, references[spec.title])
            used = ", ".join(f"{record.evaluations['f']:,}" for record in records)
            print(f"{spec.title}, {opponent.label}: {used} ({time.perf_counter() - started:.1f} s)", flush=True)
    for path in write_page(arguments.out or arguments.work / "page", found, arguments.runs):
        print(path)


if __name__ == "__main__":
    main()
