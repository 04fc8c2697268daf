"""Every public humanoid of the packages that we know, planned, simulated and pushed, with and without feedback.

    python -m benchmarks.humanoids FOLDER [--robots NAME,...] [--margins X,Y]    # a JSON file per robot; what exists is kept
    python -m benchmarks.humanoids FOLDER --table walks | python -m docs.pages.numbers zoo-walks
    python -m benchmarks.humanoids FOLDER --table others | python -m docs.pages.numbers zoo-others
    python -m benchmarks.humanoids FOLDER FOLDER... --table margins | python -m docs.pages.numbers margins
    python -m benchmarks.humanoids FOLDER --robots FILE,... --distance 1    # files that you have
    python -m benchmarks.humanoids FOLDER --table files | python -m docs.pages.numbers public-files

The last table takes a folder for each choice of margins. ``mujoco-menagerie`` downloads its robots,
or reads a copy below ``MENAGERIE_ROOT``.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

import nlp_gait
from benchmarks.balance import FEEDBACKS, SETTLE, bisect
from benchmarks.engine.gaits import DIRECTIONS
from benchmarks.engine.markdown import cells, header
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.plan_walk import MARGINS, WalkSettings
from nlp_gait.errors import GaitError
from nlp_gait.formulation import load_result
from nlp_gait.simulation.balance.drives import choose_feedback
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure_walk
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import Push, SimulationRun, simulate_plan

Row = dict[str, Any]

# Humanoids by package; a name stands for all files with the same legs, soles and masses.
ROBOTS: Mapping[str, tuple[str, ...]] = {
    "": ("nao-v4", "nao-v5", "nao-v6"),
    "jvrc-description": ("jvrc1",),
    "example-robot-data": (
        "g1_29dof_rev_1_0",
        "talos_reduced",
        "talos_full_v2",
        "romeo",
        "icub",
        "alexander_v1.lowerBodyOnly",
        "alex_nub_hands",
        "simple_humanoid",
        "romeo_laas_small",
        "bolt",
        "human",
    ),
    "icub-models": (
        "iCubGazeboV2_5",
        "iCubGazeboV2_7",
        "iCubGenova01",
        "iCubGenova02",
        "iCubGenova03",
        "iCubGenova04",
        "iCubGenova11",
        "iCubNancy01",
    ),
    "menagerie": (
        "unitree_g1",
        "booster_t1",
        "apptronik_apollo",
        "robotis_op3",
        "unitree_h1",
        "berkeley_humanoid",
        "fourier_n1",
        "pal_talos",
        "pndbotics_adam_lite",
        "toddlerbot_2xc",
        "toddlerbot_2xm",
    ),
    "fourier-robot-descriptions": (
        "urdf/gr1t1",
        "urdf/gr1t2",
        "urdf/gr2t2",
        "urdf/gr2t2v2",
        "urdf/gr3",
        "urdf/qinglong",
    ),
    "armar": ("armar4", "armar6"),
    "mjlab": ("g1",),
}
STEPS = 10
LEVELS = 32  # of the bisection
NO_PUSH = Push(impulse_Ns=(0.0, 0.0))


def list_names() -> list[str]:
    """Return the names of all robots, as ``--robot`` takes them."""
    return [f"{package}:{name}" if package else name for package, names in ROBOTS.items() for name in names]


def plan(name: str, folder: Path, row: Row) -> Row:
    """Plan ten steps, or a distance, at the cheapest speed; returns numbers, or why there is no plan."""
    begin, steps = perf_counter(), STEPS if row.get("distance_m") is None else None
    try:
        walk = nlp_gait.plan_walk(
            name, steps, distance_m=row.get("distance_m"), settings=WalkSettings(margins=row["margins"])
        )
    except GaitError as error:
        reason = "not run" if "does not provide" in str(error) or "not installed" in str(error) else "refused"
        return {reason: str(error)}
    if not walk.feasible:
        return {"infeasible": list(walk.obstacles), "planning_s": perf_counter() - begin}
    walk.save(find_plan(folder, name))
    problem, robot = walk.solution.problem, walk.solution.problem.display.robot
    assert robot is not None
    metrics = build_exact_model(problem).at(walk.solution.best.x, problem.p).metrics
    return {
        "robot": robot.name,
        "mass_kg": robot.mass_kg,
        "energy_J_per_m": walk.energy_J / walk.distance_m,
        "speed_m_s": float(metrics["speed_m_s"]) if "speed_m_s" in metrics else None,  # None if the steps differ
        "distance_m": walk.distance_m,
        "margins_m": [
            min(float(value) for name, value in metrics.items() if name.endswith(f"ssp_dbm_{axis}_min_m"))
            for axis in "xy"
        ],
        "active_margins": list(walk.active_margins),
        "planning_s": perf_counter() - begin,
    }


def find_plan(folder: Path, name: str) -> Path:
    """Return the file of a robot's plan."""
    return folder / "plans" / f"{name.replace(':', '_').replace('/', '_')}.json"


