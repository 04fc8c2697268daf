"""How far the compiled derivatives are from CasADi's: every problem, points within the bounds and up to half a range outside.

    python -m benchmarks.agreement_of_derivatives [--points 1000] [--problems nao-ssp,walk12]

Differences of derivatives are relative to each number, where that is above a millionth of the result's largest; those of rows
are relative to the largest row: a row is a difference of two large numbers, where a limit is nearly met.
"""

from __future__ import annotations

import argparse

import casadi as ca
import numpy as np

import nlp_gait
from nlp_gait.backends.derivatives.compiled import CompiledNlp
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.formulation import Array, GaitProblem

SMALL = 1e-6
COLUMNS = {
    "f, g": ("nlp_f", "nlp_g"),
    "gradient": ("nlp_grad_f",),
    "Jacobian": ("nlp_jac_g",),
    "Hessian": ("nlp_hess_l",),
}
TABLE = "{:<16}{:>8}" + "{:>11}" * len(COLUMNS) + "{:>13}"


def largest_differences(problem: GaitProblem, points: int) -> tuple[dict[str, float], int]:
    """Largest relative difference by function, and how many points gave a result that is not finite."""
    model, rng = build_nlp(problem), np.random.default_rng(0)
    p = np.append(problem.p, model.widths[0])
    ours = CompiledNlp(model.nlp, p).functions
    usual = ca.nlpsol("usual", "ipopt", model.nlp, {"print_time": False})
    theirs = {name: usual.get_function(name) for name in ours}
    worst, undefined, n = dict.fromkeys(ours, 0.0), 0, model.variables
    for i in range(points):
        low, high = (0.0, 1.0) if i % 2 else (-0.5, 1.5)
        w = model.start(problem, model.point(rng.uniform(low, high, n)), model.widths[0])
        w[n:] += rng.normal(0.0, 0.1, len(w) - n)
        weights = {"nlp_hess_l": (rng.normal(), rng.normal(size=model.nlp["g"].shape[0]))}
        finite = True
        for name in ours:
            given = [ca.DM(each) for each in (w, p, *weights.get(name, ()))]
            # The last output: those before it are values again.
            found, expected = (functions[name].call(given)[-1] for functions in (ours, theirs))
            assert found.sparsity() == expected.sparsity()
            numbers = np.array(found.nonzeros())
            finite &= bool(np.isfinite(numbers).all())
            floor = 1.0 if name in ("nlp_f", "nlp_g") else SMALL
            worst[name] = max(worst[name], _apart(numbers, np.array(expected.nonzeros()), floor))
        undefined += not finite
    return worst, undefined


def _apart(found: Array, expected: Array, floor: float) -> float:
    size = np.maximum(np.abs(expected), floor * np.abs(expected).max(initial=1e-300))
    return float((np.abs(found - expected) / size).max(initial=0.0))


def main() -> None:
    """Print a line for each problem."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=1000)
    parser.add_argument("--problems", default=",".join(nlp_gait.list_problems()))
    arguments = parser.parse_args()
    print(TABLE.format("problem", "points", *COLUMNS, "not finite"))
    for name in arguments.problems.split(","):
        worst, undefined = largest_differences(nlp_gait.load(name), arguments.points)
        figures = (f"{max(worst.get(each, 0.0) for each in names):.1e}" for names in COLUMNS.values())
        print(TABLE.format(name, arguments.points, *figures, undefined), flush=True)


if __name__ == "__main__":
    main()
