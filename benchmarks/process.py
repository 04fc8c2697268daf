"""Rows about a process from its start to the first value: time with an empty and a full cache, and memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

import numpy as np

from benchmarks.rows import Row, ratio

FIRST_VALUE = """
import nlp_gait
problem = nlp_gait.load("nao-ssp")
objective = nlp_gait.compile_objective(problem, require_compiler=True)
objective(((problem.lower + problem.upper) / 2)[None])
"""
LIBRARIES = "import casadi, numpy\n"
PEAK = "print(int(next(line for line in open('/proc/self/status') if line.startswith('VmHWM')).split()[1]) / 1024)"  # Linux
REQUIRED = {"cold": 10.0, "warm": 3.5}  # measured: 8.6 and 3.0 on a loaded machine
BATCH = "objective((problem.lower + (problem.upper - problem.lower) * 0.5)[None].repeat(100_000, axis=0))\n"


def starts(rounds: int) -> list[Row]:
    """Processor time of ``python -c`` to the first value: compiler included (cold), or its library in the cache (warm).

    Bytecode is there, as pip compiles it; the first process of all compiles it here, and its time is in the note.
    """
    cold, warm, bare = [], [], list[float]()
    with tempfile.TemporaryDirectory() as bytecode:
        for _ in range(1 + rounds):
            with tempfile.TemporaryDirectory() as cache:
                cold.append(_processor_s(FIRST_VALUE, cache, bytecode))
                warm.append(_processor_s(FIRST_VALUE, cache, bytecode))
            bare.append(_processor_s(LIBRARIES, cache, bytecode))
        memory = float(_run(FIRST_VALUE + PEAK, cache, bytecode))
        more = float(_run(FIRST_VALUE + BATCH + PEAK, cache, bytecode))
        least = float(_run(LIBRARIES + PEAK, cache, bytecode))
    first, *cold = cold
    _, *warm = warm
    _, *bare = bare
    notes = {"cold": f"; {first:.2f} s where Python compiles all modules, too", "warm": ""}
    return [
        *(
            Row(
                name=f"process start to first value, {cache}, against importing CasADi and NumPy",
                value=ratio(np.array(times), np.array(bare)),
                unit="x",
                required=REQUIRED[cache],
                at_most=True,
                note=f"{np.median(times):.2f} and {np.median(bare):.2f} s of processor{notes[cache]}",
            )
            for cache, times in (("cold", cold), ("warm", warm))
        ),
        Row(
            name="peak memory",
            value=memory,
            unit="MiB",
            note=f"{least:.0f} MiB for CasADi and NumPy alone; {more:.0f} with a batch of 100,000",
        ),
    ]


def _processor_s(code: str, cache: str, bytecode: str) -> float:
    before = os.times()
    _run(code, cache, bytecode)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def _run(code: str, cache: str, bytecode: str) -> str:
    environment = {**os.environ, "NLP_GAIT_CACHE": cache, "PYTHONPYCACHEPREFIX": bytecode}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True
    ).stdout
