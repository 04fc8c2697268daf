"""The 12-joint walk's certificates, verified by code that shares nothing with the prover: the printed formulas by intervals.

``python -m benchmarks.guarantees.walk12_by_intervals [FILE ...] [--relax SHARE]`` reads certificates, by default all shipped ones
of steps of 1 s, encloses the objective of each incumbent, and proves the bound once more over the whole box. With a share, the
bound is relaxed by it, which takes fewer boxes.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from nlp_gait.proofs.certificate import CERTIFICATES
from tests.proofs.walk12_by_intervals import KAPPA, SLACK, Ends, evaluate, evaluate_knees, make_step, prove

REPORT_S = 30.0
LEAST_WEIGHT = 0.15  # default of lambda


def verify(path: Path, relax: float) -> bool:
    """Verify a certificate; returns whether its incumbent and its bound are right."""
    raw = json.loads(path.read_text(encoding="utf-8"))
    problem, proof = raw["problem"], raw["certificate"]
    step = make_step(problem["options"]["quadrature"], problem["options"]["intervals"])
    weight, started, reported = problem["parameters"].get("lambda", LEAST_WEIGHT), time.process_time(), time.monotonic()
    x = np.array([proof["x"]])
    cost, knees = evaluate(Ends(x, x), step, weight), evaluate_knees(Ends(x, x), step)
    right = cost.value.lo[0] - 1e-12 <= -proof["objective"] <= cost.value.hi[0] + 1e-12
    right &= bool(knees.value.hi.max() <= np.cos(KAPPA) + SLACK)

    def progress(boxes: int, left: int) -> None:
        nonlocal reported
        if time.monotonic() - reported > REPORT_S:
            reported = time.monotonic()
            print(f"{path.stem}: {boxes:,} boxes, {left:,} open", flush=True)

    bound = proof["bound"] + relax * abs(proof["bound"])
    tree = prove(step, weight, bound, progress=progress)
    print(
        f"{path.stem}: incumbent {proof['objective']:.9g} {'confirmed' if right else 'WRONG'}; no f above {bound:.9g}: "
        f"{'proven' if tree.left == 0 else 'NOT PROVEN'} with {tree.boxes:,} boxes (the certificate has {proof['boxes']:,}), "
        f"{time.process_time() - started:.0f} s of CPU",
        flush=True,
    )
    return right and tree.left == 0


def main() -> None:
    """Verify certificates; ends with status 1 if one is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.guarantees.walk12_by_intervals")
    parser.add_argument("file", nargs="*", type=Path)
    parser.add_argument("--relax", type=float, default=0.0, help="share by which bounds are relaxed")
    arguments = parser.parse_args()
    shipped = sorted(path for path in CERTIFICATES.glob("walk12-*.json") if "fast" not in path.stem)
    results = [verify(path, arguments.relax) for path in arguments.file or shipped]
    raise SystemExit(not all(results))


if __name__ == "__main__":
    main()
