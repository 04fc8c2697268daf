"""Claims of the stairs paper about plans, and the effects of what is not as printed, from our numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from compare.papers.claims import (
    Check,
    Series,
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
    """Return numbers of plans, and the effects of choices and of printed equations, for claims and differences."""
    return {
        "plans": {what: _collect(findings, what) for what in ("jerk", "plan", "first", "landing")},
        "by_quanta": {what: {name: _get_peaks(findings, name, what) for name in PEAKS} for what in PLANS},
        "between": "; ".join([*findings.best("jerk", case).verdict.violated, "none"][0] for case in findings.cases),
        "plan_effect": {name: _describe_effect(findings, name) for name in PLAN_CHOICES},
        "eq": compute_printed(findings),
        "drawn_case": DRAWN_CASE,
        "of": _name_cases(findings),
        "least_ratio": min(row.rise_run_ratio for row in TABLE_4.values()),
        "fixed_hip": _describe_hips(findings),
        "shank_depth": _measure_shanks(findings),
        "online": ONLINE,
        **{
            f"network_{name}": f"{found['converged']} of {found['poses']} (knee bent the other way in {found['bent_otherwise']})"
            for name, found in zip(("adam", "printed"), _networks(findings), strict=True)
        },
        "energy_factor": Series(
            TABLE_4[case].energy / findings.best_track(case).verdict.indexes["energy_J"] for case in findings.cases
        ),
        "ideal_climbs": "; ".join(describe_climb(findings.others[f"climb-ideal-{case}"]) for case in findings.cases),
    }


def _collect(findings: StairsFindings, what: str) -> dict[str, Series]:
    """Return variables and indexes of the best plans of all cases."""
    best = [{**run.x, **run.verdict.indexes} for run in (findings.best(what, case) for case in findings.cases)]
    return {name: Series(one[name] for one in best) for name in best[0]}


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


def _name_cases(findings: StairsFindings) -> str:
    return f"case{'s' if len(findings.cases) > 1 else ''} {' / '.join(map(str, findings.cases))}"


Checker = Callable[[StairsFindings], Check]
PEAKS = {"acceleration": "peak_acceleration_rad_s2", "jerk": "peak_jerk_rad_s3"}  # in Table IV, and in our plans
CONTINUOUS = 0.01  # largest jump that counts as none [m/s, m/s^2]
DRASTIC = 0.1  # share of the first pose's time
LEAST_POSES = 100  # of the network, for a verdict on its times


def _require_plans(findings: StairsFindings, check: Check, *plans: str, dense: bool = False) -> Check:
    runs = (findings.best(what, case) for what in plans for case in findings.cases)
    return require_feasible(check, list_infeasible(runs, dense=dense))


def _compare_time(time: str) -> Checker:
    """Return the check of a time of Table III, by all cases, and by all choices of the planner."""

    def check(findings: StairsFindings) -> Check:
        ours, other = (_collect(findings, what)[time] for what in PLANS)
        names = [name for name in findings.effort.plan_choices if name not in ("times", "ratio")]
        chosen = [get_choice(findings, "jerk", name) for name in names]
        read = [*ours, *(run.x[time] for run in chosen if run.verdict.feasible)]
        texts = {"found": ours, "other": other, "low": min(read), "high": max(read)}
        return _require_plans(findings, compare_readings(TABLE_3[time], np.array([read]).T, **texts), "jerk")

    return check


def _check_times(findings: StairsFindings) -> Check:
    runs = {name: get_choice(findings, "jerk", choice) for name, choice in (("fixed", "times"), ("free", ""))}
    peaks = {name: run.verdict.indexes["peak_jerk_rad_s3"] for name, run in runs.items()}
    more = 100 * (peaks["fixed"] / peaks["free"] - 1)
    return require_feasible(compare_levels(0.0, more, **peaks, more=more), list_infeasible(runs.values()))


def _get_peaks(findings: StairsFindings, quantity: str, what: str) -> Series:
    return Series(findings.others[f"differences-{what}-{case}"][quantity] for case in findings.cases)


def _measure_peaks(findings: StairsFindings, quantity: str) -> Array:
    """Return peaks (4, cases) of least jerk and least energy, by quanta and at samples each."""
    sampled = [_collect(findings, what)[PEAKS[quantity]] for what in PLANS]
    quanta = [_get_peaks(findings, quantity, what) for what in PLANS]
    return np.array([quanta[0], sampled[0], quanta[1], sampled[1]])


def _compare_peaks(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        printed = [float(getattr(TABLE_4[case], quantity)) for case in findings.cases]
        return _require_plans(findings, compare_readings(printed, _measure_peaks(findings, quantity)[:2]), "jerk")

    return check


def _require_least_peak(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        peaks = _measure_peaks(findings, quantity)
        if peaks.shape[1] < len(TABLE_4):
            return decide(Verdict.NOT_SHOWN)
        changes = 100 * (peaks[:, [0, 2]] / peaks[:, [DRAWN_CASE - 1]] - 1)
        return _require_plans(findings, require_change(changes), *PLANS)

    return check


def _compare_jerk_changes(findings: StairsFindings) -> Check:
    peaks = _measure_peaks(findings, "jerk")[:2]
    if peaks.shape[1] < len(TABLE_4):
        return decide(Verdict.NOT_SHOWN, changes="one case only")
    printed = np.array([row.jerk for row in TABLE_4.values()])
    theirs, changes = (100 * (row[..., 1:] / row[..., :-1] - 1) for row in (printed, peaks))
    return _require_plans(findings, compare_readings(theirs, changes, changes=Series(changes.ravel())), "jerk")


def _describe_hips(findings: StairsFindings) -> dict[str, str | Series]:
    """Return by case how many starts with the printed height of the hip are feasible, and the worst violation of the best."""
    best = {case: findings.best("hip", case).verdict for case in findings.cases}
    feasible = Series(sum(run.verdict.feasible for run in findings.runs[f"hip-{case}", IPOPT]) for case in best)
    return {"feasible": feasible, "worst": "; ".join([*run.violated, "nothing"][0] for run in best.values())}


def _check_step(what: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        runs = [findings.best(what, case) for case in findings.cases]
        margins = [(run.verdict.dense or run.verdict.indexes)["zmp_margin_min_m"] for run in runs]
        between = "; ".join(list_infeasible(runs, dense=True)) or "nothing"
        return _require_plans(findings, decide(min(margins) >= 0, between=between), what)

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


def _measure_shanks(findings: StairsFindings) -> dict[str, Series]:
    steps = ("jerk", "plan", "first")
    return {what: Series(measure_shank_depth(findings, what, case) for case in findings.cases) for what in steps}


def _check_easier(findings: StairsFindings) -> Check:
    first, following = (_collect(findings, what) for what in ("first", "landing"))
    signs = {"zmp_margin_min_m": 1, "peak_torque_Nm": -1, "energy_J": -1, "peak_jerk_rad_s3": -1}
    changes = [100 * sign * (np.divide(first[name], following[name]) - 1) for name, sign in signs.items()]
    return _require_plans(findings, require_change(changes), "first", "landing")


def _check_adaptation(findings: StairsFindings) -> Check:
    others = [size for size in findings.effort.other_stairs if size[1] < IMPOSSIBLE_RISE_M]
    specs = [make_other_spec(findings.effort, "stairs-plan", *size) for size in others]
    runs = [choose_best(findings.runs[spec.title, IPOPT]) for spec in specs]
    runs += [findings.best("plan", case) for case in findings.cases]
    without = list_infeasible(runs)
    return require_feasible(decide(True, found=len(runs) - len(without), of=len(runs)), without)


def _check_network(findings: StairsFindings) -> Check:
    printed = _networks(findings)[1]
    return decide(printed["converged"] == printed["poses"])


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
    return decide([eq["lift_off_m_s"] <= CONTINUOUS, max(jumps) <= CONTINUOUS], found=Series(jumps))


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
    rates = _collect(findings, "jerk")["end_rate_rad_s"]
    ours = Series(rate**2 * TABLE_4[case].step_m[1] for rate, case in zip(rates, findings.cases, strict=True))
    return compare_levels(np.zeros(len(ours) + 1), [GRAVITY, *ours], found=ours, printed_m_s2=GRAVITY)


def _check_jerk_terms(_: StairsFindings) -> Check:
    """Shares of the jerk terms in (31) and (32), of the acceleration terms, with the maxima of Table IV."""
    ratios = [100 * row.jerk * QUANTUM / row.acceleration for row in TABLE_4.values()]
    speeds, places = (Series(ratio / part for ratio in ratios) for part in (2, 3))
    return compare_levels(np.zeros(6), [*speeds, *places], speeds=speeds, places=places)


def _check_best_ratio(_: StairsFindings) -> Check:
    ratios = Series(1 / row.rise_run_ratio for row in TABLE_4.values())
    nearest = 1 + int(np.abs(np.subtract(ratios, math.pi / 2)).argmin())
    return decide(nearest == DRAWN_CASE, found=ratios, nearest=nearest)


PLANNING_CHECKS: dict[str, Checker] = {
    **{f"jerk-{name}": _compare_time(name) for name in ("t1_s", "t2_s", "t_bc_s")},
    "jerk-times": _check_times,
    "hip-height": lambda findings: _require_plans(findings, decide(True), "hip", dense=True),
    **{f"peak-{quantity}": _compare_peaks(quantity) for quantity in ("acceleration", "jerk")},
    **{f"least-{quantity}": _require_least_peak(quantity) for quantity in ("acceleration", "jerk")},
    "jerk-changes": _compare_jerk_changes,
    "jerk-terms": _check_jerk_terms,
    "cycloid-begin": _check_cycloid_begin,
    "cycloid-end": _check_cycloid_end,
    "continuity": _check_continuity,
    "first-step": _check_step("first"),
    "reverse-support": _check_step("landing"),
    "collisions": lambda findings: decide(max(map(max, _measure_shanks(findings).values())) <= 0),
    "easier": _check_easier,
    "adapts": _check_adaptation,
    "network": _check_network,
    "warm-network": _compare_poses(lambda first, later: later <= DRASTIC * first),
    "real-time": _compare_poses(lambda _, later: later <= 1e3 * QUANTUM),
    "ratio": lambda _: compare_levels(11 / 7, math.pi / 2, found=math.pi / 2),
    "ratio-name": lambda _: compare_levels(11 / 7, 2 / math.pi, found=2 / math.pi),
    "ratio-best": _check_best_ratio,
}
