"""Reproduce a paper and record the result, which the documentation shows: ``python -m benchmarks.papers nao [--quick]``."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.paper_runs import Runner

RECORDS = Path(__file__).parents[1] / "docs" / "papers"


def main() -> None:
    """Run, and copy ``summary.json`` and the figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.papers", description=__doc__.splitlines()[0])
    parser.add_argument("paper", choices=REPRODUCTIONS)
    parser.add_argument("--quick", action="store_true", help="without runs of the searches")
    parser.add_argument("--out", type=Path, default=Path("reproduction"), help="folder of the report")
    arguments = parser.parse_args()
    paper = load_reproduction(arguments.paper)
    effort = paper.quick if arguments.quick else paper.full
    command = f"python -m benchmarks.papers {arguments.paper}{' --quick' if arguments.quick else ''}"
    paper.reproduce(Runner(folder=arguments.out, progress=lambda line: print(line, flush=True)), effort, command)
    shutil.copy(arguments.out / "summary.json", RECORDS / f"{arguments.paper}.json")
    figures = RECORDS / arguments.paper
    shutil.rmtree(figures, ignore_errors=True)
    figures.mkdir()
    for figure in arguments.out.glob("*.svg"):
        shutil.copy(figure, figures)


if __name__ == "__main__":
    main()
