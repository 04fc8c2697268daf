"""What it costs that every finished file is flushed to the disk: a study with and without it, in turns.

    python -m benchmarks.faults.flushing [--rounds 9] [--folder FOLDER]

The study is nao-ssp by IPOPT, PSO and GA in this process, 24 runs, each a record. Wall time, since a flush waits; the median of
the rounds' ratios counts. The folder says which disk is measured.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop
from nlp_gait.files import write_json

SETTINGS = StudySettings(
    problems=(ProblemSpec(name="nao-ssp"),),
    solvers=(SolverSpec(name="ipopt"), SolverSpec(name="pso"), SolverSpec(name="ga")),
    runs=8,
    starts=8,
    stop=Stop(evaluations=10_000),
)
FILES = 200


def timed(work: Callable[[Path], None], parent: Path, flushing: bool) -> float:
    """Wall time [s] of some work in a new folder."""
    fsync = os.fsync
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        if not flushing:
            os.fsync = lambda descriptor: None
        try:
            started = time.perf_counter()
            work(Path(folder))
            return time.perf_counter() - started
        finally:
            os.fsync = fsync


def study(folder: Path) -> None:
    """A whole study."""
    run_study(Study(tasks=SETTINGS.tasks(), folder=folder))


def files(folder: Path) -> None:
    """Small files, one after the other."""
    for number in range(FILES):
        write_json(folder / f"{number}.json", list(range(1000)))


def main() -> None:
    """Print both ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--folder", type=Path, default=Path.cwd())
    arguments = parser.parse_args()
    timed(study, arguments.folder, True)  # builds and compiles
    for name, work in (("study of 24 runs", study), (f"{FILES} files of 5 kB", files)):
        pairs = [
            [timed(work, arguments.folder, flushing) for flushing in (True, False)] for _ in range(arguments.rounds)
        ]
        ratio = statistics.median(with_it / without for with_it, without in pairs)
        least = [min(times) for times in zip(*pairs, strict=True)]
        print(f"{name}: {ratio:.3f} times as long (least times {least[0]:.3f} s and {least[1]:.3f} s)")


if __name__ == "__main__":
    main()
