"""Goswami, Vadakkepat, Phung (2008): Tables III and IV of the 12-joint walk and the paper's claims, by its readings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import permutations

import casadi as ca
import numpy as np
from casadi import SX

from compare.papers.paper import Paper, parse_settings, read_book
from compare.papers.paper_runs import get_point, read_objective, tabulate
from compare.papers.rules import Alternatives
from compare.papers.walk12.figures import draw_figures, draw_gait
from compare.papers.walk12.results import (
    F1MAX,
    F2MAX,
    GA,
    LAST,
    LITERAL,
    OPTIONS,
    RAISED,
    READINGS,
    SECOND,
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
    make_title,
)
from compare.report.document import Part, Prose, Section, Table, Value
from compare.study.record import RunRecord
from nlp_gait.gaits.walk12 import walk12_model
from nlp_gait.gaits.walk12.walk12_model import GRAVITY, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_problem import LARGEST_TURN, PRINTED_STEPS, make_rule
from nlp_gait.gaits.walk12.walk12_steps import JOINTS
from nlp_gait.symbolic.nonsmooth import Exact

BOOK = read_book(__file__)
CONVERGED_EPOCH, EPOCHS_WEIGHT = 15, 0.15
NAMES = ("s", "n", "H", "h")
DIGIT_M, DIGIT_F = 5e-4, 5e-4  # half the last printed digit
ROD_SHARE = 0.1  # of the actuators' mass: section 6 gives 5 to 10 %
MEASURED_STEP_S = 1.2  # time of a step on the robot, section 7


def list_f(result: Results, rows: Sequence[PaperRow]) -> list[float]:
    """Return f of printed gaits under the printed f1max."""
    return [compute_f(row, row.f1max, **result.options) for row in rows]


def compute_f1max(result: Results) -> float:
    """Return the largest f1 [1/(m^2 s)]."""
    return F1MAX * result.best("1").objective


def list_gaps(result: Results) -> list[float]:
    """Return how far f of the gaits of Table III is below the optima [%]."""
    pairs = zip(list_f(result, TABLE_3), result.optima, strict=True)
    return [100 * (1 - f / best.objective) for f, best in pairs]


def list_gaps_over_time(result: Results) -> list[float]:
    """Return how far f of the gaits of Table IV is below the optima [%]."""
    rows = zip(TABLE_4, result.f1max_over_time, result.optima_over_time, strict=True)
    return [100 * (1 - compute_f(row, most, **result.options) / best.objective) for row, most, best in rows]


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


def compute_stable_share(x: Sequence[float], zmp: str) -> float:
    """Return the share of a step in which a gait satisfies (8)."""
    robot = load_point_mass_biped()
    zmp_x, zmp_y = follow(x, intervals=1000, zmp=zmp)["zmp_foot"].T
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
    ours = [get_point(best)[0] for best in result.optima_over_time]
    pairs = list(zip(TABLE_4, ours, strict=True))[::-1]
    return [[row.s / row.step_time_s for row, _ in pairs], [s / row.step_time_s for row, s in pairs]]


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
    gaits = [*(row.x for row in TABLE_3), *map(get_point, result.optima)]
    bent = max(float(follow(x)["q"][:, knees].max()) for x in gaits)
    thigh, shank = robot.thigh_m, robot.shank_m
    return 1e3 * (math.sqrt(thigh**2 + shank**2 + 2 * thigh * shank * math.cos(bent)) - find_branch())


def list_ends(result: Results, what: Sequence[str], scale: float) -> list[list[float]]:
    """Return f at the ends of the GA's runs on each problem, times a scale; minus infinity without a feasible gait."""
    ends = [[run for run in result.find_runs(problem, "ga")] for problem in what]
    return [[scale * end.objective if end.feasible else -math.inf for end in row] for row in ends]


def compute_gain(result: Results) -> float:
    """Return the gain of the GA's median run after the epoch at which the paper says it has converged [%]."""
    gains = []
    for run in result.find_runs(f"{EPOCHS_WEIGHT:g}", "ga"):
        f = np.array(run.history.objective, dtype=float)
        epoch = int(np.searchsorted(run.history.evaluations, GA.population * (1 + CONVERGED_EPOCH)))
        gains.append(100 * float(1 - f[min(epoch, len(f) - 1)] / f[-1]))
    return float(np.median(gains))


