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
        "jerk_by_quanta": _join(_get_peaks(findings, "jerk")),
        "drawn_case": DRAWN_CASE,
        "of": _name_cases(findings),
        "least_ratio": min(row.rise_run_ratio for row in TABLE_4.values()),
        "fixed_hip": _describe_hips(findings),
        "shank_depth": {what: _join(depths) for what, depths in _measure_shanks(findings).items()},
        "online": ONLINE,
        "quanta": {
            name: _join(findings.others[f"printed-{case}"][f"explicit{name}_quanta"] for case in findings.cases)
            for name in ("_printed", "_floating", "_slack", "_free")
        },
        **{
            f"network_{name}": f"{found['converged']} of {found['poses']}"
            for name, found in zip(("adam", "printed"), _networks(findings), strict=True)
        },
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


def _describe_effect(findings: StairsFindings, name: str) -> str:
    if name not in findings.effort.plan_choices:
        return "not computed"
    parts = []
    for what in list_choice_plans(name):
        least = f"least {'jerk' if what == 'jerk' else 'energy'} [{PLANS[what]}]"
        values = [describe_plan(findings, what, choice) for choice in (name, "")]
        parts.append(f"{least} {'unchanged' if values[0] == values[1] else ' instead of '.join(values)}")
    return f"case {DRAWN_CASE}: {', '.join(parts)}"


def _join(values: Iterable[float]) -> str:
    return " / ".join(f"{value:.4g}" for value in values)


def _name_cases(findings: StairsFindings) -> str:
    return f"case{'s' if len(findings.cases) > 1 else ''} {' / '.join(map(str, findings.cases))}"


Checker = Callable[[StairsFindings], Check]
CONTINUOUS = 0.01  # largest jump that counts as none [m, m/s, m/s^2]
DRASTIC = 0.1  # share of the first pose's time
LEAST_POSES = 100  # of the network, for a verdict on its times


def _find_infeasible(findings: StairsFindings, *plans: str, dense: bool = False) -> list[str]:
    return list_infeasible((findings.best(what, case) for what in plans for case in findings.cases), dense=dense)


def _compare_time(time: str) -> Checker:
    """Return the check of a time of Table III, by all cases, and by all choices of the planner."""

    def check(findings: StairsFindings) -> Check:
        ours, other = ([findings.best(what, case).x[time] for case in findings.cases] for what in PLANS)
        names = [name for name in findings.effort.plan_choices if name not in ("times", "ratio")]
        chosen = [get_choice(findings, "jerk", name) for name in names]
        read = [run.x[time] for run in chosen if run.verdict.feasible]
        low, high = min([*ours, *read]), max([*ours, *read])
        texts = {"found": _join(ours), "other": _join(other), "low": low, "high": high}
        check = compare_readings(TABLE_3[time], np.array([[*ours, *read]]).T, **texts)
        return require_feasible(check, _find_infeasible(findings, "jerk"))

    return check


def _check_times(findings: StairsFindings) -> Check:
    runs = {name: get_choice(findings, "jerk", choice) for name, choice in (("fixed", "times"), ("free", ""))}
    peaks = {name: run.verdict.indexes["peak_jerk_rad_s3"] for name, run in runs.items()}
    more = 100 * (peaks["fixed"] / peaks["free"] - 1)
    return require_feasible(compare_levels(0.0, more, **peaks, more=more), list_infeasible(runs.values()))


def _get_peaks(findings: StairsFindings, quantity: str, what: str = "jerk") -> list[float]:
    return [findings.others[f"differences-{what}-{case}"][quantity] for case in findings.cases]


def _measure_peaks(findings: StairsFindings, quantity: str) -> tuple[Array, dict[str, str]]:
    """Return peaks (4, cases) of least jerk and least energy, by quanta and at samples each, and their texts."""
    index, rows = {"acceleration": "peak_acceleration_rad_s2", "jerk": "peak_jerk_rad_s3"}[quantity], []
    for what in PLANS:
        sampled = [findings.best(what, case).verdict.indexes[index] for case in findings.cases]
        rows += [_get_peaks(findings, quantity, what), sampled]
    texts = dict(zip(("found", "sampled", "other", "other_sampled"), map(_join, rows), strict=True))
    worst = [(case, findings.best("jerk", case).verdict.violated[:1]) for case in findings.cases]
    between = "; ".join(f"case {case} {' '.join(row) or 'none'}" for case, row in worst)
    return np.array(rows), {**texts, "between": between}


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
        changes = 100 * (peaks[:, [0, 2]] / peaks[:, [DRAWN_CASE - 1]] - 1)
        return require_feasible(require_change(changes, **texts), _find_infeasible(findings, *PLANS))

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


def _describe_hips(findings: StairsFindings) -> dict[str, str]:
    """Return by case how many starts with the printed height of the hip are feasible, and the worst violation of the best."""
    best = {case: findings.best("hip", case).verdict for case in findings.cases}
    feasible = [sum(run.verdict.feasible for run in findings.runs[f"hip-{case}", IPOPT]) for case in best]
    return {
        "feasible": _join(feasible),
        "worst": "; ".join(", ".join(run.violated[:1]) or "nothing" for run in best.values()),
    }


