"""Claims of the stairs paper about plans, and the effects of what is not as printed, from our numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from compare.papers.claims import (
    Check,
    Verdict,
    compare_levels,
    compare_readings,
    decide,
    require_change,
    require_feasible,
    unite_readings,
)
from compare.papers.paper_runs import choose_best, list_infeasible
from compare.papers.stairs.stairs_choices import PLAN_CHOICES
from compare.papers.stairs.stairs_paper import TABLE_3, TABLE_4
from compare.papers.stairs.stairs_planning import (
    PLANS,
    describe_climb,
    describe_plan,
    get_choice,
    list_choice_plans,
    move,
)
from compare.papers.stairs.stairs_printed import measure_printed_equations
from compare.papers.stairs.stairs_runs import DRAWN_CASE, IMPOSSIBLE_RISE_M, StairsFindings, make_other_spec
from compare.study.task import IPOPT
from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.leg_network import ONLINE
from nlp_gait.gaits.stairs.planned_motion import PHASES
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import GRAVITY, SETBACK


def compute_planning_values(findings: StairsFindings) -> dict[str, Any]:
    """Return the effects of choices and of printed equations, for the table of differences."""
    landing = [findings.best("landing", case).verdict.objective for case in findings.cases]
    flat = [findings.best("jerk", case).verdict.objective for case in findings.cases]
    return {
        "plan_effect": {name: _describe_effect(findings, name) for name in PLAN_CHOICES},
        "eq": compute_printed(findings),
        "landing_jerk": _join(landing),
        "flat_jerk": _join(flat),
        "jerk_by_quanta": _join(_get_peaks(findings, "jerk").values()),
        "drawn_case": DRAWN_CASE,
        "of": _name_cases(findings),
        "least_ratio": min(row.rise_run_ratio for row in TABLE_4.values()),
        "fixed_hip": _join(_count_feasible_hips(findings)),
        "fixed_hip_worst": _describe_worst_hips(findings),
        "shank_depth": _measure_shank_depths(findings),
        "instants": {
            **{
                how: _join(findings.others[f"instants-ours-{how}-{case}"]["cost"] for case in findings.cases)
                for how in ("gains", "torques")
            },
            "ours": _join(
                choose_best(findings.runs[f"track-{case}-ours", "aco"]).verdict.indexes["controller_cost"]
                for case in findings.cases
            ),
        },
        "online": ONLINE,
        "quanta": {
            name: _join(findings.others[f"printed-{case}"][f"explicit{name}_quanta"] for case in findings.cases)
            for name in ("_printed", "_floating", "_slack", "_free")
        },
        **{
            f"network_{name}": f"{found['converged']} of {found['poses']}"
            for name, found in zip(("adam", "printed"), _networks(findings), strict=True)
        },
        "aco": _join(_track_costs(findings, "aco")),
        "aco_grid": _join(_track_costs(findings, "aco-grid")),
        "energy_factor": _join(
            TABLE_4[case].energy / findings.best_track(case).verdict.indexes["energy_J"] for case in findings.cases
        ),
        "ideal_climbs": "; ".join(describe_climb(findings.others[f"climb-ideal-{case}"]) for case in findings.cases),
    }


def compute_printed(findings: StairsFindings) -> dict[str, float]:
    """Return by how much the printed equations miss in the drawn case."""
    best, arrays = findings.best("jerk", DRAWN_CASE), move(findings, "jerk", DRAWN_CASE)[0].arrays
    return measure_printed_equations(TABLE_4[DRAWN_CASE], arrays["ankle"][arrays["t"] > best.x["t2_s"]])


def _networks(findings: StairsFindings) -> list[Mapping[str, Any]]:
    """Return what the network learned by Adam, and as printed."""
    network = findings.others["network"]
    return [network["adam"], next(found for rule, found in network.items() if "printed" in rule)]


def _track_costs(findings: StairsFindings, solver: str) -> list[float]:
    return [findings.best("track", case, solver).verdict.objective for case in findings.cases]


def _describe_effect(findings: StairsFindings, name: str) -> str:
    if name not in findings.effort.plan_choices:
        return "not computed"
    parts = []
    for what in list_choice_plans(name):
        least = f"least {'jerk' if what == 'jerk' else 'energy'} [{PLANS[what]}]"
        values = (describe_plan(findings, what, choice) for choice in (name, ""))
        parts.append(f"{least} {' instead of '.join(values)}")
    return f"case {DRAWN_CASE}: {', '.join(parts)}"


def _join(values: Iterable[float]) -> str:
    return " / ".join(f"{value:.4g}" for value in values)


def _name_cases(findings: StairsFindings) -> str:
    return f"case{'s' if len(findings.cases) > 1 else ''} {' / '.join(map(str, findings.cases))}"


Checker = Callable[[StairsFindings], Check]
CONTINUOUS = 0.01  # largest jump that counts as none [m, m/s, m/s^2]
DRASTIC = 0.1  # share of the first pose's time
LEAST_POSES = 100  # of the network, for a verdict on its times


def _find_infeasible(findings: StairsFindings, *plans: str) -> list[str]:
    """Return for each plan and case without a feasible result the constraint that the best one violates most."""
    names = {"jerk": "least jerk", "plan": "least energy", "first": "first step", "landing": "next step"}
    return list_infeasible(
        {f"{names[what]} {case}": findings.best(what, case) for what in plans for case in findings.cases}
    )


def _compare_time(name: str) -> Checker:
    """Return the check of a time of Table III, by all cases, and by all choices of the planner."""

    def check(findings: StairsFindings) -> Check:
        ours, other = ([findings.best(what, case).x[name] for case in findings.cases] for what in PLANS)
        chosen = [get_choice(findings, "jerk", choice) for choice in findings.effort.plan_choices if choice != "times"]
        read = [run.x[name] for run in chosen if run.verdict.feasible]
        low, high = min([*ours, *read]), max([*ours, *read])
        texts = {"found": _join(ours), "other": _join(other), "low": low, "high": high}
        check = compare_readings(TABLE_3[name], np.array([[*ours, *read]]).T, **texts)
        return require_feasible(check, _find_infeasible(findings, "jerk"))

    return check


def _check_times(findings: StairsFindings) -> Check:
    runs = {name: get_choice(findings, "jerk", choice) for name, choice in (("fixed", "times"), ("free", ""))}
    peaks = {name: run.verdict.indexes["peak_jerk_rad_s3"] for name, run in runs.items()}
    more = 100 * (peaks["fixed"] / peaks["free"] - 1)
    return require_feasible(compare_levels(0.0, more, **peaks, more=more), list_infeasible(runs))


def _get_peaks(findings: StairsFindings, quantity: str, what: str = "jerk") -> dict[int, float]:
    return {case: findings.others[f"differences-{what}-{case}"][quantity] for case in findings.cases}


def _measure_peaks(findings: StairsFindings, quantity: str) -> tuple[Array, dict[str, str]]:
    """Return peaks (4, cases) of least jerk and least energy, by quanta and at samples each, and their texts."""
    index = {"acceleration": "peak_acceleration_rad_s2", "jerk": "peak_jerk_rad_s3"}[quantity]
    rows, between = [], []
    for what in PLANS:
        best = {case: findings.best(what, case).verdict for case in findings.cases}
        rows += [[*_get_peaks(findings, quantity, what).values()], [run.indexes[index] for run in best.values()]]
        between += [
            f"{what}, case {case}: {', '.join(run.violated[:1])}"
            for case, run in best.items()
            if not run.dense_feasible
        ]
    names = ("found", "sampled", "other", "other_sampled")
    return np.array(rows), {
        **dict(zip(names, map(_join, rows), strict=True)),
        "between": "; ".join(between) or "nothing",
    }


def _compare_peaks(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        peaks, texts = _measure_peaks(findings, quantity)
        printed = [float(getattr(TABLE_4[case], quantity)) for case in findings.cases]
        return require_feasible(compare_readings(printed, peaks[:2], **texts), _find_infeasible(findings, "jerk"))

    return check


def _require_least_peak(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        peaks, texts = _measure_peaks(findings, quantity)
        if peaks.shape[1] < len(TABLE_4):
            return decide(Verdict.NOT_SHOWN, **texts)
        rest = peaks[:, [case != DRAWN_CASE for case in findings.cases]].min(axis=1, keepdims=True)
        own = peaks[:, [case == DRAWN_CASE for case in findings.cases]]
        return require_feasible(require_change(100 * (rest / own - 1), **texts), _find_infeasible(findings, *PLANS))

    return check


def _compare_jerk_changes(findings: StairsFindings) -> Check:
    peaks, texts = _measure_peaks(findings, "jerk")
    ratio, own = (get_choice(findings, "jerk", name).verdict.indexes["peak_jerk_rad_s3"] for name in ("ratio", ""))
    values: dict[str, Any] = {**texts, "ratio": ratio, "own": own}
    if peaks.shape[1] < len(TABLE_4):
        return decide(Verdict.NOT_SHOWN, **values, changes="one case only")
    printed = np.array([row.jerk for row in TABLE_4.values()])
    theirs, changes = (100 * (row[..., 1:] / row[..., :-1] - 1) for row in (printed, peaks[:2]))
    check = compare_readings(theirs, changes, **values, changes="; ".join(map(_join, changes)))
    return require_feasible(check, _find_infeasible(findings, "jerk"))


def _count_feasible_hips(findings: StairsFindings) -> list[int]:
    return [sum(run.verdict.feasible for run in findings.runs[f"hip-{case}", IPOPT]) for case in findings.cases]


def _describe_worst_hips(findings: StairsFindings) -> str:
    return "; ".join(", ".join(findings.best("hip", case).verdict.violated[:1]) or "nothing" for case in findings.cases)


def _check_hip_height(findings: StairsFindings) -> Check:
    feasible, worst = _count_feasible_hips(findings), _describe_worst_hips(findings)
    best = _join(findings.best("jerk", case).x["hip_height_m"] for case in findings.cases)
    verdict = Verdict.HOLDS if all(feasible) else Verdict.NOT_SHOWN
    return decide(verdict, feasible=_join(feasible), starts=findings.effort.hip_starts, worst=worst, best=best)


def _check_step(what: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        margins = [1e3 * findings.best(what, case).verdict.indexes["zmp_margin_min_m"] for case in findings.cases]
        return require_feasible(decide(min(margins) >= 0, found=_join(margins)), _find_infeasible(findings, what))

    return check


def measure_shank_depth(findings: StairsFindings, what: str, case: int) -> float:
    """Return how far the shanks of a plan are below an edge of the stairs [mm]; negative if they are all above."""
    (tread, rise), depth = TABLE_4[case].step_m, -np.inf
    _, legs = move(findings, what, case)
    edges = [(tread - SETBACK, rise), (-SETBACK, 0.0)] if what != "first" else [(tread - SETBACK, rise)]
    for points in legs.values():
        (x0, z0), (x1, z1) = (points[:, i].T for i in (2, 1))  # ankle and knee
        for x, z in edges:
            share = (x - x0) / np.where(np.abs(x1 - x0) > 1e-9, x1 - x0, np.inf)
            below = z - (z0 + share * (z1 - z0))
            depth = max(depth, float(np.max(np.where((share > 0) & (share < 1), below, -np.inf))))
    return 1e3 * depth


def _measure_shank_depths(findings: StairsFindings) -> dict[str, str]:
    return {
        what: _join(measure_shank_depth(findings, what, case) for case in findings.cases)
        for what in ("jerk", "plan", "first")
    }


def _check_collisions(findings: StairsFindings) -> Check:
    depths = [
        measure_shank_depth(findings, what, case) for what in ("jerk", "plan", "first") for case in findings.cases
    ]
    return decide(max(depths) <= 0, **_measure_shank_depths(findings))


def _check_easier(findings: StairsFindings) -> Check:
    indexes = [[findings.best(what, case).verdict.indexes for case in findings.cases] for what in ("first", "landing")]
    names = ("zmp_margin_min_m", "peak_torque_Nm", "energy_J", "peak_jerk_rad_s3")
    found = {name: [[own[name] for own in step] for step in indexes] for name in names}
    texts = {name: f"{_join(first)} against {_join(landing)}" for name, (first, landing) in found.items()}
    wider = 1e3 * np.diff(found[names[0]][::-1], axis=0)
    return require_feasible(require_change(wider, **texts), _find_infeasible(findings, "first", "landing"))


def _check_adaptation(findings: StairsFindings) -> Check:
    stairs = {f"case {case}": findings.best("plan", case) for case in findings.cases}
    for tread, rise in findings.effort.other_stairs:
        if rise < IMPOSSIBLE_RISE_M:
            title = make_other_spec(findings.effort, "stairs-plan", tread, rise).title
            stairs[f"{tread:g} m by {rise:g} m"] = choose_best(findings.runs[title, IPOPT])
    without = list_infeasible(stairs)
    return require_feasible(decide(True, found=len(stairs) - len(without), of=len(stairs)), without)


def _check_network(findings: StairsFindings) -> Check:
    adam, printed = _networks(findings)
    return decide(printed["converged"] == printed["poses"], adam=adam, printed=printed)


def _compare_poses(held: Callable[[float, float], bool]) -> Checker:
    """Return the check of the first and the median later pose [s] by every rule, of which the last is the printed one."""

    def check(findings: StairsFindings) -> Check:
        network = findings.others["network"]
        times = {rule: (found["time_s"][0], float(np.median(found["time_s"][1:]))) for rule, found in network.items()}
        texts = "; ".join(
            f"{rule}, {found['poses']} poses: {1e3 * first:.3g}, then {1e3 * later:.3g} ms "
            f"({found['iterations'][0]}, then {np.median(found['iterations'][1:]):g} iterations)"
            for (rule, found), (first, later) in zip(network.items(), times.values(), strict=True)
        )
        if _networks(findings)[0]["poses"] < LEAST_POSES:
            return decide(Verdict.NOT_SHOWN, found=texts, least=LEAST_POSES)
        verdicts = [held(*time) for time in times.values()]
        return Check(lambda _: unite_readings(verdicts), {"found": texts, "least": LEAST_POSES})

    return check


def _check_continuity(findings: StairsFindings) -> Check:
    eq = compute_printed(findings)
    return decide(max(eq["lift_off_m_s"], eq["bridge_mm"] / 1e3) <= CONTINUOUS, eq=eq)


def _check_smoothness(findings: StairsFindings) -> Check:
    eq = compute_printed(findings)
    jumps = [np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1) for ends in _measure_accelerations(findings)]
    smooth = [eq["lift_off_m_s"] <= CONTINUOUS, max(map(max, jumps)) <= CONTINUOUS]
    return Check(lambda _: unite_readings(smooth), {"eq": eq, "found": "; ".join(map(_join, jumps))})


def _measure_accelerations(findings: StairsFindings) -> list[Array]:
    """Return in each case the swing ankle's acceleration (4, 2, 2) at both ends of all phases of least jerk [m/s^2]."""
    found = []
    for case in findings.cases:
        arrays = move(findings, "jerk", case)[0].arrays
        t, place = (part.reshape(len(PHASES), -1, *part.shape[1:]) for part in (arrays["t"], arrays["ankle"]))
        quanta = (t[:, 1] - t[:, 0])[:, None, None]
        inner = np.diff(place, 2, axis=1) / quanta**2
        found.append(np.stack([2 * inner[:, 0] - inner[:, 1], 2 * inner[:, -1] - inner[:, -2]], axis=1))
    return found


