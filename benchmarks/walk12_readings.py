"""f1max and optima of the 12-joint walk with what its paper leaves open: ``python -m benchmarks.walk12_readings``.

The ankle above the ground, the foot's mass straight above its ankle, and g = 9.8 m/s^2, as in
``tests.compare.papers.walk12_readings``. Prints for each the largest f1 over n, H and h at both ends of s, the optimal f at
lambda = 0.15 and the lambda at which both ends have the same f, all under the paper's f1max.
"""

from __future__ import annotations

from scipy.optimize import minimize

from compare.papers.walk12.walk12_paper import F1MAX, F2MAX
from nlp_gait.formulation import load
from tests.compare.papers.walk12_readings import compute_f1_variants

START = (0.114, 0.001, 0.01)  # n, H, h near our optima [m]


def maximise_f1(step_length_m: float, reading: str) -> float:
    """Return the largest f1 of a step length by a reading [1/(m^2 s)]."""
    problem = load("walk12")
    bounds = list(zip(problem.lower[1:].tolist(), problem.upper[1:].tolist(), strict=True))

    def cost(x: tuple[float, ...]) -> float:
        return -compute_f1_variants((step_length_m, *x))[reading]

    options = {"xatol": 1e-7, "fatol": 1e-6}
    return -float(minimize(cost, START, method="Nelder-Mead", bounds=bounds, options=options).fun)


def main() -> None:
    """Print a line for each reading."""
    lower, upper = (load("walk12").value(f"step_length_m.{end}") / F2MAX for end in ("lower", "upper"))
    for reading in ("ours", "ground", "foot", "g"):
        high, low = (maximise_f1(s * F2MAX, reading) for s in (lower, upper))
        f = 0.15 * low / F1MAX + 0.85 * upper
        weight = (upper - lower) / (upper - lower + (high - low) / F1MAX)
        print(f"{reading}: f1max {high:.2f}, at the longest step {low:.2f}; f {f:.4f} at 0.15; same f at {weight:.3f}")


if __name__ == "__main__":
    main()
