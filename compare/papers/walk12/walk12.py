"""Goswami, Vadakkepat, Phung (2008): Tables III and IV of the 12-joint walk and the paper's claims, by its readings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import permutations
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from compare.papers.paper import DifferenceRow, Paper
from compare.papers.rules import Alternatives
from compare.papers.walk12.page import count_met, show
from compare.papers.walk12.results import (
    F1MAX,
    F2MAX,
    GA,
    LAST,
    LITERAL,
    NAMES,
    OPTIONS,
    READINGS,
    SECOND_ROW,
    SMALL,
    TABLE_3,
    TABLE_4,
    UNBENT_WEIGHTS,
    PaperRow,
    Results,
    Walk12Effort,
    compute,
    compute_f,
    compute_f1,
    follow,
)
from compare.study.record import RunRecord
from nlp_gait.gaits.walk12 import walk12_model
from nlp_gait.gaits.walk12.walk12_model import GRAVITY, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_problem import LARGEST_TURN, make_rule
from nlp_gait.gaits.walk12.walk12_steps import JOINTS
from nlp_gait.symbolic.nonsmooth import Exact

CONVERGED_EPOCH, EPOCHS_WEIGHT = 15, 0.15
DIGIT_M, DIGIT_F = 5e-4, 5e-4  # half the last printed digit
ROD_SHARE = 0.1  # of the actuators' mass: section 6 gives 5 to 10 %
MEASURED_STEP_S = 1.2  # time of a step on the robot, section 7


def compute_f1max(result: Results) -> float:
    """Return the largest f1 [1/(m^2 s)]."""
    return F1MAX * result.best("1").objective


def list_gaps(
    result: Results, rows: Sequence[PaperRow], f1max: Sequence[float], optima: Sequence[RunRecord]
) -> list[float]:
    """Return how far f of printed gaits is below the optima under the same f1max [%]."""
    triples = zip(rows, f1max, optima, strict=True)
    return [100 * (1 - compute_f(row, most, **result.options) / best.objective) for row, most, best in triples]


def compute_lead_by_print(result: Results) -> float:
    """Return the largest lead in f of a printed gait at the lambda of another one, by (11) from the print.

    It is linear in the printed f and s, so the effect of their rounding is known; s is within (7).
    """
    leads = []
    for other, row in permutations(TABLE_3, 2):
        of_f = other.weight / row.weight
        of_s = ((1 - other.weight) - (1 - row.weight) * of_f) / F2MAX
        ends = (row.s - DIGIT_M, min(row.s + DIGIT_M, F2MAX))
        leads.append(of_f * (row.f - DIGIT_F) + min(of_s * s for s in ends) - (other.f + DIGIT_F))
    return max(leads)


def compute_stable_share(result: Results, x: Sequence[float]) -> float:
    """Return the share of a step in which a gait satisfies (8)."""
    robot = load_point_mass_biped()
    zmp_x, zmp_y = follow(x, intervals=1000, zmp=result.options.get("zmp", "exact"))["zmp_foot"].T
    along = (-robot.foot_back_m <= zmp_x) & (zmp_x <= robot.foot_front_m)
    return float((along & (np.abs(zmp_y) <= robot.foot_width_m / 2)).mean())


def compute_spread(values: Sequence[float]) -> float:
    """Return how far the largest value is above the least [%]."""
    return 100 * (max(values) / min(values) - 1)


def list_share_spreads(result: Results) -> list[float]:
    """Return the spread of f1 / f1max over T, by the print and (11), and of the optima [%]."""
    pairs = zip(result.optima_over_time, result.f1max_over_time, strict=True)
    ours = [best.metrics["f1_per_m2s"] / most for best, most in pairs]
    return [compute_spread([row.implied_f1 / row.f1max for row in TABLE_4]), compute_spread(ours)]


def list_speeds_over_time(result: Results) -> list[list[float]]:
    """Return s / T from T = 0.5 to 2 s of the printed gaits and of the optima [m/s]."""
    ours = [best.x["step_length_m"] for best in result.optima_over_time]
    times = [row.step_time_s for row in TABLE_4]
    return [[s / T for s, T in zip(steps, times, strict=True)][::-1] for steps in ([row.s for row in TABLE_4], ours)]


def list_zmp_errors(zmp: str) -> list[float]:
    """Return the largest distance of a reading of the ZMP from the point without moment, by printed gait [mm]."""
    points = [[follow(row.x, zmp=reading)["zmp_foot"] for reading in (zmp, "moment-free")] for row in TABLE_3]
    return [1e3 * float(np.linalg.norm(a - b, axis=1).max()) for a, b in points]


def list_speeds() -> Alternatives:
    """Return the speeds of the printed gaits of lambda = 0.15, 0.1 and 1 by both step times of section 7 [m/s]."""
    lengths = [row.s for row in (SECOND_ROW, SMALL, LAST)]
    return Alternatives("the step time", {f"{T:g} s": [s / T for s in lengths] for T in (1.0, MEASURED_STEP_S)})


def measure_circle() -> float:
    """Return the largest distance of the left foot's prints from a circle, with the largest turn of section 5.4 [mm]."""
    walked = follow(LAST.x, steps=12, intervals=2, turn_rad=LARGEST_TURN)
    x, y = walked["left_ankle"][walked["left_stance"] == 1.0, :2].T
    centre_x, centre_y, rest = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2)[0]
    return 1e3 * float(np.ptp(np.hypot(x - centre_x, y - centre_y)))