def _check_cycloid_begin(findings: StairsFindings) -> Check:
    """At t = 0 by (2) and (3), and where the ankle catches the cycloid."""
    start = 6 * TABLE_3["sole_angle_rad"] / TABLE_3["t1_s"] ** 2 * toe_foot_biped().sole_m
    caught = [float(np.linalg.norm(ends[-1, 0])) for ends in _measure_accelerations(findings)]
    return compare_levels(np.zeros(len(caught) + 1), [start, *caught], start=start, found=_join(caught))


def _check_cycloid_end(findings: StairsFindings) -> Check:
    rates = [findings.best("jerk", case).x["end_rate_rad_s"] for case in findings.cases]
    ours = [rate**2 * TABLE_4[case].step_m[1] for rate, case in zip(rates, findings.cases, strict=True)]
    return compare_levels(np.zeros(len(ours) + 1), [GRAVITY, *ours], found=_join(ours), printed_m_s2=GRAVITY)


def _check_jerk_terms(_: StairsFindings) -> Check:
    """Shares of the jerk terms in (31) and (32), of the acceleration terms, with the maxima of Table IV."""
    speeds, places = (
        [100 * row.jerk * QUANTUM / (part * row.acceleration) for row in TABLE_4.values()] for part in (2, 3)
    )
    return compare_levels(np.zeros(6), [*speeds, *places], speeds=_join(speeds), places=_join(places))


