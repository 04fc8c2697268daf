"""Public humanoids side by side: ten starts, searches, and steps and cycles at one Froude number, model and engine.

    python -m benchmarks.humanoids [starts] [searches] [steps] [cycles] [--robots jvrc,g1,...]

Robots come from the packages ``jvrc-description`` and ``example-robot-data``; what is not installed is left out and said.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import metaheuristics
import nlp_gait
from benchmarks.engine.markdown import cells, header
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.humanoid.body import GRAVITY
from nlp_gait.robots.biped import NAO_LEG_M, make_biped_model

SHARE = "share/example-robot-data/robots"
STARTS, STEPS = 10, 4
SEARCHES = {name: metaheuristics.make_algorithm(name) for name in ("pso", "ga", "aco")}
TIME_S = 2.0  # of NAO's single support


def robots() -> dict[str, str]:
    """Files by name; NAO is a general leg here."""
    found = {"nao": "nao-v5"}
    jvrc = find_spec("jvrc_description")
    if jvrc is not None and jvrc.origin is not None:
        found["jvrc"] = str(Path(jvrc.origin).parent / "urdf/jvrc1.urdf")
    for folder in sys.path:
        root = Path(folder) / "cmeel.prefix" / SHARE
        if root.is_dir():
            found["g1"] = str(root / "g1_description/urdf/g1_29dof_rev_1_0.urdf")
            found["talos"] = str(root / "talos_data/robots/talos_full_v2.urdf")
            found["romeo"] = str(root / "romeo_description/urdf/romeo.urdf")
            break
    for name in ("jvrc", "g1", "talos", "romeo"):
        if name not in found:
            print(f"{name} is left out: pip install jvrc-description example-robot-data", file=sys.stderr)
    return found


def starts(files: dict[str, str]) -> Iterator[str]:
    """Single support from random starts: how many end feasible, closure, and the lifted objective against the exact one."""
    from casadi import Function

    yield header("robot", "feasible", "iterations", "best W", "closure m", "lifted against exact", "binding")
    for name, file in files.items():
        problem = nlp_gait.load("humanoid-ssp", robot=file)
        solution = nlp_gait.solve(problem, starts=STARTS, seed=0)
        x, model, nlp = np.array(list(solution.x.values())), build_exact_model(problem), build_nlp(problem)
        values = model.at(x, problem.p)
        rows = [i for i, row in enumerate(model.row_names) if row.startswith("closure")]
        width = nlp.widths[-1]
        cost = Function("cost", [nlp.nlp["x"], nlp.nlp["p"]], [nlp.nlp["f"]])
        lifted = float(cost(nlp.start(problem, x, width), np.append(problem.p, width)))
        yield cells(
            name,
            f"{sum(start.converged for start in solution.starts)} of {STARTS}",
            f"{np.median([start.iterations for start in solution.starts]):.0f}",
            f"{solution.objective:.6g}",
            f"{values.g[rows].max():.1e}",
            f"{abs(lifted - values.cost) / values.cost:.1e}",
            ", ".join(active.name for active in solution.active_constraints[:4]),
        )


def searches(files: dict[str, str]) -> Iterator[str]:
    """Searches of 40,000 evaluations, five seeds each: how many end feasible, and the best over IPOPT's best."""
    yield header("robot", "IPOPT W", *(f"{name}: feasible, best - IPOPT, median" for name in SEARCHES))
    for name, file in files.items():
        problem = nlp_gait.load("humanoid-ssp", robot=file)
        best = nlp_gait.solve(problem, starts=4, seed=0).objective
        objective = nlp_gait.compile_objective(problem, threads=1)
        found = []
        for search in SEARCHES.values():
            runs = [metaheuristics.minimize(objective, search, evaluations=40_000, seed=seed) for seed in range(5)]
            feasible = [run.objective for run in runs if run.feasible]
            least, middle = (min(feasible), float(np.median(feasible))) if feasible else (np.nan, np.nan)
            found.append(f"{len(feasible)} of {len(runs)}, {(least - best) / best:+.1e}, {(middle - best) / best:+.1e}")
        yield cells(name, f"{best:.6g}", *found)