def list_rod_changes(result: Results) -> list[float]:
    """Return the change of f1 of the printed gaits by links as uniform rods [%]."""
    robot = load_point_mass_biped()
    phases, weights = (np.array(numbers).ravel() for numbers in make_rule("gauss", 20))
    m = np.array(walk12_model.list_masses(robot)).ravel()
    x, phase = SX.sym("x", len(NAMES)), SX.sym("phase")
    legs = walk12_model.compute_legs(x, phase, SX(1), SX(0), SX(0), robot, Exact())
    masses, ankle = walk12_model.compute_mass_motion(*legs, robot), legs[1].ankle
    outputs = [masses.position, masses.acceleration, ankle.position, ankle.acceleration]
    sample = ca.Function("masses", [x, phase], outputs)
    changes = []
    for row in TABLE_3:
        points = [[np.array(value) for value in sample(np.array(row.x), phase)] for phase in phases]
        P, A, foot, foot_a = (np.array(values) for values in zip(*points, strict=True))
        turning = np.zeros((len(phases), 3))
        for end, end_a, knee, hip in ((0 * foot, 0 * foot, 1, 2), (foot, foot_a, 5, 4)):
            for low, low_a, high in ((end, end_a, knee), (P[:, :, [knee]], A[:, :, [knee]], hip)):
                spin = np.cross((P[:, :, [high]] - low)[:, :, 0], (A[:, :, [high]] - low_a)[:, :, 0])  # l^2 u x u''
                turning += ROD_SHARE / 4 * m.sum() / 12 * spin
        xy = (P[:, :2] * (A[:, 2:] + GRAVITY) - P[:, 2:] * A[:, :2]) @ m
        f1 = [
            1 / (weights @ (((xy + moments) / (GRAVITY * m.sum())) ** 2).sum(axis=1))
            for moments in (0.0, turning[:, [1, 0]] * [-1.0, 1.0])
        ]
        changes.append(100 * abs(f1[1] / f1[0] - 1))
    return changes


def find_branch() -> float:
    """Return the distance between hip and ankle below which the printed (2) misses the hip [m]."""
    robot = load_point_mass_biped()
    return math.sqrt(abs(robot.thigh_m**2 - robot.shank_m**2))


def compute_leg_room(result: Results) -> float:
    """Return the least distance from hip to ankle above that where (2) misses [mm]."""
    robot, knees = load_point_mass_biped(), [JOINTS.index(name) for name in ("theta_3", "theta_10")]
    gaits = [*(row.x for row in TABLE_3), *([*best.x.values()] for best in result.optima)]
    bent = max(float(follow(x)["q"][:, knees].max()) for x in gaits)
    thigh, shank = robot.thigh_m, robot.shank_m
    return 1e3 * (math.sqrt(thigh**2 + shank**2 + 2 * thigh * shank * math.cos(bent)) - find_branch())


def compute_gain(result: Results) -> float:
    """Return the gain of the GA's median run after the epoch at which the paper says it has converged [%]."""
    gains = []
    for run in result.find_runs(f"{EPOCHS_WEIGHT:g}", "ga"):
        f = np.array(run.history.objective, dtype=float)
        epoch = int(np.searchsorted(run.history.evaluations, GA.population * (1 + CONVERGED_EPOCH)))
        gains.append(100 * float(1 - f[min(epoch, len(f) - 1)] / f[-1]))
    return float(np.median(gains))


def measure_option(row: DifferenceRow, results: Mapping[str, Results]) -> dict[str, float]:
    """Return the least and the largest change of f1 of Table III by an option, and more where it is a reading."""
    changes = [100 * (compute_f1(gait, **row.options) / compute_f1(gait) - 1) for gait in TABLE_3]
    effects = {"f1 of Table III, least change [%]": min(changes), "largest [%]": max(changes)}
    if reading := next((name for name, chosen in OPTIONS.items() if chosen == row.options), None):
        result = results[reading]
        effects |= {"f of Table III within 1 %": count_met(result), "largest f1 [1/(m² s)]": compute_f1max(result)}
    return effects


