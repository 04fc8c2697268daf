"""Rows about a process from its start to the first value: time with an empty and a full cache, and memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

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
    """Wall time of ``python -c`` to the first value, compiler included."""
    cold, warm = [], []
    for _ in range(max(2, rounds // 5)):
        with tempfile.TemporaryDirectory() as cache:
            cold.append(_wall(FIRST_VALUE, cache))
            warm += [_wall(FIRST_VALUE, cache) for _ in range(4)]
    with tempfile.TemporaryDirectory() as cache:
        memory = float(_run(FIRST_VALUE + PEAK, cache))
        more = float(_run(FIRST_VALUE + BATCH + PEAK, cache))
        bare = float(_run("import casadi, numpy\n" + PEAK, cache))
    to_first = "process start to first value"
    limits = {"cold": (1.5, 0.9), "warm": (0.35, 0.25)}
    return [
        *(
            Row(
                name=f"{to_first}, {cache}",
                value=float(np.median(times)),
                unit="s",
                required=limits[cache][0],
                ambition=limits[cache][1],
                at_most=True,
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


def _wall(code: str, cache: str) -> float:
    started = time.perf_counter()
    _run(code, cache)
    return time.perf_counter() - started


def _run(code: str, cache: str) -> str:
    # Bytecode is kept, as it is of an installed package.
    environment = {**os.environ, "NLP_GAIT_CACHE": cache, "PYTHONPYCACHEPREFIX": str(Path(cache) / "bytecode")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True
    ).stdout
