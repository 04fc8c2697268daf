"""Measure everything side by side, print a table and write JSON: ``python -m benchmarks [--quick] [--json FILE]``.

Absolute times belong to the machine and its load; ratios are medians over rounds in which the paths take turns.
"""

from __future__ import annotations

import argparse
import json
import platform
from dataclasses import asdict
from pathlib import Path

from benchmarks import functions, ipopt, kernel, process
from benchmarks.gaitbench import overhead
from benchmarks.rows import Row, table
from nlp_gait.backends.kernel.compiler import find_compiler, native_lanes


def main() -> None:
    """Run all groups and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds: a minute in place of several")
    parser.add_argument("--json", type=Path, default=Path("benchmarks.json"), help="file for the results")
    arguments = parser.parse_args()
    rounds, starts = (5, 5) if arguments.quick else (25, 20)
    machine = f"{platform.machine()}, {native_lanes()} lanes, {find_compiler().summary}"
    print(machine, flush=True)
    rows: list[Row] = []
    for group in (
        lambda: kernel.paths(rounds),
        lambda: kernel.torques(rounds),
        lambda: kernel.growth(rounds),
        lambda: functions.rows(max(5, rounds // 2)),
        lambda: kernel.swarms(max(3, rounds // 5)),
        lambda: ipopt.iteration(rounds),
        lambda: ipopt.few_rows(starts, required=50.0),
        lambda: ipopt.few_rows(starts, "nao-dsp"),
        lambda: [] if arguments.quick else ipopt.few_rows(starts, "nao-cycle"),
        lambda: ipopt.starts_at_once(3),
        lambda: process.starts(rounds),
        lambda: overhead.adapter(max(5, rounds // 2)),
    ):
        rows += group()
        print(".", end="", flush=True)
    print("\n" + table(rows))
    record = {
        "machine": machine,
        "python": platform.python_version(),
        "rows": [asdict(row) | {"met": row.met} for row in rows],
    }
    arguments.json.write_text(json.dumps(record, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
