"""What noise of encoders does to a recorded cycle: ``python -m benchmarks.noise``; prints a table as Markdown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import nlp_gait
from benchmarks.engine.markdown import cells, header
from compare.judge import evaluate
from nlp_gait.export.formats import write_as
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.formulation import Result
from nlp_gait.gaits.nao.recorded import make_recorded_gait
from nlp_gait.robots import load_robot

SEEDS = 12


def main() -> None:
    """Print errors of power and touch-down for two cycles: the middle of all bounds, and the optimum."""
    problem, robot = nlp_gait.load("nao-cycle"), load_robot("nao-v5")
    middle = 0.5 * (problem.lower + problem.upper)
    middle[problem.variable_index("hip_vy_lift_off_m_s")] = 0.0
    single = problem.variable_index("single_support_time_s")
    optimum = problem.check_x(nlp_gait.solve(problem, starts=3, seed=0).x)
    print(header("cycle", "ms between rows", "noise [mrad]", "power", "touch-down [ms]"))
    for label, x in (("middle of the bounds", middle), ("optimum", optimum)):
        result = Result(problem=problem, x=x)
        power, touch_down = evaluate(problem, x, prove=False).metrics["power_W"], x[single]
        for period_ms in (10, 20):
            with TemporaryDirectory() as folder:
                path = Path(folder) / "cycle.csv"
                write_as("csv", path, result, period_ms)
                angles = read_joint_angles(path, robot)
            for noise_rad in (1e-3, 2e-3):
                errors, late = [], []
                for seed in range(SEEDS):
                    noise = np.random.default_rng(seed).normal(0.0, noise_rad, angles.q.shape)
                    gait = make_recorded_gait(replace(angles, q=angles.q + noise))
                    found = evaluate(gait.problem, np.array(gait.x), prove=False).metrics["power_W"]
                    errors.append(100.0 * (found / power - 1.0))
                    late.append(1e3 * (gait.x[0] - touch_down))
                row = (f"{min(errors):+.1f} to {max(errors):+.1f} %", f"{min(late):+.0f} to {max(late):+.0f}")
                print(cells(label, f"{period_ms}", f"{1e3 * noise_rad:g}", *row), flush=True)


if __name__ == "__main__":
    main()
