"""Claims of the stairs paper about plans, and the effects of what it leaves open or is not as printed, from our numbers."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.papers import claims
from compare.papers.claims import Check, ClaimVerdict, Series, compare_levels, decide, require_change
from compare.papers.paper_runs import choose_best, get_point, list_infeasible
from compare.papers.stairs import stairs_paper, stairs_planning, stairs_runs
from compare.papers.stairs.stairs_paper import OURS, TABLE_3, TABLE_4, measure_printed_equations, measure_slide
from compare.papers.stairs.stairs_planning import PLANS, measure_hip_speeds, move
from compare.papers.stairs.stairs_runs import CLOSED_FORM, DRAWN_CASE, KINDS, RULES, StairsFindings, make_plan_spec
from compare.papers.stairs.stairs_tracking import measure_spread
from compare.study.task import IPOPT
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import RIGHT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.leg_network import ONLINE
from nlp_gait.gaits.stairs.plan import SAMPLING_RESERVE
from nlp_gait.gaits.stairs.planar_biped import (
    GRAVITY,
    get_rod,
    load_toe_foot_biped,
)
from nlp_gait.gaits.stairs.planned_motion import PHASES
from nlp_gait.gaits.stairs.stair import SETBACK

NOT_COMPUTED = "not computed with this effort"
NAMES = {"jerk": "plan of least jerk", "plan": "plan of least energy"}
LEARNED = ("closed-form cost", "network cost", "largest_angle_error_rad")


def compute_planning_values(findings: StairsFindings) -> dict[str, Any]:
    """Return numbers of plans, and the effects of choices and of printed equations, for claims and differences."""
    return {
        "plans": {what: _collect(findings, what) for what in ("jerk", "plan", "first", "landing")},
        "peaks": {what: {name: _describe_peaks(findings, name, what) for name in PEAKS} for what in PLANS},
        "by_quanta": {what: _get_peaks(findings, "jerk", what, KINDS[0]) for what in PLANS},
        "times": {name: _describe_times(findings, name) for name in ("t1_s", "t2_s", "t_bc_s")},
        "between": "; ".join([*findings.best("jerk", case).verdict.violated, "none"][0] for case in findings.cases),
        "eq": _compute_printed(findings),
        "drawn_case": DRAWN_CASE,
        "of": f"case{'s' if len(findings.cases) > 1 else ''} {' / '.join(map(str, findings.cases))}",
        "least_ratio": min(row.rise_run_ratio for row in TABLE_4.values()),
        "slides": Series(filter(None, (measure_slide(*size) for size in findings.effort.other_stairs))),
        "reserve_mm": 1e3 * SAMPLING_RESERVE * (len(PHASES) / findings.effort.plan_intervals) ** 2,
        "fixed_hip": _describe_hips(findings),
        "shank_depth": _measure_shanks(findings),
        "online": ONLINE,
        **{
            f"network_{name}": f"{found['converged']} of {found['poses']} (knee bent the other way in {found['bent_otherwise']})"
            for name, found in zip(("adam", "printed", "centimetres", "loop"), _get_networks(findings), strict=True)
        },
        "energy_factor": Series(
            TABLE_4[case].energy / findings.best_track(case).verdict.indexes["energy_J"] for case in findings.cases
        ),
        "ideal_climbs": "; ".join(
            stairs_planning.describe_climb(findings.others[f"climb-ideal-{case}"]) for case in findings.cases
        ),
    }


def _collect(findings: StairsFindings, what: str) -> dict[str, Series]:
    best = [{**run.x, **run.verdict.indexes} for run in (findings.best(what, case) for case in findings.cases)]
    return {name: Series(one[name] for one in best) for name in best[0]}


def _compute_printed(findings: StairsFindings) -> dict[str, float]:
    best, arrays = findings.best("jerk", DRAWN_CASE), move(findings, "jerk", DRAWN_CASE)[0].arrays
    return measure_printed_equations(TABLE_4[DRAWN_CASE], arrays["ankle"][arrays["t"] > best.x["t2_s"]])


def _get_networks(findings: StairsFindings) -> list[Mapping[str, Any]]:
    """Return what the network learned by Adam, as printed in m and in cm, and at the rate in the loop."""
    network = findings.others["network"]
    printed = [found for rule, found in network.items() if "printed" in rule]
    return [network["adam"], *printed, network[f"gradient {ONLINE.rate:g}"]]


def compute_effects(findings: StairsFindings) -> dict[str, Any]:
    """Return numbers for the table of differences, as text; those of plans by plan, in the order of the cases or as above."""
    cases = findings.cases
    planned = {name or OURS: _describe_plans(findings, name) for name in ("", *stairs_paper.PLAN_CHOICES)}
    ours = planned[OURS]
    changed = {name: "unchanged" if text == ours else f"{text} instead of {ours}" for name, text in planned.items()}
    return {
        "zmp_gap_mm": {what: Series(measure_zmp_gap(findings, what, case) for case in cases) for what in PLANS},
        "start_m_s": Series(measure_hip_speeds(findings, "jerk", case)[0] for case in cases),
        "search_gap": max(measure_spread(findings, name) for name in findings.effort.choices),
        "learned": [findings.collect("learned", name) for name in LEARNED],
        "first": [Series(findings.best(what, case).verdict.objective for case in cases) for what in ("first", "free")],
        "colony": {
            solver: Series(findings.best("track", case, solver).verdict.objective for case in cases)
            for solver in findings.track_solvers
        },
        "printed_effort": stairs_paper.ANTS * stairs_paper.ITERATIONS,
        "planned": planned,
        "plan_effect": {name: f"case {DRAWN_CASE}: {text}" for name, text in changed.items()},
    }


def _describe_plans(findings: StairsFindings, name: str) -> str:
    if name and name not in findings.effort.plan_choices:
        return NOT_COMPUTED
    found = {what: stairs_planning.describe_plan(findings, what, name) for what in PLANS}
    return ", ".join(
        f"no {NAMES[what]} {text.removeprefix('none ')}" if "(" in text else f"{text} {PLANS[what]}"
        for what, text in found.items()
    )


def measure_depth(findings: StairsFindings, what: str, case: int) -> float:
    """Return how deep ankle, sole or toe of the swing foot are in the steps [mm]."""
    tread, rise = TABLE_4[case].step_m
    signals, legs = move(findings, what, case)
    x, z = np.moveaxis(legs[RIGHT][signals.arrays["t"] > findings.best(what, case).x["t2_s"], 2:5], -1, 0)
    ground = rise * (1.0 * (x >= -SETBACK) + (x >= tread - SETBACK) - 1.0)
    return round(1e3 * float((ground - z).max()), 1) + 0.0


def measure_zmp_gap(findings: StairsFindings, what: str, case: int) -> float:
    """Return the largest distance of the ZMP of (49) from the planned one of (22) [mm]."""
    arrays = move(findings, what, case)[0].arrays
    x = findings.best(what, case).x
    share, (tread, _) = arrays["t"] / arrays["t"][-1], TABLE_4[case].step_m
    planned = x["zmp_start_m"] + (tread + x["zmp_end_m"] - x["zmp_start_m"]) * share**2 * (3 - 2 * share)
    return 1e3 * float(np.abs(arrays["zmp"][:, 0] + tread - planned).max())


PEAKS = {"acceleration": "peak_acceleration_rad_s2", "jerk": "peak_jerk_rad_s3"}  # in Table IV, and in our plans
CONTINUOUS = 0.01  # largest jump that counts as none [m/s, m/s^2]
STEPS = ("first", "landing")  # of a climb
LEAST_POSES = 100  # of the network, for a verdict on its times


def _require_plans(findings: StairsFindings, check: Check, *plans: str, dense: bool = False) -> Check:
    runs = (findings.best(what, case) for what in plans for case in findings.cases)
    return claims.require_feasible(check, list_infeasible(runs, dense=dense))


def _describe_times(findings: StairsFindings, time: str) -> str:
    """Return a time of Table III in all cases and by all choices of the planner."""
    ours, other = (_collect(findings, what)[time] for what in PLANS)
    names = [name for name in findings.effort.plan_choices if name not in ("times", "ratio")]
    chosen = [choose_best(findings.runs[f"jerk-{DRAWN_CASE}-{name}", IPOPT]) for name in names]
    read = [*ours, *(run.x[time] for run in chosen if run.verdict.feasible)]
    return f"{ours} s; with other choices {min(read):.2f} to {max(read):.2f} s; in the plan of least energy {other} s"


def _get_peaks(findings: StairsFindings, quantity: str, what: str, kind: str) -> Series:
    return Series(findings.others[f"differences-{what}-{case}"][kind][quantity] for case in findings.cases)


def _measure_peaks(findings: StairsFindings, quantity: str, what: str) -> dict[str, Series]:
    """Return the peaks of a plan in all cases by how they may be measured, since the paper does not say."""
    ankle = [_measure_ankle(findings, what, case)[quantity] for case in findings.cases]
    return {
        "by quanta": _get_peaks(findings, quantity, what, KINDS[0]),
        "at its samples": _collect(findings, what)[PEAKS[quantity]],
        "by quanta of the network's angles": _get_peaks(findings, quantity, what, KINDS[1]),
        "of the swing ankle, in the printed unit": Series(ankle),
    }


def _describe_peaks(findings: StairsFindings, quantity: str, what: str) -> str:
    return ", ".join(f"{row} {how}" for how, row in _measure_peaks(findings, quantity, what).items())


def _measure_ankle(findings: StairsFindings, what: str, case: int) -> dict[str, float]:
    """Return the largest acceleration [m/s^2] and jerk [m/s^3] of the swing ankle; a jump between phases takes a quantum."""
    inner, ends, steps = _differentiate_ankle(findings, what, case)
    jerk = np.diff(inner, axis=1) / steps[:, None, None]
    largest = [np.linalg.norm(part, axis=-1).max() for part in (ends, jerk, (ends[1:, 0] - ends[:-1, 1]) / QUANTUM)]
    return {"acceleration": float(largest[0]), "jerk": float(max(largest[1:]))}


def _check_hip_height(findings: StairsFindings) -> Check:
    return _require_plans(findings, decide(True), "hip", dense=True)


def _check_peaks(findings: StairsFindings, quantity: str) -> Check:
    printed = [float(getattr(TABLE_4[case], quantity)) for case in findings.cases]
    ours = [*_measure_peaks(findings, quantity, "jerk").values()]
    return _require_plans(findings, claims.compare_readings(printed, ours), "jerk")


def _check_least_peak(findings: StairsFindings, quantity: str) -> Check:
    peaks = np.array([row for what in PLANS for row in _measure_peaks(findings, quantity, what).values()])
    if peaks.shape[1] < len(TABLE_4):
        return decide(ClaimVerdict.NOT_SHOWN)
    changes = 100 * (peaks[:, [0, 2]] / peaks[:, [DRAWN_CASE - 1]] - 1)
    return _require_plans(findings, require_change(changes), *PLANS)


def _check_jerk_changes(findings: StairsFindings) -> Check:
    peaks = np.array([*_measure_peaks(findings, "jerk", "jerk").values()])
    changes = ", ".join(f"{Series(100 * (row[1:] / row[:-1] - 1)):+.0f}" for row in peaks)
    return decide(ClaimVerdict.UNTESTABLE, changes=changes)


def _describe_hips(findings: StairsFindings) -> dict[str, str | Series]:
    """Return by case how many starts with the printed height of the hip are feasible, and the worst violation of the best."""
    best = {case: findings.best("hip", case).verdict for case in findings.cases}
    feasible = Series(sum(run.verdict.feasible for run in findings.runs[f"hip-{case}", IPOPT]) for case in best)
    return {"feasible": feasible, "worst": "; ".join([*run.violated, "nothing"][0] for run in best.values())}


def _check_step(findings: StairsFindings, what: str) -> Check:
    runs = [findings.best(what, case) for case in findings.cases]
    margins = [(run.verdict.dense or run.verdict.indexes)["zmp_margin_min_m"] for run in runs]
    between = "; ".join(list_infeasible(runs, dense=True)) or "nothing"
    return _require_plans(findings, decide(min(margins) >= 0, between=between), what, dense=True)


def measure_shank_depth(findings: StairsFindings, what: str, case: int) -> float:
    """Return how far the shanks of a plan are below an edge of the stairs [mm]; negative if they are all above."""
    (tread, rise), depth = TABLE_4[case].step_m, -np.inf
    _, legs = move(findings, what, case)
    edges = [(tread - SETBACK, rise), (-SETBACK, 0.0)] if what != "first" else [(tread - SETBACK, rise)]
    for leg in legs.values():
        (x0, z0), (x1, z1) = (leg[:, i].T for i in (2, 1))  # ankle and knee
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


def _check_collisions(findings: StairsFindings) -> Check:
    feet = {what: Series(measure_depth(findings, what, case) for case in findings.cases) for what in PLANS}
    rows = [*feet.values(), *_measure_shanks(findings).values()]
    return decide([max(row) <= 0 for row in rows], feet=feet)


def _check_adaptation(findings: StairsFindings) -> Check:
    effort = findings.effort
    sizes = [*(TABLE_4[case].step_m for case in findings.cases), *effort.other_stairs]
    specs = [stairs_runs.make_other_spec(effort, *size) for size in effort.other_stairs]
    runs = [findings.best("plan", case) for case in findings.cases]
    runs += [choose_best(findings.runs[spec.title, IPOPT]) for spec in specs]
    tuned = [run.verdict.feasible for run in runs]
    problems = [make_plan_spec(effort, case) for case in findings.cases] + specs
    x = get_point(findings.best("plan", DRAWN_CASE))
    kept = [evaluate(spec.load(), x).feasible for spec in problems]
    slides = [measure_slide(*size) for size in sizes]
    common = [size[1] < stairs_runs.IMPOSSIBLE_RISE_M for size in sizes]
    values = {"tuned": sum(tuned), "kept": sum(kept), "of": len(sizes), "slides": Series(filter(None, slides))}
    values |= {"failed": "; ".join(list_infeasible(runs)) or "none", "impossible": stairs_runs.IMPOSSIBLE_RISE_M}
    return decide([not any(slides), bool(np.all(np.array(tuned)[common])), all(kept)], **values)


def _check_climb(findings: StairsFindings) -> Check:
    first, after = (np.array([measure_hip_speeds(findings, what, case) for case in findings.cases]) for what in STEPS)
    jumps = np.abs([first[:, 1] - after[:, 0], after[:, 1] - after[:, 0]])
    texts = {"first": Series(first[:, 1]), "start": Series(after[:, 0]), "end": Series(after[:, 1])}
    return decide(jumps.max() <= CONTINUOUS or ClaimVerdict.UNTESTABLE, **texts)


def _check_network(findings: StairsFindings) -> Check:
    return decide([found["converged"] == found["poses"] for found in _get_networks(findings)[1:3]])


def _check_other_methods(findings: StairsFindings) -> Check:
    network = findings.others["network"]
    medians = {rule: 1e3 * float(np.median(found["time_s"][1:])) for rule, found in network.items()}
    closed = medians.pop(CLOSED_FORM)
    error = network[CLOSED_FORM]["largest_angle_error_rad"]
    texts = "; ".join(f"{rule} {value:.3g}" for rule, value in medians.items())
    counts = {"bent": network["adam"]["bent_otherwise"], "poses": network["adam"]["poses"]}
    return decide([v < closed for v in medians.values()], closed=closed, medians=texts, error=error, **counts)


def _check_poses(findings: StairsFindings, share_of_first: float = math.inf, limit_ms: float = math.inf) -> Check:
    network, texts, verdicts = findings.others["network"], [], []
    for rule in RULES:
        found = network[rule]
        times_ms = 1e3 * np.array(network[rule]["time_s"])
        first, later = times_ms[0], np.median(times_ms[1:])
        steps = f"{found['iterations'][0]}, {np.median(found['iterations'][1:]):g} iterations"
        verdicts.append(bool(later <= min(share_of_first * first, limit_ms)))
        texts.append(f"{rule} {first:.3g}, then {later:.3g} ms ({steps}; {found['poses']} poses)")
    enough = network["adam"]["poses"] >= LEAST_POSES
    return decide(verdicts if enough else ClaimVerdict.NOT_SHOWN, found="; ".join(texts), least=LEAST_POSES)


def _check_continuity(findings: StairsFindings) -> Check:
    eq = _compute_printed(findings)
    ends = _differentiate_ankle(findings, "jerk", DRAWN_CASE)[1]
    jumps = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    return decide([eq["lift_off_m_s"] <= CONTINUOUS, max(jumps) <= CONTINUOUS], found=Series(jumps))


def _differentiate_ankle(findings: StairsFindings, what: str, case: int) -> tuple[Array, Array, Array]:
    """Return accelerations of the swing ankle in phases (4, m, 2) and at their ends (4, 2, 2) [m/s^2], and time steps (4,)."""
    arrays = move(findings, what, case)[0].arrays
    t, place = (part.reshape(len(PHASES), -1, *part.shape[1:]) for part in (arrays["t"], arrays["ankle"]))
    steps = t[:, 1] - t[:, 0]
    inner = np.diff(place, 2, axis=1) / steps[:, None, None] ** 2
    return inner, np.stack([2 * inner[:, 0] - inner[:, 1], 2 * inner[:, -1] - inner[:, -2]], axis=1), steps


def _check_cycloid_begin(findings: StairsFindings) -> Check:
    start = 6 * TABLE_3["sole_angle_rad"] / TABLE_3["t1_s"] ** 2 * load_toe_foot_biped().sole_m
    caught = float(np.linalg.norm(_differentiate_ankle(findings, "jerk", DRAWN_CASE)[1][-1, 0]))
    return compare_levels([0.0, 0.0], [start, caught], start=start, caught=caught)


def _check_cycloid_end(findings: StairsFindings) -> Check:
    rates = _collect(findings, "jerk")["end_rate_rad_s"]
    ours = Series(rate**2 * TABLE_4[case].step_m[1] for rate, case in zip(rates, findings.cases, strict=True))
    return compare_levels(np.zeros(len(ours) + 1), [GRAVITY, *ours], found=ours, printed_m_s2=GRAVITY)


def _check_jerk_terms(_: StairsFindings) -> Check:
    ratios = [100 * row.jerk * QUANTUM / row.acceleration for row in TABLE_4.values()]
    speeds, places = (Series(ratio / part for ratio in ratios) for part in (2, 3))
    return decide(ClaimVerdict.UNTESTABLE, speeds=speeds, places=places)


def _check_torso_mass(_: StairsFindings) -> Check:
    torso, total = get_rod("UH").mass_kg, load_toe_foot_biped().mass_kg
    return decide(torso > total / 2, torso=torso, total=total, share=100 * torso / total)


def _check_ratio(_: StairsFindings, exponent: int) -> Check:
    """Check run over rise of half a cycloid, or rise over run for an exponent of -1."""
    ratio = (math.pi / 2) ** exponent
    return compare_levels(11 / 7, ratio, found=ratio)
