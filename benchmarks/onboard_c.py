"""The planner in C beside Python's, and recorded states at 500 Hz: ``python -m benchmarks.onboard --c [PROBLEM...]``.

Both plan the same changes in one run, each from its own last result; times are of the processor. Both use this machine's
vectors, C once more only those that each x86-64 has. Then the example in C plans recorded states: the gait is simulated in
MuJoCo with a push from each of four sides, and every 2 ms the hip's deviation from the plan, with the feedback's sensor noise,
is added to the start state.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

import nlp_gait
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.result import Result
from nlp_gait.formulation.solution import Outcome, Solution
from nlp_gait.simulation.feedback import Feedback
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import DIRECTIONS, Conditions, Push, simulate_plan
from tests.export.exported_planner import ExportedPlanner

PROBLEMS = ("nao-ssp", "nao-dsp", "humanoid-ssp", "humanoid-dsp", "nao-cycle", "stairs-plan", "walk12")
RECORDED = ("nao-ssp", "humanoid-ssp")
STATE = [f"hip_{axis}_start_m" for axis in "xyz"] + [f"hip_v{axis}_start_m_s" for axis in "xyz"]
PERIOD_S, IMPULSE_NS = 0.002, 0.2
SAME, NEAR = 1e-9, 1e-6  # relative
HEADER = (
    "| problem | Python: median / 99th | C: median / 99th | C without AVX | steps | converge | equal to 1e-9 "
    "(1e-6) | solved again |\n|---|--:|--:|--:|--:|--:|--:|--:|"
)


def build(problem: GaitProblem, near: Outcome, folder: Path, flags: str = "") -> ExportedPlanner:
    """Export and build a planner."""
    return ExportedPlanner(problem, near, folder, {"CFLAGS": "", "CXXFLAGS": flags})


def compare(problem: GaitProblem, solution: Solution, changes: Sequence[Mapping[str, float]]) -> None:
    """Print a row: both solve the changes, each twice, so that a second solve removes the tolerance of the first."""
    plan = nlp_gait.make_replanner(problem, near=solution)
    near = min(solution.starts, key=lambda outcome: outcome.rank)
    with tempfile.TemporaryDirectory() as fast, tempfile.TemporaryDirectory() as plain:
        in_c = [build(problem, near, Path(folder), flags) for folder, flags in ((fast, ""), (plain, "-DLANES=2"))]
        points = [problem.with_values(**change).p for change in changes]
        plan.solve(changes[0])
        for planner in in_c:
            planner.solve(points[0])
        used, apart = np.zeros((3, len(points))), np.zeros((2, len(points)))
        steps, converged = [], 0
        for k, (change, p) in enumerate(zip(changes, points, strict=True)):
            for repeat in range(2):
                began = [time.thread_time()]
                found = plan.solve(change)
                began.append(time.thread_time())
                reports = []
                for planner in in_c:
                    reports.append(planner.solve(p))
                    began.append(time.thread_time())
                cost, (status, report) = problem.objective.sign * found.objective, reports[0]
                apart[repeat, k] = abs(report.cost - cost) / abs(cost)
                if repeat == 0:
                    used[:, k] = np.diff(began)
                    steps.append(report.steps)
                    converged += status == "optimal"
    times = [f"{1e3 * np.median(each):.2f} / {1e3 * np.percentile(each, 99):.2f} ms" for each in used]
    equal = [(int(np.sum(each <= SAME)), int(np.sum(each <= NEAR))) for each in apart]
    print(
        f"| `{problem.name}` | {' | '.join(times)} | {np.median(steps):g} | {converged} of {len(points)} | "
        f"{equal[0][0]} ({equal[0][1]}) | {equal[1][0]} ({equal[1][1]}) |",
        flush=True,
    )


def record_states(problem: GaitProblem, x: Array) -> Array:
    """Return parameters (instants, 6) of the start state, recorded while the gait is simulated."""
    plan, noise, rng = make_plan(Result(problem=problem, x=x)), Feedback(), np.random.default_rng(0)
    every = round(PERIOD_S / TIME_STEP)
    states = []
    for direction in DIRECTIONS.values():
        push = Push(impulse_Ns=(IMPULSE_NS * direction[0], IMPULSE_NS * direction[1]))
        seen = simulate_plan(plan, Conditions(push=push))
        rates = np.gradient(seen.torso, seen.t, axis=0)
        part = slice(0, round(plan.duration_s / TIME_STEP), every)
        place = seen.torso[part] - plan.at("hip", seen.t[part])
        rate = rates[part] - plan.rate("hip", seen.t[part])
        place += rng.normal(scale=noise.position_noise_m, size=place.shape)
        rate += rng.normal(scale=noise.velocity_noise_m_s, size=rate.shape)
        states.append(np.hstack([place, rate]))
    return np.concatenate(states) + [problem.value(name) for name in STATE]


def run_example(name: str, starts: int) -> None:
    """Print what the example in C finds for recorded states, one each 2 ms."""
    problem = nlp_gait.load(name, trajectory="measured", samples_per_interval=1)
    solution = nlp_gait.solve(problem, starts=starts, workers=1)
    near = min(solution.starts, key=lambda outcome: outcome.rank)
    states = record_states(problem, near.x)
    with tempfile.TemporaryDirectory() as folder:
        build(problem, near, Path(folder))
        file = Path(folder) / "states.csv"
        np.savetxt(file, states, delimiter=",", header=",".join(STATE), comments="", fmt="%.17g")
        run = [str(Path(folder) / "plan"), str(file)]
        total = subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()[-1]
    most = np.abs(states - states.mean(axis=0)).max(axis=0)
    print(f"{name}, recorded states up to {most[:3].max():.3f} m, {most[3:].max():.3f} m/s apart: {total}", flush=True)
