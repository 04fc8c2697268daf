"""Proofs of NAO's phases: a certificate for each, or the bound that was reached.

``python -m benchmarks.guarantees.nao OUT nao-dsp 0.01 [HOURS [PART]]`` writes it; one that is there already is kept, and what was
killed goes on. Without the time to close, the open part stays in OUT and its bound is printed. With PART the bounds of the
variables are this part of their ranges around the best known gait.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import nlp_gait
from compare.questions.certainty.branch_and_bound import certify
from compare.questions.certainty.certificate import certificate_file
from nlp_gait.files import write_json
from nlp_gait.gaitbench.known import known
from nlp_gait.problem import Array, GaitProblem

INSTANCES = {"nao-dsp": "dsp-v5", "nao-ssp": "ssp-v5"}
REPORT_S = 30.0


def around(problem: GaitProblem, x: Array, part: float) -> GaitProblem:
    """A problem with bounds that are this part of the ranges around a point, and nowhere wider."""
    half = part * (problem.upper - problem.lower) / 2
    lower, upper = np.maximum(problem.lower, x - half), np.minimum(problem.upper, x + half)
    named = (("lower", lower), ("upper", upper))
    return problem.with_values(
        **{f"{n}.{end}": float(v) for end, values in named for n, v in zip(problem.names, values, strict=True)}
    )


def main() -> None:
    """Prove one of them."""
    out, name, tolerance = Path(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    limit_s = 3600.0 * float(sys.argv[4]) if len(sys.argv) > 4 else 24 * 3600.0
    out.mkdir(parents=True, exist_ok=True)
    part = float(sys.argv[5]) if len(sys.argv) > 5 else None
    stem = f"{name}-{100 * tolerance:g}-percent" + (f"-around-{part:.3g}" if part else "")
    if (out / f"{stem}.json").exists():
        print(f"{stem} is there")
        return
    problem, told = nlp_gait.load(name), time.perf_counter()

    def progress(note: str) -> None:
        nonlocal told
        if time.perf_counter() - told > REPORT_S:
            told = time.perf_counter()
            print(note, flush=True)

    x = np.array(known()[INSTANCES[name]].best_x)
    problem = problem if part is None else around(problem, x, part)
    kept = out / f".{stem}.open.npz"
    found = certify(problem, x, tolerance=tolerance, time_limit_s=limit_s, progress=progress, checkpoint=kept)
    if found.closed:
        write_json(out / f"{stem}.json", certificate_file(problem, found).to_json())
        kept.unlink()
    print(
        f"{stem}: f {found.objective:.7g}, proven {found.bound:.7g}, {found.boxes:,} boxes, {found.left:,} left, "
        f"{found.cpu_s:.1f} s of CPU, {found.time_s:.1f} s",
        flush=True,
    )


if __name__ == "__main__":
    main()
