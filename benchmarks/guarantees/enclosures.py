"""Soundness of enclosures against exact values: ``python -m benchmarks.guarantees.enclosures [COUNT]``.

Every operation is enclosed over random boxes, some of them points, some tiny, some wide. At random points the exact value, known
to 200 bits from `python-flint`, must lie within the range and, in exact rational arithmetic, within the form.
"""

from __future__ import annotations

import sys

import numpy as np

from tests.proofs.enclosed_operations import AFFINE, QUADRATIC, find_lost_values

COUNT = 100_000
SEED = 19


def main() -> None:
    """Check all operations."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    rng = np.random.default_rng(SEED)
    for kind, operations in (("affine forms", AFFINE), ("forms of degree two", QUADRATIC)):
        each = -(-count // len(operations))
        total = 0
        for name in operations:
            lost = list(find_lost_values(name, each, rng, quadratic=operations is QUADRATIC))
            total += len(lost)
            print(*lost[:3], sep="\n", end="\n" * bool(lost))
        print(f"{kind}: {each * len(operations):,} points, {len(operations)} operations, {total} values lost")


if __name__ == "__main__":
    main()
