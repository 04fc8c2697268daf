"""Runs of the stairs reproduction: plain results of one step each, fit to be kept as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, get_args

import numpy as np

from compare.judge import evaluate
from compare.papers.stairs.motion import swing_leg
from compare.papers.stairs.paper import ANTS, EVAPORATION, ITERATIONS, TABLE_4
from compare.papers.stairs.replay import FEEDBACK, OPEN_LOOP, replay
from metaheuristics import AntColony, AntColonyGrid, GeneticAlgorithm, ParticleSwarm, minimize
from metaheuristics.interface import Algorithm
from nlp_gait import IpoptSettings, compile_objective, load, solve
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problems.stairs.closed_loop import InverseKinematics
from nlp_gait.problems.stairs.formulas.planar_biped import LINKS
from nlp_gait.problems.stairs.learned_path import LEGS
from nlp_gait.problems.stairs.network import NetworkSettings, network_angles
from nlp_gait.problems.stairs.robot import load_biped
from nlp_gait.problems.stairs.stair import PAPER_TIMES
from nlp_gait.problems.stairs.track import PLAN

STARTS = 20  # of IPOPT on the planner
IDEAL_STARTS = 3
JERK_STARTS = 5
SEEDS = (0, 1, 2)
PLAN_EVALUATIONS = 10_000
TRACK_EVALUATIONS = ANTS * ITERATIONS
ALGORITHMS: Mapping[str, Algorithm] = {
    "aco": AntColony(population=ANTS, spread=EVAPORATION),
    "aco-grid": AntColonyGrid(population=ANTS, evaporation=EVAPORATION),
    "pso": ParticleSwarm(),
    "ga": GeneticAlgorithm(),
}
TRACK_START = (60.0, 60.0, 1.4)
# A rollout has 16,000 variables once lifted: an iteration takes a second or more.
TRACK_SETTINGS = IpoptSettings(time_limit_s=1200.0)
# Stairs that the paper did not try: tread and rise of one step [m]; the last one is impossible.
OTHER_STAIRS = ((0.30, 0.10), (0.30, 0.13), (0.28, 0.17), (0.26, 0.20), (0.254, 0.50))
IMPOSSIBLE_RISE_M = 0.5
LOST_RAD = 0.1  # a replayed pose that is so far from the planned one has lost it


@cache
def loaded(name: str, **options: str) -> GaitProblem:
    """Problem, built once."""
    return load(name, **options)


def on_stair(problem: GaitProblem, case: int) -> GaitProblem:
    """A stairs problem on the stair of a case of Table IV."""
    row = TABLE_4[case]
    return problem.with_values(stair_length_m=row.stair_length_m, rise_run_ratio=row.rise_run_ratio)


def plan_problem(case: int, minimise: str = "energy") -> GaitProblem:
    """Planner of a case."""
    return on_stair(loaded("stairs-plan", minimise=minimise), case)


def track_problem(case: int, plan: Mapping[str, float], **options: str) -> GaitProblem:
    """Tracking of a plan, given by the planner's variables, in a case."""
    values = {name: plan[name] for name in PLAN}
    return on_stair(loaded("stairs-track", **options), case).with_values(**values)


def complete(case: int, plan: Mapping[str, float]) -> dict[str, float]:
    """A plan with the parameters that are not its variables."""
    problem = plan_problem(case)
    given = {name: problem.value(name) for name in ("t3_s", "sole_angle_rad", "toe_angle_rad", "catch_angle_rad")}
    return {**plan, **given}


def by_ipopt(problem: GaitProblem, starts: int, seed: int = 0, **more: Any) -> dict[str, Any]:
    """Best of several starts, and how each ended."""
    solution = solve(problem, starts=starts, seed=seed, **more)
    return {
        **_judged(problem, list(solution.x.values())),
        "success": solution.success,
        "status": solution.status,
        "iterations": solution.iterations,
        "time_s": solution.time_s.solve,
        "starts": [
            {"success": s.success, "objective": s.objective, "iterations": s.iterations, "time_s": s.time_s}
            for s in solution.starts
        ],
        "violations": [{"name": v.name, "by": v.violation, "unit": v.unit} for v in solution.worst_violations],
    }


def by_search(problem: GaitProblem, algorithm: str, evaluations: int) -> dict[str, Any]:
    """Best of one run for each seed, and all their values."""
    objective = compile_objective(problem)
    runs = [minimize(objective, ALGORITHMS[algorithm], evaluations=evaluations, seed=seed) for seed in SEEDS]
    best = min(runs, key=lambda run: (run.violation, run.objective))
    return {
        **_judged(problem, best.x.tolist()),
        "objectives": [run.objective for run in runs],
        "violations": [run.violation for run in runs],
        "time_s": [run.time_s for run in runs],
    }


def _judged(problem: GaitProblem, x: list[float]) -> dict[str, Any]:
    verdict = evaluate(problem, x)
    return {
        "x": dict(verdict.x),
        "objective": verdict.objective["value"],
        "indexes": verdict.indexes,
        "feasible": verdict.feasible,
        "dense": verdict.dense,
        "dense_violations": [{"name": row.name, "by": row.violation} for row in verdict.dense_violations[:3]],
    }


def other_stairs() -> list[dict[str, Any]]:
    """The planner and the ideal on stairs that the paper did not try."""
    found = []
    for tread, rise in OTHER_STAIRS:
        impossible = rise >= IMPOSSIBLE_RISE_M
        values = {"stair_length_m": 2 * tread, "rise_run_ratio": rise / tread}
        solver = IpoptSettings(iterations=100) if impossible else None
        row: dict[str, Any] = {"tread_m": tread, "rise_m": rise}
        for name, starts in (("stairs-plan", 3 if impossible else 8), ("stairs-ideal", 1)):
            run = by_ipopt(loaded(name).with_values(**values), starts, solver=solver)
            row[name] = {key: run[key] for key in ("success", "status", "objective", "violations")}
        found.append(row)
    return found


