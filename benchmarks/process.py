"""Rows about a process from its start to the first value: time with an empty and a full cache, and memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

import numpy as np

from benchmarks.rows import Row

FIRST_VALUE = """
import nlp_gait
problem = nlp_gait.load("nao-ssp")
objective = nlp_gait.compile_objective(problem, require_compiler=True)
objective(((problem.lower + problem.upper) / 2)[None])
"""
PEAK = "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"
BATCH = "objective((problem.lower + (problem.upper - problem.lower) * 0.5)[None].repeat(100_000, axis=0))\n"


def starts(rounds: int) -> list[Row]:
    """Wall time of ``python -c`` to the first value: compiler included (cold), or its library in the cache (warm).

    Bytecode is there, as pip compiles it; the first process of all compiles it here, and its time is in the note.
    """
    cold, warm = [], []
    with tempfile.TemporaryDirectory() as bytecode:
        for _ in range(1 + max(2, rounds // 5)):
            with tempfile.TemporaryDirectory() as cache:
                cold.append(_wall(FIRST_VALUE, cache, bytecode))
                warm += [_wall(FIRST_VALUE, cache, bytecode) for _ in range(4)]
        memory = float(_run(FIRST_VALUE + PEAK, cache, bytecode))
        more = float(_run(FIRST_VALUE + BATCH + PEAK, cache, bytecode))
        bare = float(_run("import casadi, numpy\n" + PEAK, cache, bytecode))
    first = cold.pop(0)
    to_first = "process start to first value"
    limits = {"cold": (1.5, 0.9), "warm": (0.35, 0.25)}
    notes = {"cold": f"{first:.2f} s where Python compiles all modules, too", "warm": ""}
    return [
        *(
            Row(
                name=f"{to_first}, {cache}",
                value=float(np.median(times)),
                unit="s",
                required=limits[cache][0],
                ambition=limits[cache][1],
                at_most=True,
                note=notes[cache],
            )
            for cache, times in (("cold", cold), ("warm", warm))
        ),
        Row(
            name="peak memory",
            value=memory,
            unit="MiB",
            note=f"{bare:.0f} MiB for casadi and numpy alone; {more:.0f} with a batch of 100,000",
        ),
    ]


def _wall(code: str, cache: str, bytecode: str) -> float:
    started = time.perf_counter()
    _run(code, cache, bytecode)
    return time.perf_counter() - started


def _run(code: str, cache: str, bytecode: str) -> str:
    environment = {**os.environ, "NLP_GAIT_CACHE": cache, "PYTHONPYCACHEPREFIX": bytecode}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True
    ).stdout
