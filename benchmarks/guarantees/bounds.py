"""Affine bounds of NAO's single support by the form of the dynamics: ``python -m benchmarks.guarantees.bounds``."""

from __future__ import annotations

from tests.gaits.nao.torque_bounds import enclose_sample

EDGES = (4, 5, 6)


def main() -> None:
    """Print a table."""
    for edge in EDGES:
        for name, found in zip(("recursion", "world frame"), enclose_sample(2.0**-edge), strict=True):
            print(
                f"edge 2^-{edge}, {name}: error of a torque {found.torque_Nm:.3g} Nm, of the ZMP {1000 * found.zmp_m:.3g} mm; "
                f"{found.operations:,} operations"
            )


if __name__ == "__main__":
    main()