def measure_option(results: Mapping[str, Results], id: str) -> dict[str, float]:
    """Return the least and the largest change of f1 of Table III by an option, and more where it is a reading."""
    options = parse_settings(BOOK.differences[id].option)[0]
    changes = [100 * (compute_f1(gait, **options) / compute_f1(gait) - 1) for gait in TABLE_3]
    effects = {"f1 of Table III, least change [%]": min(changes), "largest [%]": max(changes)}
    if reading := next((name for name, chosen in OPTIONS.items() if chosen == options), None):
        result = results[reading]
        effects |= {"f of Table III within 1 %": count_met(result), "largest f1 [1/(m² s)]": compute_f1max(result)}
    return effects


def measure_horizon(results: Mapping[str, Results]) -> dict[str, float]:
    """Return by how much f of the gaits of Table IV differs from the print [%]."""
    return {
        f"f of Table IV at T = {gait.step_time_s:g} s, {name} [%]": 100 * (f / gait.f - 1)
        for name in (LITERAL, SECOND)
        for f, gait in zip(list_f(results[name], TABLE_4), TABLE_4, strict=True)
    }


def measure_bounds(results: Mapping[str, Results]) -> dict[str, float]:
    """Return the gain of f where knees may be straight [%]."""
    result, effects = results[LITERAL], dict[str, float]()
    for weight in UNBENT_WEIGHTS:
        free, bent = (result.best(f"{prefix}{weight:g}").objective for prefix in ("unbent-", ""))
        effects[f"optimal f at λ = {weight:g} [%]"] = 100 * (free / bent - 1)
    return effects