def network(case: int, plan: Mapping[str, float]) -> dict[str, Any]:
    """The network on the swing leg's 351 poses of a plan: convergence, time and error against the closed form."""
    tread = TABLE_4[case].stair_length_m / 2
    times = np.linspace(0.0, plan["t3_s"], 351)
    q, hip_to_ankle = swing_leg(plan, tread, tread * TABLE_4[case].rise_run_ratio, times)
    robot = load_biped()
    lengths = robot.link("HK").length_m, robot.link("KA").length_m
    rules = {
        "adam": NetworkSettings(),
        "gradient 0.3": NetworkSettings(rule="gradient", rate=0.3),
        "gradient 0.05": NetworkSettings(rule="gradient", rate=0.05),
        "gradient 1e-4, as printed": NetworkSettings(rule="gradient", rate=1e-4),
    }
    found = {}
    for name, settings in rules.items():
        path = network_angles(hip_to_ankle, *lengths, settings)
        error = np.abs(path.angles - q)
        found[name] = {
            "converged": int((path.error_m2 <= settings.tolerance_m2).sum()),
            "poses": len(q),
            "iterations": path.iterations.tolist(),
            "time_s": path.time_s.tolist(),
            "largest_angle_error_rad": float(error.max()),
            "mean_angle_error_rad": float(error.mean()),
        }
    return found


def best_track(found: Mapping[str, Any]) -> list[float]:
    """Gains and torso pitch of the best run of any solver, a feasible one if there is one."""
    runs = found["track"].values()
    return list(min(runs, key=lambda run: (not run["feasible"], run["objective"]))["x"].values())


def tracked(case: int, plan: Mapping[str, float], x: list[float]) -> Mapping[str, Array]:
    """Time histories of the closed loop with given gains and torso pitch."""
    problem = track_problem(case, plan)
    return problem.signals(np.array(x)).arrays


def printed_scheme(case: int, plan: Mapping[str, float]) -> dict[str, float]:
    """Quanta that the paper's gains survive in the explicit scheme, and what the implicit one makes of them."""
    row = TABLE_4[case]
    x = [row.kp, row.kd, row.torso_pitch_rad]
    explicit = track_problem(case, plan, scheme="explicit").with_values(gravity_compensation=0.0)
    implicit = track_problem(case, plan).with_values(gravity_compensation=0.0)
    compensated = track_problem(case, plan)
    return {
        "explicit_quanta": evaluate_indexes(explicit, x)["quanta_before_divergence"],
        "implicit_largest_error_rad": evaluate_indexes(implicit, x)["largest_error_rad"],
        "compensated_largest_error_rad": evaluate_indexes(compensated, x)["largest_error_rad"],
    }


def with_network(case: int, plan: Mapping[str, float], x: list[float]) -> dict[str, float]:
    """A tracked step whose desired leg angles come from the network, against the closed form: cost and angles."""
    problems = {kind: track_problem(case, plan, inverse_kinematics=kind) for kind in get_args(InverseKinematics)}
    found: dict[str, float] = {}
    angles = []
    for kind, problem in problems.items():
        verdict = evaluate(problem, x)
        found |= {f"{kind} cost": verdict.objective["value"], f"{kind} feasible": float(verdict.feasible)}
        angles.append(problem.signals(np.array(x)).arrays["q_desired"])
    error = np.abs(angles[0] - angles[1])[:, [LINKS.index(link) for leg in LEGS for link in leg]]
    return {**found, "largest_angle_error_rad": float(error.max()), "mean_angle_error_rad": float(error.mean())}


def replayed(case: int, x: list[float]) -> dict[str, float]:
    """Torques of an ideal step replayed by another integrator: errors of the pose with feedback, and without."""
    problem = on_stair(loaded("stairs-ideal"), case)
    arrays = problem.signals(np.array(x)).arrays
    _, followed = replay(arrays, FEEDBACK)
    time, fallen = replay(arrays, OPEN_LOOP)
    off = np.maximum.accumulate(np.abs(fallen).max(axis=1))
    return {
        "feedback_end_rad": float(np.abs(followed[-1]).max()),
        "open_loop_t1_rad": float(off[time <= PAPER_TIMES[0]][-1]),
        "open_loop_t2_rad": float(off[time <= PAPER_TIMES[1]][-1]),
        "open_loop_lost_s": float(time[np.argmax(off > LOST_RAD)]),
        "open_loop_end_rad": float(np.abs(fallen[-1]).max()),
    }


def evaluate_indexes(problem: GaitProblem, x: list[float]) -> dict[str, float]:
    """Exact indexes, those of a rollout that diverged too."""
    return {name: float(value) for name, value in evaluate(problem, x).indexes.items()}


def differences(case: int, plan: Mapping[str, float]) -> dict[str, float]:
    """Largest acceleration and jerk of links and knees by differences of the desired angles at 0.01 s."""
    q = tracked(case, plan, [100.0, 100.0, plan["torso_pitch_rad"]])["q_desired"]
    angles = np.column_stack([q, q[:, 1] - q[:, 0], q[:, 3] - q[:, 2]])  # links and knees
    acceleration = np.diff(angles, 2, axis=0) / 0.01**2
    jerk = np.diff(angles, 3, axis=0) / 0.01**3
    return {"acceleration": float(np.abs(acceleration).max()), "jerk": float(np.abs(jerk).max())}