def _check_best_ratio(_: StairsFindings) -> Check:
    ratios = {case: 1 / row.rise_run_ratio for case, row in TABLE_4.items()}
    nearest = min(ratios, key=lambda case: abs(ratios[case] - math.pi / 2))
    return decide(nearest == DRAWN_CASE, found=_join(ratios.values()), nearest=nearest)


PLANNING_CHECKS: dict[str, Checker] = {
    **{f"jerk-{name}": _compare_time(name) for name in ("t1_s", "t2_s", "t_bc_s")},
    "jerk-times": _check_times,
    "knot-shifting": lambda findings: replace(_check_times(findings), verdict=Verdict.UNTESTABLE),
    "hip-height": _check_hip_height,
    **{f"peak-{quantity}": _compare_peaks(quantity) for quantity in ("acceleration", "jerk")},
    **{f"least-{quantity}": _require_least_peak(quantity) for quantity in ("acceleration", "jerk")},
    "jerk-changes": _compare_jerk_changes,
    "jerk-terms": _check_jerk_terms,
    "cycloid-begin": _check_cycloid_begin,
    "cycloid-end": _check_cycloid_end,
    "continuity": _check_continuity,
    "smooth": _check_smoothness,
    "first-step": _check_step("first"),
    "reverse-support": _check_step("landing"),
    "collisions": _check_collisions,
    "easier": _check_easier,
    "adapts": _check_adaptation,
    "network": _check_network,
    "warm-network": _compare_poses(lambda first, later: later <= DRASTIC * first),
    "real-time": _compare_poses(lambda _, later: later <= QUANTUM),
    "ratio": lambda _: compare_levels(11 / 7, math.pi / 2, found=math.pi / 2),
    "ratio-name": lambda _: compare_levels(11 / 7, 2 / math.pi, found=2 / math.pi),
    "ratio-best": _check_best_ratio,
}
