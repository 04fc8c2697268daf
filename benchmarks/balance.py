"""What balance feedback survives: pushes of whole walks, disturbed worlds, pushes at rest, and the time that it takes.

    python -m benchmarks.balance pushes WALK.json...        | python -m docs.pages.numbers balance-pushes
    python -m benchmarks.balance conditions WALK.json...    | python -m docs.pages.numbers balance-conditions
    python -m benchmarks.balance rest WALK.json...          | python -m docs.pages.numbers balance-rest

Walks are those that ``nlp-gait plan`` writes. Units of impulse are mass sqrt(gravity height); directions are those of the floor.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.engine.gaits import DIRECTIONS
from benchmarks.engine.markdown import cells, header
from nlp_gait.formulation import load_result
from nlp_gait.simulation.balance.controller import Balance
from nlp_gait.simulation.balance.drives import choose_feedback
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import Bumps
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import TIME_STEP, Conditions, Push, SimulationRun

FEEDBACKS = ("none", "balance")
INSTANTS = 12  # of pushes, even over the inner steps
LEVELS, LARGEST = 16, 0.5  # of the bisection, and its largest impulse [m sqrt(g h)]
PUSH_S = 0.1
SETTLE = 10.0  # [1 / w] after a push, within which a robot that has lost its balance falls
RECOVER, RESOLUTION = 25.0, 0.05  # the same at rest, where it may step and step back, and steps of the impulse [m w d]
SEEDS = range(12)
WORLDS = {  # by name: conditions by seed, and whether sensors have noise and a delay of 4 ms
    "bumps of 5 mm": (lambda seed: Conditions(bumps=Bumps(height_m=0.005, seed=seed)), False),
    "mass +5 %": (lambda seed: Conditions(mass_factor=1.05), False),
    "mass -5 %": (lambda seed: Conditions(mass_factor=0.95), False),
    "friction 0.5": (lambda seed: Conditions(friction=0.5), False),
    "noise, 4 ms delay": (lambda seed: Conditions(), True),
    "all at once": (
        lambda seed: Conditions(
            bumps=Bumps(height_m=0.005, seed=seed), mass_factor=1.05 if seed % 2 else 0.95, friction=0.5
        ),
        True,
    ),
}
SEEDED = ("bumps of 5 mm", "noise, 4 ms delay", "all at once")


def load(path: str) -> tuple[str, Plan, float, float]:
    """Return name, plan, height of the hip [m] and the unit of impulses [N s]."""
    plan = make_plan(load_result(Path(path)))
    height = float(plan.at("hip", np.zeros(1))[0, 2])
    return plan.robot.name, plan, height, plan.robot.mass_kg * math.sqrt(plan.gravity * height)


def falls(run: SimulationRun, impulse_Ns: tuple[float, float], settle_s: float) -> bool:
    """Return whether a robot falls that is pushed now."""
    pushed = run.fork(Push(impulse_Ns=impulse_Ns, start_s=run.time_s, duration_s=PUSH_S))
    pushed.advance(run.time_s + settle_s)
    return pushed.fell_at_s is not None


def bisect(
    runs: list[SimulationRun],
    direction: str,
    unit_Ns: float,
    settle_s: float,
    falls_needed: int = 1,
    levels: int = LEVELS,
) -> tuple[float, float]:
    """Return neighbouring impulses [N s] of ``levels`` up to the largest: so many runs fall at the second, fewer at the first."""
    (x, y), low, high = DIRECTIONS[direction], 0, levels
    level_Ns = LARGEST * unit_Ns / levels
    while high - low > 1:
        middle, fallen = (low + high) // 2, 0
        for k, run in enumerate(runs):
            fallen += falls(run, (x * middle * level_Ns, y * middle * level_Ns), settle_s)
            if not fallen < falls_needed <= fallen + len(runs) - k - 1:  # decided
                break
        low, high = (low, middle) if fallen >= falls_needed else (middle, high)
    return low * level_Ns, high * level_Ns


def tabulate_pushes(paths: list[str]) -> Iterator[str]:
    """Half of twelve walks fall at this impulse [N s]: pushes at instants that are even over the inner steps."""
    yield header("robot", "unit, N s", "feedback", *DIRECTIONS)
    for path in paths:
        name, plan, height, unit = load(path)
        settle = SETTLE * math.sqrt(height / plan.gravity)
        for feedback in FEEDBACKS:
            run, forks = SimulationRun(plan, drive=choose_feedback(Drive(), feedback)), []
            for k in range(INSTANTS):
                if run.advance(plan.duration_s * (0.3 + 0.4 * (k + 0.5) / INSTANTS)):
                    forks.append(run.fork(Push(impulse_Ns=(0.0, 0.0), start_s=run.time_s)))
            if len(forks) < INSTANTS:
                yield cells(name, f"{unit:.0f}", feedback, f"falls at {run.fell_at_s:.1f} s without a push", "", "", "")
                continue
            impulses = (bisect(forks, direction, unit, settle, INSTANTS // 2)[1] for direction in DIRECTIONS)
            yield cells(name, f"{unit:.3g}", feedback, *(f"{impulse:.3g}" for impulse in impulses))


def tabulate_conditions(paths: list[str]) -> Iterator[str]:
    """Share of the walks that stand, and the mean share of the planned way of those."""
    yield header("walk", "feedback", "as planned", *WORLDS)
    for path in paths:
        plan = load(path)[1]
        for feedback in FEEDBACKS:
            row = [describe_walks(plan, [(Conditions(), choose_feedback(Drive(), feedback))])]
            for world, (make, noisy) in WORLDS.items():
                walks = []
                for seed in SEEDS if world in SEEDED else (0,):
                    noise = {"noise": 1.0, "delay_s": 0.004, "seed": seed} if noisy else {}
                    walks.append((make(seed), Drive(feedback=Balance(**noise)) if feedback == "balance" else Drive()))
                row.append(describe_walks(plan, walks))
            yield cells(Path(path).stem, feedback, *row)


def describe_walks(plan: Plan, walks: list[tuple[Conditions, Drive]]) -> str:
    """Return how many walks stand, and how much of the straight way from their begin to their end they walk."""
    begin, end = plan.at("hip", np.array([0.0, plan.duration_s]))
    shares, way = list[float](), (end - begin) / ((end - begin) @ (end - begin))
    for conditions, drive in walks:
        trace = SimulationRun(plan, conditions, drive).finish()
        if trace.fell_at_s is None:
            shares.append(float((trace.torso[-1] - trace.torso[0]) @ way))
    distance = f", {100.0 * np.mean(shares):.0f} %" if shares else ""
    return f"{len(shares)} of {len(walks)}{distance}"


def tabulate_rest(paths: list[str]) -> Iterator[str]:
    """Least impulse at rest that fells a robot, over that of a pendulum whose ZMP is at the edge of its soles, in steps."""
    yield header("robot", "feedback", *DIRECTIONS, "ms per measurement")
    for path in paths:
        name, plan, height, unit = load(path)
        pendulum = math.sqrt(plan.gravity / height)
        step_ms = dict.fromkeys(("none", "balance"), 0.0)
        for feedback in step_ms:
            drive = choose_feedback(Drive(), feedback)
            run, begin = SimulationRun(plan, drive=drive, settle_s=RECOVER / pendulum + 3.0), process_time()
            run.advance(plan.duration_s + 2.0)
            step_ms[feedback] = 1e3 * (process_time() - begin) * TIME_STEP / run.time_s
            tick = ""
            if feedback == "balance":
                tick = f"{(step_ms['balance'] - step_ms['none']) * Balance().period_s / TIME_STEP:.2f}"
            if run.fell_at_s is not None:
                yield cells(name, feedback, f"falls at {run.fell_at_s:.1f} s", "", "", "", tick)
                continue
            bounds = find_bounds(plan, run, pendulum)
            shares = (find_least_share(run, way, bounds[way], RECOVER / pendulum) for way in DIRECTIONS)
            yield cells(name, feedback, *(f"{share:.2f}" for share in shares), tick)


def find_least_share(run: SimulationRun, direction: str, bound_Ns: float, settle_s: float) -> float:
    """Return the least share of a bound [N s] that fells a robot, infinite if none does."""
    x, y = DIRECTIONS[direction]
    for share in np.arange(0.5, 3.0, RESOLUTION):
        if falls(run, (x * share * bound_Ns, y * share * bound_Ns), settle_s):
            return float(share)
    return math.inf


def find_bounds(plan: Plan, run: SimulationRun, pendulum: float) -> dict[str, float]:
    """Return the impulse by direction that takes the divergent component to the edge of the soles, m w d [N s]."""
    data = run.data
    places = data.site_xpos[[data.model.site(side).id for side in plan.robot.feet]]
    soles = [plan.robot.feet[side] for side in plan.robot.feet]
    edges = {
        "forward": max(place[0] + sole.front_m for place, sole in zip(places, soles, strict=True)),
        "backward": -min(place[0] - sole.back_m for place, sole in zip(places, soles, strict=True)),
        "left": max(place[1] + sole.left_m for place, sole in zip(places, soles, strict=True)),
        "right": -min(place[1] - sole.right_m for place, sole in zip(places, soles, strict=True)),
    }
    com = data.subtree_com[0]
    return {
        way: plan.robot.mass_kg * pendulum * (edges[way] - x * com[0] - y * com[1])
        for way, (x, y) in DIRECTIONS.items()
    }


TABLES = {"pushes": tabulate_pushes, "conditions": tabulate_conditions, "rest": tabulate_rest}

if __name__ == "__main__":
    for line in TABLES[sys.argv[1]](sys.argv[2:]):
        print(line, flush=True)