def steps(files: dict[str, str]) -> Iterator[str]:
    """Cheapest single supports of NAO's 2 s times the root of lambda, in the model and played: equal Froude numbers."""
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import measure
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.simulate import simulate_plan

    yield header("robot", "leg m", "mass kg", "time s", "step m", "power W", "CoT", "margins mm", "binding", "engine")
    for name, file in files.items():
        problem = nlp_gait.load("humanoid-ssp", robot=file)
        robot, leg = problem.display.robot, leg_of(problem)
        assert robot is not None
        time_s = TIME_S * float(np.sqrt(leg / NAO_LEG_M))
        problem = problem.fix(single_support_time_s=time_s)
        solution = nlp_gait.solve(problem, starts=2, seed=0)
        x = np.array(list(solution.x.values()))
        indexes, hip = build_exact_model(problem).at(x, problem.p).indexes, problem.signals(x).arrays["left_foot"]
        plan = make_plan(Result(problem=problem, x=x))
        m = measure(plan, simulate_plan(plan), Drive())
        fate = f"falls at {m.fell_at_s:.1f} s" if m.fallen else f"upright, tilt {m.largest_tilt_deg:.1f} deg"
        step = float(hip[0, 0])
        yield cells(
            name,
            f"{leg:.3f}",
            f"{robot.mass_kg:.1f}",
            f"{time_s:.2f}",
            f"{step:.3f}",
            f"{indexes['power_W']:.3f}" if solution.converged else "not feasible",
            f"{indexes['power_W'] * time_s / (robot.mass_kg * GRAVITY * step):.3f}",
            ", ".join(f"{1e3 * indexes[f'dbm_{axis}_min_m']:.0f}" for axis in "xy"),
            ", ".join(active.name for active in solution.active_constraints[:3]),
            f"{fate}, {m.measured.total_W:.3f} W",
        )


def cycles(files: dict[str, str]) -> Iterator[str]:
    """Cheapest cycles at NAO's 0.03 m/s times the root of lambda, in the model and over some steps in the engine."""
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import measure_walk
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.simulate import simulate_plan

    yield header(
        "robot",
        "leg m",
        "mass kg",
        "speed m/s",
        "step m",
        "power W",
        "cost of transport",
        "margins mm",
        "binding",
        "engine",
    )
    for name, file in files.items():
        problem = nlp_gait.load("humanoid-cycle", robot=file, objective="power")
        solution = nlp_gait.solve(problem, starts=4, seed=0)
        x = np.array(list(solution.x.values()))
        indexes = build_exact_model(problem).at(x, problem.p).indexes
        robot, played = problem.display.robot, "-"
        assert robot is not None
        if solution.converged:
            plan = make_plan(Result(problem=problem, x=x), STEPS)
            walked = measure_walk(plan, simulate_plan(plan), Drive(), STEPS)
            m = walked.measurements
            played = f"falls at {m.fell_at_s:.1f} s" if m.fallen else f"{walked.steps_done} steps"
            if walked.engine_J_per_planned_m is not None:
                played += f", {walked.engine_J_per_planned_m / (robot.mass_kg * GRAVITY):.3f}"
        margins = [1e3 * indexes[f"ssp_dbm_{axis}_min_m"] for axis in "xy"]
        leg = leg_of(problem)
        yield cells(
            name,
            f"{leg:.3f}",
            f"{robot.mass_kg:.1f}",
            f"{indexes['speed_m_s']:.4f}",
            f"{indexes['step_length_m']:.3f}",
            f"{indexes['power_W']:.3f}" if solution.converged else "not feasible",
            f"{indexes['cost_of_transport']:.3f}",
            ", ".join(f"{margin:.0f}" for margin in margins),
            ", ".join(active.name for active in solution.active_constraints[:3]),
            played,
        )


def leg_of(problem: GaitProblem) -> float:
    """Length of a leg [m]."""
    assert problem.display.robot is not None
    return make_biped_model(problem.display.robot).leg_length_m


GROUPS: dict[str, Callable[[dict[str, str]], Iterator[str]]] = {
    "starts": starts,
    "searches": searches,
    "steps": steps,
    "cycles": cycles,
}


def main() -> None:
    """Run the groups that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "groups", nargs="*", metavar="GROUP", default=[], help=f"of {', '.join(GROUPS)}; all by default"
    )
    parser.add_argument("--robots", default="", help="names, separated by commas")
    arguments = parser.parse_args()
    wanted = set(filter(None, arguments.robots.split(",")))
    files = {name: file for name, file in robots().items() if not wanted or name in wanted}
    for group in arguments.groups or GROUPS:
        print(f"\n{GROUPS[group].__doc__}\n", flush=True)
        for line in GROUPS[group](files):
            print(line, flush=True)


if __name__ == "__main__":
    main()
