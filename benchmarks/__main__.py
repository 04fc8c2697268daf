"""Measure everything side by side, print a table and write JSON: ``python -m benchmarks [--quick] [--json FILE] [GROUP ...]``.

Ratios are medians over rounds in which the paths take turns, and only they are required. Absolute times belong to the machine
and its load.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path

from benchmarks import ipopt, kernel, process
from benchmarks.gaitbench import overhead
from benchmarks.rows import Row, table
from nlp_gait.backends.kernel.compiler import find_compiler, native_lanes

# By name: a function of the number of rounds and of IPOPT's starts.
GROUPS: Mapping[str, Callable[[int, int], list[Row]]] = {
    "paths": lambda rounds, _: kernel.paths(rounds),
    "torques": lambda rounds, _: kernel.torques(rounds),
    "growth": lambda rounds, _: kernel.growth(rounds),
    "swarms": lambda rounds, _: kernel.swarms(max(1, rounds // 5)),
    "derivatives": lambda rounds, _: ipopt.iteration(rounds),
    "nao-ssp": lambda _, starts: ipopt.few_rows(starts, "nao-ssp"),
    "nao-dsp": lambda _, starts: ipopt.few_rows(starts, "nao-dsp"),
    "nao-cycle": lambda _, starts: ipopt.few_rows(starts, "nao-cycle"),
    "processes": lambda rounds, _: ipopt.starts_at_once(max(1, rounds // 8)),
    "start": lambda rounds, _: process.starts(max(1, rounds // 5)),
    "adapter": lambda rounds, _: overhead.adapter(max(1, rounds // 2)),
}
SLOW = "nao-cycle"  # minutes; left out by --quick


def main() -> None:
    """Run the groups and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=f"only these of {', '.join(GROUPS)}")
    parser.add_argument("--quick", action="store_true", help=f"fewer rounds and starts, without {SLOW}: 3 minutes")
    parser.add_argument("--json", type=Path, default=Path("benchmarks.json"), help="file for the results")
    arguments = parser.parse_args()
    if unknown := set(arguments.groups) - set(GROUPS):
        parser.error(f"unknown group {', '.join(sorted(unknown))}; choose from {', '.join(GROUPS)}")
    rounds, starts = (5, 5) if arguments.quick else (25, 20)
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    machine = (
        f"{platform.machine()}, {os.cpu_count()} processors{load}, {native_lanes()} lanes, {find_compiler().summary}"
    )
    print(machine, flush=True)
    rows: list[Row] = []
    for name in arguments.groups or [name for name in GROUPS if name != SLOW or not arguments.quick]:
        print(f"{name} ...", flush=True)
        rows += GROUPS[name](rounds, starts)
    print(table(rows))
    record = {
        "machine": machine,
        "python": platform.python_version(),
        "rows": [asdict(row) | {"met": row.met} for row in rows],
    }
    arguments.json.write_text(json.dumps(record, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
