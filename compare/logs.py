"""Runs as logs in IOHprofiler's JSON, which iohinspector reads.

The logged value is the relative gap to the best known objective, positive if worse, and ``NOTHING_FEASIBLE`` before the first
feasible point. Evaluations are equivalent ones, in which derivatives count as forward differences would.
"""

import math
from collections.abc import Sequence
from pathlib import Path

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.record_statistics import Curve
from nlp_gait.files import make_file_name, make_writable_folder, write_json, write_text

__all__ = ["NOTHING_FEASIBLE", "list_gaps", "write_ioh"]

# Gap before the first feasible point: formats of unconstrained benchmarks have no value for it.
NOTHING_FEASIBLE = 1e10
# Smallest gap: readers take logarithms.
SMALLEST = 1e-12
IOH_VERSION = "0.3.18"  # of ioh, whose layout is written


def write_ioh(comparisons: Sequence[Comparison], folder: Path) -> list[Path]:
    """Write ``<solver>/IOHprofiler_f<k>_<problem>.json`` and a data file for each solver and problem k.

    Solvers with a run of unknown evaluations are left out. Raises OutputError.
    """
    return [
        path
        for number, comparison in enumerate(comparisons, start=1)
        for solver in comparison.solvers
        if solver.has_costs("evaluations")
        for path in _write_log(folder / make_file_name(solver.name), number, comparison, solver)
    ]


def list_gaps(curve: Curve) -> dict[int, float]:
    """Return the gap by evaluations each time the best improves; the first is at one evaluation, as readers expect."""
    gaps = {1: NOTHING_FEASIBLE}
    for evaluations, gap in zip(curve.evaluations.tolist(), curve.gap.tolist(), strict=True):
        if max(gap, SMALLEST) < next(reversed(gaps.values())):
            gaps[max(1, math.ceil(evaluations))] = max(gap, SMALLEST)
    return gaps


def _write_log(folder: Path, number: int, comparison: Comparison, solver: SolverRuns) -> tuple[Path, Path]:
    stem = f"f{number}_{make_file_name(comparison.problem)}"
    dimension = max(1, *(len(record.x) for record in comparison.records))
    data = Path(f"data_{stem}") / f"IOHprofiler_f{number}_DIM{dimension}.dat"
    lines, runs = ["evaluations raw_y"], []
    for record, curve in zip(solver.records, solver.curves, strict=True):
        gaps = list_gaps(curve)
        lines += [f"{count} {gap!r}" for count, gap in gaps.items()]
        last = max(gaps)
        best = {"evals": last, "y": gaps[last], "x": list(record.x.values())}
        runs.append({"instance": record.run + 1, "evals": max(1, math.ceil(curve.total_cost())), "best": best})
    header = {
        "version": IOH_VERSION,
        "suite": "nlp-gait",
        "function_id": number,
        "function_name": comparison.problem,
        "maximization": False,
        "algorithm": {"name": solver.name, "info": "gap to the best known objective, relative"},
        "attributes": ["evaluations", "raw_y"],
        "scenarios": [{"dimension": dimension, "path": data.as_posix(), "runs": runs}],
    }
    make_writable_folder((folder / data).parent)
    write_text(folder / data, "\n".join(lines) + "\n")
    write_json(folder / f"IOHprofiler_{stem}.json", header)
    return folder / f"IOHprofiler_{stem}.json", folder / data