def _check_hip_height(findings: StairsFindings) -> Check:
    ours = _join(findings.best("jerk", case).x["hip_height_m"] for case in findings.cases)
    held = require_feasible(decide(True), _find_infeasible(findings, "hip", dense=True))
    return replace(held, values={**_describe_hips(findings), "starts": findings.effort.hip_starts, "ours": ours})


def _check_step(what: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        margins = [1e3 * findings.best(what, case).verdict.indexes["zmp_margin_min_m"] for case in findings.cases]
        return require_feasible(
            decide(min(margins) >= 0, found=_join(margins)), _find_infeasible(findings, what, dense=True)
        )

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


def _measure_shanks(findings: StairsFindings) -> dict[str, list[float]]:
    steps = ("jerk", "plan", "first")
    return {what: [measure_shank_depth(findings, what, case) for case in findings.cases] for what in steps}


def _check_collisions(findings: StairsFindings) -> Check:
    depths = _measure_shanks(findings)
    return decide(max(map(max, depths.values())) <= 0, **{what: _join(row) for what, row in depths.items()})


def _check_easier(findings: StairsFindings) -> Check:
    indexes = [[findings.best(what, case).verdict.indexes for case in findings.cases] for what in ("first", "landing")]
    names = ("zmp_margin_min_m", "peak_torque_Nm", "energy_J", "peak_jerk_rad_s3")
    found = {name: [[own[name] for own in step] for step in indexes] for name in names}
    texts = {name: f"{_join(first)} against {_join(landing)}" for name, (first, landing) in found.items()}
    wider = 1e3 * np.diff(found[names[0]][::-1], axis=0)
    return require_feasible(require_change(wider, **texts), _find_infeasible(findings, "first", "landing"))


def _check_adaptation(findings: StairsFindings) -> Check:
    others = [size for size in findings.effort.other_stairs if size[1] < IMPOSSIBLE_RISE_M]
    specs = [make_other_spec(findings.effort, "stairs-plan", *size) for size in others]
    runs = [choose_best(findings.runs[spec.title, IPOPT]) for spec in specs]
    runs += [findings.best("plan", case) for case in findings.cases]
    without = list_infeasible(runs)
    return require_feasible(decide(True, found=len(runs) - len(without), of=len(runs)), without)


def _check_network(findings: StairsFindings) -> Check:
    adam, printed = _networks(findings)
    return decide(printed["converged"] == printed["poses"], adam=adam, printed=printed)


def _compare_poses(held: Callable[[float, float], bool]) -> Checker:
    """Return the check of the first and the median later pose [ms] by every rule."""

    def check(findings: StairsFindings) -> Check:
        network, texts, verdicts = findings.others["network"], [], []
        for rule, found in network.items():
            times = [1e3 * found["time_s"][0], 1e3 * np.median(found["time_s"][1:])]
            steps = found["iterations"][0], np.median(found["iterations"][1:])
            verdicts.append(held(*times))
            texts.append(f"{rule} {times[0]:.3g}, then {times[1]:.3g} ms ({steps[0]}, then {steps[1]:g} iterations)")
        poses = network["adam"]["poses"]
        values = {"found": "; ".join(texts), "poses": poses, "least": LEAST_POSES}
        return decide(verdicts if poses >= LEAST_POSES else Verdict.NOT_SHOWN, **values)

    return check


def _check_continuity(findings: StairsFindings) -> Check:
    """As printed, and by our plans of least jerk."""
    eq = compute_printed(findings)
    ends = _measure_accelerations(findings)
    jumps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    return decide([eq["lift_off_m_s"] <= CONTINUOUS, max(jumps) <= CONTINUOUS], eq=eq, found=_join(jumps))


def _measure_accelerations(findings: StairsFindings) -> Array:
    """Return the swing ankle's acceleration (4, 2, 2) at both ends of all phases in the drawn case, least jerk [m/s^2]."""
    arrays = move(findings, "jerk", DRAWN_CASE)[0].arrays
    t, place = (part.reshape(len(PHASES), -1, *part.shape[1:]) for part in (arrays["t"], arrays["ankle"]))
    inner = np.diff(place, 2, axis=1) / (t[:, 1] - t[:, 0])[:, None, None] ** 2
    return np.stack([2 * inner[:, 0] - inner[:, 1], 2 * inner[:, -1] - inner[:, -2]], axis=1)


def _check_cycloid_begin(findings: StairsFindings) -> Check:
    """At t = 0 by (2) and (3), and where the ankle catches the cycloid."""
    start = 6 * TABLE_3["sole_angle_rad"] / TABLE_3["t1_s"] ** 2 * toe_foot_biped().sole_m
    caught = float(np.linalg.norm(_measure_accelerations(findings)[-1, 0]))
    return compare_levels([0.0, 0.0], [start, caught], start=start, caught=caught)


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
    "first-step": _check_step("first"),
    "reverse-support": _check_step("landing"),
    "collisions": _check_collisions,
    "easier": _check_easier,
    "adapts": _check_adaptation,
    "network": _check_network,
    "warm-network": _compare_poses(lambda first, later: later <= DRASTIC * first),
    "real-time": _compare_poses(lambda _, later: later <= 1e3 * QUANTUM),
    "ratio": lambda _: compare_levels(11 / 7, math.pi / 2, found=math.pi / 2),
    "ratio-name": lambda _: compare_levels(11 / 7, 2 / math.pi, found=2 / math.pi),
    "ratio-best": _check_best_ratio,
}
