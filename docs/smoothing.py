"""Measure what the smoothed balance margin costs: ``python -m docs.smoothing [WIDTH_M...]``.

For each width of the sigmoid IPOPT solves NAO's single support, from the best point of wider ones; the exact functions judge the
point. By default these are the widths of the solver, and the table of ``docs/model/smoothed-margin.md`` is written.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import WIDTHS, build_nlp
from nlp_gait.backends.solvers.ipopt import NARROWER_WIDTHS, QUIET

PROBLEM = "nao-ssp"
MARGINS_M = (0.05, 0.065)  # required mean margins in x: the paper's, and one that limits the gait
OPTIONS = QUIET | {"ipopt.tol": 1e-9, "ipopt.bound_relax_factor": 0.0}
TABLE = Path(__file__).with_suffix(".json")


def measure(widths: list[float], margin_m: float) -> list[dict[str, Any]]:
    """Return the optimum at each width, its violation by the exact functions, and the iterations."""
    problem = nlp_gait.load(PROBLEM).with_values(dbm_x_mean_limit_m=margin_m)
    exact, model = build_exact_model(problem), build_nlp(problem)
    method = ca.nlpsol("smoothed", "ipopt", model.nlp, OPTIONS)
    x = problem.check_x(nlp_gait.solve(problem, starts=3, seed=0).x)
    best, levels = exact.at(x, problem.p).cost, list[dict[str, Any]]()
    start = model.start(problem, problem.start_point(np.random.default_rng(0)), widths[0])
    for width in widths:
        result = method(x0=start, p=np.append(problem.p, width), **model.bounds(problem))
        x = model.point(np.array(result["x"]).ravel())
        values = exact.at(x, problem.p)
        if not levels or levels[-1]["violation"] > 0.0 or values.cost < levels[-1]["power_W"]:
            start = result["x"]
        levels.append(
            {
                "margin_m": margin_m,
                "width_m": width,
                "power_W": values.cost,
                "more_W": values.cost - best,
                "violation": values.violation,
                "iterations": int(method.stats()["iter_count"]),
            }
        )
        print(levels[-1], method.stats()["return_status"])
    return levels


def main() -> None:
    """Measure the widths of the solver and write the table, or measure others."""
    parser = argparse.ArgumentParser(prog="python -m docs.smoothing", description=__doc__.splitlines()[0])
    parser.add_argument("widths", type=float, nargs="*", help="widths of the sigmoid [m]")
    widths = parser.parse_args().widths
    rows = [row for margin in MARGINS_M for row in measure(widths or [*WIDTHS, *NARROWER_WIDTHS], margin)]
    if not widths:
        TABLE.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