BOOK.bind(
    {
        "f": lambda r: list_f(r, TABLE_3),
        "f-of-table-4": lambda r: list_f(r, TABLE_4),
        "f1-last": lambda r: r.f1[-1],
        "f1max": compute_f1max,
        "optimal": list_gaps,
        "optimal-over-time": list_gaps_over_time,
        "optimal-by-print": compute_lead_by_print,
        "steps": lambda r: [1e3 * get_point(best)[0] for best in r.optima],
        "variables": lambda r: [1e3 * x for best in r.optima for x in get_point(best)[1:]],
        "steps-over-time": lambda r: [1e3 * get_point(best)[0] for best in r.optima_over_time],
        "most-stable": lambda r: 100 * (r.f1[-1] / max(r.f1[:-1]) - 1),
        "short-steps": lambda r: [run.metrics["f1_per_m2s"] for run in r.front],
        "margin": lambda r: [best.metrics["f1_per_m2s"] for best in r.optima],
        "static": lambda r: [compute_stable_share(x, r.zmp) for x in (LAST.x, get_point(r.best("1")))],
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
)
BOOK.bind(
    {
        "ranks-3": lambda r: list_ends(r, [f"{row.weight:g}" for row in TABLE_3[:-1]], 1.0),
        "rank-f1max": lambda r: list_ends(r, ["1"], F1MAX),
        "ranks-4": lambda r: list_ends(r, [f"stable-{row.step_time_s:g}s" for row in TABLE_4], F1MAX),
        "epochs": compute_gain,
    },
    runs=True,
)
BOOK.bind({id: partial(measure_option, id=id) for id in ("appendix", "load", "step", "a1", "ankle")})
BOOK.bind(
    {
        "horizon": measure_horizon,
        "yardstick": lambda results: {"the model's largest f1 at T = 1 s [1/(m² s)]": compute_f1max(results[LITERAL])},
        "bounds": measure_bounds,
        "branch": lambda results: {"misses where hip and ankle are nearer than [mm]": 1e3 * find_branch()},
        "ground": lambda results: {"below the ground in the second step, λ = 0.15 [mm]": 1e3 * SECOND_ROW.H},
        "jump": lambda results: {"jump where steps meet, λ = 0.15 [m/s]": math.pi * SECOND_ROW.n},
    }
)


def count_met(result: Results) -> int:
    """Return how many printed f of Table III our model meets within 1 %."""
    return sum(abs(f / row.f - 1) <= 0.01 for f, row in zip(list_f(result, TABLE_3), TABLE_3, strict=True))


def measure_f1max(results: Mapping[str, Results]) -> dict[str, float]:
    """Return by how much the largest f1 over T misses the print with Q over one second [%]."""
    result = results[SECOND]
    pairs = zip(TABLE_4, result.f1max_over_time, strict=True)
    return {f"f1max at T = {row.step_time_s:g} s [%]": 100 * (most / row.f1max - 1) for row, most in pairs}


def show(results: Mapping[str, Results]) -> list[Part]:
    """Return gaits, figures, Tables III and IV next to ours, and what explains the print."""
    return [
        draw_gait(results[LITERAL]),
        Section(title="Figures of the paper, from our computation", parts=draw_figures(results)),
        Section(title="Tables III and IV", parts=[*tabulate_third(results), tabulate_fourth(results)]),
        Section(title="What explains the print", parts=[Prose(explain(results))]),
    ]


def tabulate_third(results: Mapping[str, Results]) -> list[Table]:
    """Return f of Table III, and its variables, next to ours."""
    ours, values, variables = results[LITERAL], list[Mapping[str, Value]](), list[Mapping[str, Value]]()
    for row, best in zip(TABLE_3, ours.optima, strict=True):
        gaits = {f"gait, {name}": compute_f(row, F1MAX, **OPTIONS[name]) for name in (LITERAL, RAISED)}
        what = f"{row.weight:g}"
        searched = (make_title(LITERAL, what), "ga") in ours.runs
        median = float(np.median(list_ends(ours, [what], 1.0))) if searched else None
        values.append({"λ": row.weight, "print": row.f, **gaits, "GA, median": median, "optimum": read_objective(best)})
        variables.append({"λ": row.weight, **_pair(row, best)})
    return [
        tabulate(
            "table3",
            "Table III: f in print, of the printed gaits here, of our runs, all under the paper's f1max",
            values,
        ),
        tabulate("table3-variables", "Table III: variables in print, and IPOPT's [mm]", variables),
    ]


def tabulate_fourth(results: Mapping[str, Results]) -> Table:
    """Return Table IV next to ours in two readings."""
    rows = list[Mapping[str, Value]]()
    for name in (LITERAL, SECOND):
        result = results[name]
        for row, most, best in zip(TABLE_4, result.f1max_over_time, result.optima_over_time, strict=True):
            largest = {"f1max print": row.f1max, "f1max here": most}
            f = {"f print": row.f, "f of the gait": compute_f(row, row.f1max, **OPTIONS[name])}
            steps = {"s print [mm]": 1e3 * row.s, "s here [mm]": 1e3 * get_point(best)[0]}
            rows.append({"reading": name, "T [s]": row.step_time_s, **largest, **f, **steps})
    return tabulate("table4", "Table IV, λ = 0.15; f under the printed f1max, optima under the model's", rows)


def _pair(row: PaperRow, best: RunRecord) -> dict[str, Value]:
    pairs = zip(NAMES, row.x, get_point(best), strict=True)
    return {
        key: 1e3 * x for name, *pair in pairs for key, x in zip((f"{name} print", f"{name} here"), pair, strict=True)
    }


def explain(results: Mapping[str, Results]) -> str:
    """Return what explains the print."""
    met = {name: count_met(results[name]) for name in READINGS}
    f1 = {name: results[name].f1[-1] for name in (LITERAL, RAISED)}
    misses = " / ".join(f"{miss:+.0f}" for miss in measure_f1max(results).values())
    return (
        f"With the ankle {1e3 * walk12_model.ANKLE_HEIGHT_M:g} mm above the ground, a number that "
        f"the paper does not give, {met[RAISED]} of 7 f of Table III are within 1 % ({met[LITERAL]} with the ankle on it), "
        f"and the gait of λ = 1 has f1 = {f1[RAISED]:.1f} instead of {f1[LITERAL]:.1f} 1/(m² s) (printed {F1MAX}). "
        f"The printed {GA.population * PRINTED_STEPS:,} time steps a generation are {GA.population} gaits times "
        f"{PRINTED_STEPS:,} steps of 0.0001 s. That is consistent with an integral over one second for every T, which gives "
        "Table IV its trend, while (9) as printed reverses it. Our largest f1 over one second still differ from the printed ones "
        f"by {misses} % at T = 2 / 1.5 / 0.8 / 0.5 s."
    )


REPRODUCTION = Paper(
    book=BOOK,
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
    headlines=(
        *("f1-last", "optimal", "ranks-3", "short-steps", "margin"),
        *("speed", "speed-order", "accuracy", "accuracy-corrected"),
    ),
    show=show,
)