def measure_bounds(row: DifferenceRow, results: Mapping[str, Results]) -> dict[str, float]:
    """Return the gain of f where knees may be straight [%]."""
    best = results[LITERAL].best
    gains = {weight: best(f"unbent-{weight:g}").objective / best(f"{weight:g}").objective for weight in UNBENT_WEIGHTS}
    return {f"optimal f at λ = {weight:g} [%]": 100 * (gain - 1) for weight, gain in gains.items()}


NUMBERS: dict[str, Callable[[Results], Any]] = {
    "f": lambda r: r.list_f(TABLE_3),
    "f-of-table-4": lambda r: r.list_f(TABLE_4),
    "f1-last": lambda r: r.f1[-1],
    "f1max": compute_f1max,
    "optimal": lambda r: list_gaps(r, TABLE_3, [row.f1max for row in TABLE_3], r.optima),
    "optimal-over-time": lambda r: list_gaps(r, TABLE_4, r.f1max_over_time, r.optima_over_time),
    "optimal-by-print": compute_lead_by_print,
    "steps": lambda r: [1e3 * best.x["step_length_m"] for best in r.optima],
    "variables": lambda r: [1e3 * x for best in r.optima for x in [*best.x.values()][1:]],
    "steps-over-time": lambda r: [1e3 * best.x["step_length_m"] for best in r.optima_over_time],
    "most-stable": lambda r: 100 * (r.f1[-1] / max(r.f1[:-1]) - 1),
    "short-steps": lambda r: [run.metrics["f1_per_m2s"] for run in r.front],
    "margin": lambda r: [best.metrics["f1_per_m2s"] for best in r.optima],
    "static": lambda r: [compute_stable_share(r, x) for x in (LAST.x, [*r.best("1").x.values()])],
    "speed": lambda r: list_speeds(),
    "speed-order": lambda r: [row.s for row in (SMALL, SECOND_ROW, LAST)],
    "f1-over-time": lambda r: [compute_f1(row, **r.options) for row in reversed(TABLE_4)],
    "f1max-over-time": lambda r: r.f1max_over_time,
    "share-over-time": list_share_spreads,
    "slows": list_speeds_over_time,
    "f-over-time": lambda r: compute_spread([best.objective for best in r.optima_over_time]),
    "accuracy": lambda r: list_zmp_errors("appendix-as-printed"),
    "accuracy-corrected": lambda r: list_zmp_errors("appendix"),
    "circle": lambda r: measure_circle(),
    "moments": list_rod_changes,
    "inverse-kinematics": compute_leg_room,
}
NUMBERS_OF_RUNS: dict[str, Callable[[Results], Any]] = {
    "ranks-3": lambda r: [r.list_ends(f"{row.weight:g}") for row in TABLE_3[:-1]],
    "rank-f1max": lambda r: [r.list_ends("1", F1MAX)],
    "ranks-4": lambda r: [r.list_ends(f"stable-{row.step_time_s:g}s", F1MAX) for row in TABLE_4],
    "epochs": compute_gain,
}
EFFECTS: dict[str, Callable[[DifferenceRow, Mapping[str, Results]], Any]] = {
    **dict.fromkeys(("appendix", "load", "step", "a1", "ankle"), measure_option),
    "bounds": measure_bounds,
    "branch": lambda row, results: {"misses where hip and ankle are nearer than [mm]": 1e3 * find_branch()},
    "ground": lambda row, results: {"below the ground in the second step, λ = 0.15 [mm]": 1e3 * SECOND_ROW.H},
    "jump": lambda row, results: {"jump where steps meet, λ = 0.15 [m/s]": math.pi * SECOND_ROW.n},
}

REPRODUCTION = Paper(
    module=__file__,
    title="The 12-joint walk: Goswami, Vadakkepat, Phung (2008)",
    citation=(
        "D. Goswami, P. Vadakkepat, D. K. Phung: *Genetic algorithm-based optimal bipedal walking gait synthesis considering "
        "tradeoff between stability margin and speed*, Robotica (2008)."
    ),
    full=Walk12Effort(),
    quick=Walk12Effort(runs=0, starts=5, lengths_m=(0.05, 0.09, 0.13)),
    readings={name: row["text"] for name, row in READINGS.items()},
    choices={name: row["choice"] for name, row in READINGS.items() if row["choice"]},
    compute=compute,
    numbers=NUMBERS,
    numbers_of_runs=NUMBERS_OF_RUNS,
    effects=EFFECTS,
    headlines=(
        *("f1-last", "optimal", "ranks-3", "short-steps", "margin"),
        *("speed", "speed-order", "accuracy", "accuracy-corrected"),
    ),
    show=show,
)
