"""Proofs for the 12-joint walk: a certificate for each lambda of Table III.

``python -m benchmarks.guarantees.walk12 OUT [TOLERANCE ...]`` writes them. Existing certificates are skipped; a killed proof
continues.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import nlp_gait
from compare.papers.walk12.walk12_paper import TABLE_3
from nlp_gait.files import write_json
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.proofs.certificate import make_certificate_file

TOLERANCES = (0.01, 0.001)
STARTS = 20
LIMIT_S = 24 * 3600.0


def main() -> None:
    """Write the missing certificates, those of wide tolerances first."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for tolerance in [float(text) for text in sys.argv[2:]] or TOLERANCES:
        for row in TABLE_3:
            name = f"walk12-lambda-{row.weight:g}-{100 * tolerance:g}-percent"
            if (out / f"{name}.json").exists():
                continue
            problem = nlp_gait.load("walk12").with_values(**{"lambda": row.weight})
            best = nlp_gait.solve(problem, starts=STARTS)
            x = np.array(list(best.x.values()))
            found = certify(problem, x, tolerance=tolerance, time_limit_s=LIMIT_S, checkpoint=out / f".{name}.open.npz")
            write_json(out / f"{name}.json", make_certificate_file(problem, found).to_json())
            (out / f".{name}.open.npz").unlink()
            print(
                f"{name}: f {found.objective:.7g}, proven {found.bound:.7g}, {found.boxes:,} boxes, {found.cpu_s:.1f} s of CPU, "
                f"{found.time_s:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