def walk(name: str, folder: Path, row: Row) -> Row:
    """Simulate the plan with each feedback; returns the share of the planned distance, or when the robot fell [s]."""
    plan = make_plan(load_result(find_plan(folder, name)))
    walked: Row = {}
    for feedback in FEEDBACKS:
        drive = choose_feedback(Drive(), feedback)
        trace = simulate_plan(plan, drive=drive)
        measured = measure_walk(plan, trace, drive, STEPS)
        share = None if measured.walked_m is None else measured.walked_m / row["plan"]["distance_m"]
        walked[feedback] = {
            "walked": share,
            "fell_at_s": trace.fell_at_s,
            "model_J_per_m": measured.model_J_per_m,
            "engine_J_per_m": measured.engine_J_per_planned_m,
        }
    return walked


def push(name: str, folder: Path, row: Row) -> Row:
    """Return the largest impulse on the torso that the robot survives in each direction at both instants [N s]."""
    plan = make_plan(load_result(find_plan(folder, name)))
    unit = plan.robot.mass_kg * math.sqrt(plan.gravity * plan.at("hip", np.zeros(1))[0, 2])
    return {
        feedback: find_pushes(plan, choose_feedback(Drive(), feedback), unit)
        for feedback in FEEDBACKS
        if row["walk"][feedback]["fell_at_s"] is None
    }


def find_pushes(plan: Plan, drive: Drive, unit_Ns: float) -> dict[str, float]:
    """Bisect the impulse of pushes in the middle of two successive swings of the inner steps, by direction [N s]."""
    run, forks = SimulationRun(plan, None, drive), []
    for begin, end in list_swings(plan)[3:5]:
        run.advance((begin + end) / 2)
        forks.append(run)
        run = run.fork(NO_PUSH)
    settle_s = SETTLE / math.sqrt(plan.gravity / plan.at("hip", np.zeros(1))[0, 2])
    return {way: bisect(forks, way, unit_Ns, settle_s, levels=LEVELS)[0] for way in DIRECTIONS}


def list_swings(plan: Plan) -> list[tuple[float, float]]:
    """Return begin and end of the swings of the feet, in the order of time [s]."""
    times = np.arange(0.0, plan.duration_s, 0.002)
    single = np.logical_xor(plan.stands("left", times), plan.stands("right", times)).astype(int)
    begins, ends = (np.flatnonzero(np.diff(single) == sign) for sign in (1, -1))
    return list(zip(times[begins], times[ends], strict=True))


STAGES: Mapping[str, Callable[[str, Path, Row], Row]] = {"plan": plan, "walk": walk, "push": push}


def run(names: list[str], folder: Path, margins: list[float], distance_m: float | None = None) -> None:
    """Run the stages that a robot's file lacks, one robot after another."""
    (folder / "plans").mkdir(parents=True, exist_ok=True)
    for name in names:
        file = folder / find_plan(folder, name).name
        row: Row = {"name": name, "margins": margins, "distance_m": distance_m}
        row = json.loads(file.read_text(encoding="utf-8")) if file.exists() else row
        for stage, compute in STAGES.items():
            if stage not in row and (stage == "plan" or "energy_J_per_m" in row["plan"]):
                row[stage] = compute(name, folder, row)
                file.write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
                print(name, stage, json.dumps(row[stage])[:200], flush=True)


def list_rows(folder: Path) -> list[Row]:
    """Return the stored rows of all robots, in order; a robot without a file has only its name."""
    files = [(name, folder / find_plan(folder, name).name) for name in list_names()]
    return [json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"name": name} for name, file in files]


def tabulate_walks(folders: list[Path]) -> Iterator[str]:
    """Tabulate the robots that have a plan."""
    yield header(
        "`--robot`",
        "mass, kg",
        "J/m",
        "speed, m/s",
        "margins, mm",
        "walked in open loop",
        "with `balance`",
        "push in open loop, N s",
        "with `balance`, N s",
    )
    for row in list_rows(folders[0]):
        plan = row.get("plan", {})
        if "energy_J_per_m" not in plan:
            continue
        yield cells(
            f"`{row['name']}`",
            f"{plan['mass_kg']:.1f}",
            f"{plan['energy_J_per_m']:.3g}",
            "of each step" if plan["speed_m_s"] is None else f"{plan['speed_m_s']:.2f}",
            ", ".join(f"{1e3 * margin:.0f}" for margin in plan["margins_m"]),
            *(describe_walk(row, feedback) for feedback in FEEDBACKS),
            *(describe_pushes(row, feedback) for feedback in FEEDBACKS),
        )


