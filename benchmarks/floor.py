"""The least time that a kernel can take on this core: what its multiply ports and its transcendental functions need.

Counts come from the final graph, times of single operations are measured here. Additions, loads and stores go through other
ports and are taken as free, as are latencies.
"""

from __future__ import annotations

import ctypes
from collections import Counter
from importlib.resources import files
from pathlib import Path

import casadi as ca

from nlp_gait.backends.kernel.compiler import BASE_FLAGS, find_compiler, lane_flags
from nlp_gait.backends.kernel.library_cache import load_library

MEASURED = ("multiply", "divide", "sqrt", "sin", "cos", "acos", "atan2")
KINDS = {
    ca.OP_MUL: "multiply",
    ca.OP_SQ: "multiply",
    ca.OP_DIV: "divide",
    ca.OP_INV: "divide",
    ca.OP_SQRT: "sqrt",
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN2: "atan2",
}


def operation_counts(function: ca.Function, samples: int) -> Counter[str]:
    """Operations a candidate by kind, counting the per-sample functions of a kernel once a sample."""
    counts: Counter[str] = Counter()
    for inner in function.find_functions():
        if inner.class_name() != "SXFunction":
            continue
        for k in range(inner.n_instructions()):
            counts["all"] += samples
            kind = KINDS.get(inner.instruction_id(k))
            if kind is not None:
                counts[kind] += samples
    return counts


def operation_times(lanes: int) -> dict[str, float]:
    """Time of each kind of operation on ``lanes`` doubles [s]: the least of several measurements."""
    header = (files("nlp_gait.backends.kernel") / "native" / "lanes.hpp").read_text(encoding="utf-8")
    body = Path(__file__).with_name("operations.cpp").read_text(encoding="utf-8")
    names = tuple(f"time_{name}" for name in MEASURED)
    flags = (*BASE_FLAGS, *lane_flags(lanes), f"-DLANES={lanes}")
    library, _ = load_library(f"#include <time.h>\n{header}\n{body}", find_compiler(), flags, names)
    times = {}
    for name in MEASURED:
        function = getattr(library, f"time_{name}")
        function.restype = ctypes.c_double
        times[name] = min(function() for _ in range(50))
    return times


def floor_s(counts: Counter[str], times: dict[str, float], lanes: int, kinds: tuple[str, ...] = MEASURED) -> float:
    """Least time a candidate [s]."""
    return sum(counts[kind] * times[kind] for kind in kinds) / lanes
