"""A planner in C, built by its own build line and called from Python; for tests and benchmarks."""

from __future__ import annotations

import ctypes
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path

from nlp_gait.export.solver import export_solver
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Outcome

STATUS = ("optimal", "feasible", "violated", "wrong parameters")


class Report(ctypes.Structure):
    """Result of ``solve``, as in the header."""

    _fields_ = (
        ("steps", ctypes.c_int),
        ("cost", ctypes.c_double),
        ("violation", ctypes.c_double),
        ("worst_row", ctypes.c_int),
        ("worst", ctypes.c_double),
    )


class ExportedPlanner:
    """An exported planner, continuing from its last result; ``flags`` are environment variables of its build script."""

    def __init__(self, problem: GaitProblem, near: Outcome, folder: Path, flags: Mapping[str, str]) -> None:
        export_solver(problem, folder, near=near)
        subprocess.run(["sh", str(folder / "build.sh")], check=True, env={**os.environ, **flags}, timeout=600)
        self._prefix = f"{problem.name.replace('-', '_')}_nlp_"
        self._library = ctypes.CDLL(str(folder / f"lib{self._prefix}planner.so"))
        count = self._find("planner_bytes")
        count.restype = ctypes.c_longlong
        self._memory = ctypes.create_string_buffer(int(count()))
        self.call("planner_prepare")
        assert near.guess is not None
        self.x, self.multipliers = near.x.copy(), near.guess.rows.copy()

    def _find(self, name: str) -> ctypes._NamedFuncPointer:
        return self._library[self._prefix + name]

    def call(self, name: str, *arguments: Array | float) -> int:
        """Call a function with the memory, pointers of arrays, and numbers."""
        words = [
            ctypes.c_double(each) if isinstance(each, float) else each.ctypes.data_as(ctypes.c_void_p)
            for each in arguments
        ]
        return int(self._find(name)(self._memory, *words))

    def solve(self, p: Array, steps: int = 20) -> tuple[str, Report]:
        """Return the status and the report."""
        report = Report()
        numbers = (array.ctypes.data_as(ctypes.c_void_p) for array in (p, self.x, self.multipliers))
        found = self._find("solve")(self._memory, *numbers, steps, ctypes.byref(report))
        return STATUS[found], report
