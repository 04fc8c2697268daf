"""Pushed walks of NAO with and without planning again: ``python -m benchmarks.onboard_loop [--walks N] [CONTROLLER...]``.

Four steps of the cheapest ``nao-cycle``. The pushes (50 ms on the torso) begin at N equidistant times of the second and third
step, each walk with noise of its own seed. For each controller and direction (``--directions forward,...``) bisection finds the
impulse at which at least half of the walks fall. The last line has a bound on it for pushes from the side.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from functools import partial

import numpy as np

import nlp_gait
from nlp_gait.formulation import Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import Sensing
from nlp_gait.simulation.feedback import Feedback
from nlp_gait.simulation.measurements import measure_walk
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.replanning import Replanning
from nlp_gait.simulation.simulate import DIRECTIONS, Conditions, Push, simulate_plan

STEPS = 4
FINE, LARGEST = 0.1, 3.2  # impulses [N s]
CONTROLLERS: dict[str, Sensing | None] = {
    "open loop": None,
    "torso-spring": Feedback(),
    "replan, hip only": Replanning(free=""),
    "replan, length and width": Replanning(free="length,width"),
    "replan 100 Hz": Replanning(),
    "replan 500 Hz": Replanning(period_s=0.002),
}


class Pushes:
    """Walks of one controller, and the plans that it made."""

    def __init__(self, plan: Plan, feedback: Sensing | None, walks: int) -> None:
        self._plan, self._feedback, self._walks = plan, feedback, walks
        self.plans: list[np.ndarray] = []

    def survives(self, direction: tuple[int, int], impulse: float) -> bool:
        """Return whether fewer than half of the walks fall; stop when that is known."""
        period, (x, y), fallen, stood = self._plan.duration_s / STEPS, direction, 0, 0
        for k in range(self._walks):
            push = Push(impulse_Ns=(x * impulse, y * impulse), start_s=period * (1.0 + 2.0 * k / self._walks))
            fell = self.walk(Conditions(push=push), k)
            fallen, stood = fallen + fell, stood + (not fell)
            if 2 * fallen >= self._walks or 2 * stood > self._walks:
                break
        return 2 * fallen < self._walks

    def walk(self, conditions: Conditions, seed: int) -> bool:
        """Return whether one walk falls."""
        feedback = self._feedback and replace(self._feedback, seed=seed)
        found = simulate_plan(self._plan, conditions, Drive(feedback=feedback))
        self.plans += [] if found.plans is None or not len(found.plans) else [found.plans]
        return found.fell_at_s is not None

    def find_half(self, direction: tuple[int, int]) -> float:
        """Return the impulse at which at least half fall [N s], to ``FINE``, by bisection up to ``LARGEST``."""
        low, high = 0, round(LARGEST / FINE)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.survives(direction, FINE * middle) else (low, middle)
        return FINE * high


def measure(plan: Plan, name: str, walks: int, directions: list[str]) -> None:
    """Print one controller's rows."""
    pushes = Pushes(plan, CONTROLLERS[name], walks)
    drive = Drive(feedback=CONTROLLERS[name])
    quiet = measure_walk(plan, simulate_plan(plan, Conditions(), drive), drive, STEPS)
    cost = "falls" if quiet.engine_J_per_m is None else f"{quiet.engine_J_per_m:.2f}"
    cells = [f"{pushes.find_half(DIRECTIONS[each]):.1f}" for each in directions]
    rest = ["-", "-", "-"]
    if pushes.plans:
        wall, converged = np.concatenate(pushes.plans).T[1:3]
        times = [f"{1000.0 * value:.1f} ms" for value in (np.median(wall), np.percentile(wall, 99))]
        rest = [*times, f"{np.mean(converged):.1%}"]
    print(f"| {name} | {' | '.join([*cells, cost, *rest])} |", flush=True)


def bound_sideways(plan: Plan, direction: str, walks: int) -> float:
    """Return the impulse [N s] at which half of the walks fall at best, for a pendulum with the whole mass at its mean height.

    A push towards a foot that stands moves the divergent component towards its outer edge, and no step can follow unless the legs
    cross. All other pushes are taken as survived.
    """
    t, com = plan.signals.arrays["t"], plan.signals.arrays["com"]
    rate = math.sqrt(plan.gravity / com[:, 2].mean())
    dcm = com[:, 1] + np.gradient(com[:, 1], t) / rate
    foot, sign = plan.robot.feet[direction], DIRECTIONS[direction][1]
    half_width = foot.left_m if sign > 0 else foot.right_m
    begins = plan.duration_s / STEPS * (1.0 + 2.0 * np.arange(walks) / walks)
    stands = plan.stands(direction, begins) > 0.0
    left = sign * (plan.at(f"{direction}_foot", begins)[:, 1] - np.interp(begins, t, dcm)) + half_width
    largest = np.where(stands, plan.robot.mass_kg * rate * left, np.inf)
    return float(np.sort(largest)[math.ceil(walks / 2) - 1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("controllers", nargs="*", default=list(CONTROLLERS), help=", ".join(CONTROLLERS))
    parser.add_argument("--walks", type=int, default=40)
    parser.add_argument("--directions", default=",".join(DIRECTIONS))
    arguments = parser.parse_args()
    directions = arguments.directions.split(",")
    problem = nlp_gait.load("nao-cycle")
    best = nlp_gait.solve(problem, starts=1, seed=0)
    plan = make_plan(Result(problem=problem, x=best.x), STEPS)
    print("impulse at which half of the walks fall [N s], energy undisturbed, and all plans of the pushed walks\n")
    print(f"| controller | {' | '.join(directions)} | J/m | time per plan | 99th percentile | converge |")
    print("|---|" + "--:|" * (len(directions) + 4))
    list(map(partial(measure, plan, walks=arguments.walks, directions=directions), arguments.controllers))
    bounds = [
        f"{each} {bound_sideways(plan, each, arguments.walks):.1f} N s" for each in directions if DIRECTIONS[each][1]
    ]
    print(f"\nbound for a pendulum whose legs do not cross: {', '.join(bounds)}")


if __name__ == "__main__":
    main()
