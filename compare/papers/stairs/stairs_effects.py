"""Effects of what the stairs paper leaves open, measured along our plans and best tracked steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from compare.papers.claims import Series
from compare.papers.stairs import stairs_planning
from compare.papers.stairs.stairs_paper import ANTS, CHOICES, ITERATIONS, OURS, PLAN_CHOICES, PRINTED, TABLE_4
from compare.papers.stairs.stairs_planning import PLANS, describe_plan, get_choice, measure_hip_speeds, move
from compare.papers.stairs.stairs_runs import DRAWN_CASE, StairsFindings
from compare.papers.stairs.stairs_tracking import get_best, make_choice_spec, measure_spread
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import RIGHT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.planar_biped import JOINT_RATES, MOVING, centres, points, rod, toe_foot_biped

INERTIAS = (0.0, 1.0, 2.0)  # as multiples of those of slender rods
SETBACKS = (0.0, 0.03, 0.09)  # of edges behind the ankle that stands on the step [m]
NOT_COMPUTED = "not computed with this effort"
NAMES = {"jerk": "plan of least jerk", "plan": "plan of least energy"}
LEARNED = ("closed-form cost", "network cost", "largest_angle_error_rad")


def compute_effects(findings: StairsFindings) -> dict[str, Any]:
    """Return numbers for the table of differences, as text; those of plans by plan, in the order of the cases or as above."""
    cases = findings.cases
    arrays = {what: move(findings, what, DRAWN_CASE)[0].arrays for what in PLANS}
    moments = {what: [_change_inertia(arrays[what], share) for share in INERTIAS] for what in PLANS}
    planned = {name or OURS: _describe_plans(findings, name) for name in ("", *PLAN_CHOICES)}
    return {
        "inertia_J": {what: Series(energy for energy, _ in rows) for what, rows in moments.items()},
        "inertia_mm": {what: Series(margin for _, margin in rows) for what, rows in moments.items()},
        "edge_mm": {what: Series(measure_depth(findings, what, DRAWN_CASE, x) for x in SETBACKS) for what in PLANS},
        "zmp_gap_mm": {what: Series(measure_zmp_gap(findings, what, case) for case in cases) for what in PLANS},
        "start_m_s": Series(measure_hip_speeds(findings, "jerk", case)[0] for case in cases),
        "centre_mm": {what: Series(_measure_centre(findings, what, case) for case in cases) for what in PLANS},
        "search_gap": max(measure_spread(findings, name) for name in findings.effort.choices),
        "turn_rad": {name: Series(_measure_turn(findings, case, name) for case in cases) for name in (OURS, PRINTED)},
        "learned": [findings.collect("learned", name) for name in LEARNED],
        "first": [Series(findings.best(what, case).verdict.objective for case in cases) for what in ("first", "free")],
        "colony": {
            solver: Series(findings.best("track", case, solver).verdict.objective for case in cases)
            for solver in findings.track_solvers
        },
        "printed_effort": ANTS * ITERATIONS,
        "planned": planned,
        "tread_between": "".join(f" ({row} between samples)" for row in _list_between(findings, "tread")),
        "plan_effect": {name: _compare_texts(text, planned[OURS]) for name, text in planned.items()},
        "tracked": {name: _describe_step(findings, name) for name in CHOICES},
    }


def _describe_plans(findings: StairsFindings, name: str) -> str:
    if name and name not in findings.effort.plan_choices:
        return NOT_COMPUTED
    found = {what: describe_plan(findings, what, name) for what in stairs_planning.list_choice_plans(name)}
    return ", ".join(
        f"no {NAMES[what]} {text.removeprefix('none ')}" if "(" in text else f"{text} {PLANS[what]}"
        for what, text in found.items()
    )


def _list_between(findings: StairsFindings, name: str) -> list[str]:
    """Return the worst violation of the plan of least jerk under a choice that is feasible at its samples."""
    verdict = get_choice(findings, "jerk", name).verdict if name in findings.effort.plan_choices else None
    return [*verdict.violated[:1]] if verdict is not None and verdict.feasible else []


def _compare_texts(changed: str, ours: str) -> str:
    return f"case {DRAWN_CASE}: {'unchanged' if changed == ours else f'{changed} instead of {ours}'}"


def _describe_step(findings: StairsFindings, name: str) -> str:
    if name not in findings.effort.choices:
        return NOT_COMPUTED
    steps = [get_best(findings, case, name).verdict for case in findings.cases]
    cost, energy = (Series(step.indexes[index] for step in steps) for index in ("controller_cost", "energy_J"))
    return f"mean of (53) {cost}, {energy} J" + ("" if all(step.feasible for step in steps) else ", not feasible")


def _change_inertia(arrays: Mapping[str, Array], share: float) -> tuple[float, float]:
    """Return energy [J] and ZMP margin [mm] of a planned motion with a multiple of the links' inertias.

    The equations of motion are in absolute link angles: an inertia acts on the acceleration of its own link only.
    """
    robot = toe_foot_biped()
    inertias = np.array([robot.link(link).inertia_kgm2 for link in MOVING])
    extra = (share - 1) * inertias * arrays["link_qdd"] @ np.linalg.inv(JOINT_RATES)
    power = np.abs((arrays["tau"] + extra) * arrays["qd"]).sum(axis=1)
    pressure = arrays["stance_pressure"][:, 0] - extra[:, 0] / arrays["stance_force"][:, 1]
    margin = np.minimum(pressure, robot.foot_m - pressure).min()
    return float(np.trapezoid(power, arrays["t"])), 1e3 * float(margin)


def measure_depth(findings: StairsFindings, what: str, case: int, setback: float) -> float:
    """Return how deep ankle, sole or toe of the swing foot are in steps with such edges [mm]."""
    tread, rise = TABLE_4[case].step_m
    signals, legs = move(findings, what, case)
    x, z = np.moveaxis(legs[RIGHT][signals.arrays["t"] > findings.best(what, case).x["t2_s"], 2:5], -1, 0)
    ground = rise * (1.0 * (x >= -setback) + (x >= tread - setback) - 1.0)
    return round(1e3 * float((ground - z).max()), 1) + 0.0


def measure_zmp_gap(findings: StairsFindings, what: str, case: int) -> float:
    """Return the largest distance of the ZMP of (49) from the planned one of (22) [mm]."""
    arrays, x = move(findings, what, case)[0].arrays, findings.best(what, case).x
    share, (tread, _) = arrays["t"] / arrays["t"][-1], TABLE_4[case].step_m
    planned = x["zmp_start_m"] + (tread + x["zmp_end_m"] - x["zmp_start_m"]) * share**2 * (3 - 2 * share)
    return 1e3 * float(np.abs(arrays["zmp"][:, 0] + tread - planned).max())


def _measure_centre(findings: StairsFindings, what: str, case: int) -> float:
    """Return how far the centre of gravity of all links is below the hip at the start of a plan [mm]."""
    angles = move(findings, what, case)[0].arrays["link_q"][0]
    place = points(ca.SX([*angles, 0.0, 0.0]), ca.SX(2, 1))
    moment = sum(rod(link).mass_kg * float(middle[1]) for link, middle in centres(place).items())
    return 1e3 * (float(place["H"][1]) - moment / toe_foot_biped().mass_kg)


def _measure_turn(findings: StairsFindings, case: int, name: str) -> float:
    """Return by how much a link turns at most in a quantum of the best step under a choice [rad]."""
    problem, x = make_choice_spec(findings, case, name).load(), get_best(findings, case, name).x
    rates = problem.signals(np.array(list(x.values()))).arrays["link_qd"]
    return QUANTUM * float(np.abs(rates).max())