def tabulate_margins(folders: list[Path]) -> Iterator[str]:
    """Tabulate energy and pushes of the robots that have plans in all folders, each with other margins."""
    yield header(
        "robot", "margins along, across, of a sole", "J/m", "in open loop", "with `balance`", "push with `balance`, N s"
    )
    for rows in zip(*map(list_rows, folders), strict=True):
        if not all("push" in row for row in rows):
            continue
        for row in sorted(rows, key=lambda row: row["margins"]):
            yield cells(
                row["plan"]["robot"],
                ", ".join(f"{100.0 * share:.0f} %" for share in row["margins"]),
                f"{row['plan']['energy_J_per_m']:.3g}",
                *(describe_walk(row, feedback) for feedback in FEEDBACKS),
                describe_pushes(row, "balance"),
            )


def describe_walk(row: Row, feedback: str) -> str:
    """Return the share of the planned distance that a robot walks, or when it falls."""
    if "walk" not in row:
        return "not run"
    walked = row["walk"][feedback]
    return f"{walked['walked']:.1%}" if walked["fell_at_s"] is None else f"falls at {walked['fell_at_s']:.1f} s"


def describe_pushes(row: Row, feedback: str) -> str:
    """Return the largest impulses forward, backward, to the left and to the right that a robot survives [N s]."""
    if "walk" in row and row["walk"][feedback]["fell_at_s"] is not None:
        return "falls unpushed"
    if "push" not in row:
        return "not run"
    return ", ".join(f"{impulse:.2g}" for impulse in row["push"][feedback].values())


def tabulate_others(folders: list[Path]) -> Iterator[str]:
    """Tabulate the robots that are refused or have no feasible plan, and those that were not run."""
    yield header("`--robot`", "why it has no walk here")
    for row in list_rows(folders[0]):
        plan = row.get("plan", {"not run": "time"})
        if "refused" in plan:
            yield cells(f"`{row['name']}`", f"refused: {shorten(plan['refused'])}")
        elif "infeasible" in plan:
            yield cells(f"`{row['name']}`", f"no feasible walk: {plan['infeasible'][0].partition(' (')[0]}")
        elif "not run" in plan:
            why = "its package downloads it" if "download" in plan["not run"] else "time"
            yield cells(f"`{row['name']}`", f"not run ({why})")


def tabulate_files(folders: list[Path]) -> Iterator[str]:
    """Tabulate the files of a folder that are in no package: energy by the model and in both simulations."""
    yield header("file", "mass, kg", "model, J/m", "in open loop, J/m", "with `balance`, J/m")
    known = set(list_names())
    rows = [json.loads(file.read_text(encoding="utf-8")) for file in sorted(folders[0].glob("*.json"))]
    for row in (row for row in rows if row["name"] not in known):
        plan = row.get("plan", {"not run": "time"})
        if "energy_J_per_m" in plan:
            energies = [
                describe_energy(row["walk"][feedback]) if "walk" in row else "not run" for feedback in FEEDBACKS
            ]
            yield cells(f"`{row['name']}`", f"{plan['mass_kg']:.1f}", f"{plan['energy_J_per_m']:.3g}", *energies)
        else:
            why = shorten(plan["refused"]) if "refused" in plan else plan.get("infeasible", ["not run (time)"])[0]
            mass = f"{plan['mass_kg']:.1f}" if "mass_kg" in plan else ""
            yield cells(f"`{row['name']}`", mass, why, "", "")


def describe_energy(walked: Row) -> str:
    """Return the energy in the engine per planned metre, or when the robot falls."""
    if walked["fell_at_s"] is not None:
        return f"falls at {walked['fell_at_s']:.1f} s"
    return f"{walked['engine_J_per_m']:.3g}"


def shorten(message: str) -> str:
    """Return the sentence of an error that names the fault, without the robot's name and the remedy."""
    fault = re.sub(r"^robot (file )?'[^']*': ", "", message)
    if pair := re.search(r"the lowest pair, .*?(?=; if these)|no links are mirror images", fault):
        return pair[0]
    return re.split(r"\. [A-Z]|; (?:correct|else|put it there|add its motor|a rigid body)|: none of its", fault)[0]


TABLES = {"files": tabulate_files, "walks": tabulate_walks, "others": tabulate_others, "margins": tabulate_margins}


def main() -> None:
    """Run the robots that are asked for, or print the table of what has finished."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--margins", default=",".join(map(str, MARGINS)), help="as of nlp-gait plan")
    parser.add_argument("--robots", default="", help="names, separated by commas; all by default")
    parser.add_argument("--distance", type=float, help="that the robots walk [m], instead of ten steps")
    parser.add_argument("--table", choices=TABLES, help="print this table of what has finished")
    arguments = parser.parse_args()
    if arguments.table is not None:
        print("\n".join(TABLES[arguments.table](arguments.folders)))
        return
    names = list(filter(None, arguments.robots.split(","))) or list_names()
    run(names, arguments.folders[0], [float(share) for share in arguments.margins.split(",")], arguments.distance)


if __name__ == "__main__":
    main()
