"""Claims of the stairs paper about plans, and the effects of what is not as printed, from our numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from compare.papers.claims import Check, Verdict, compare_changes, compare_levels, decide, require_change
from compare.papers.paper_runs import choose_best
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
from compare.papers.stairs.stairs_runs import DRAWN_CASE, StairsFindings
from compare.study.task import IPOPT
from nlp_gait.gaits.stairs.leg_network import ONLINE
from nlp_gait.gaits.stairs.stair import GRAVITY, SETBACK


def compute_planning_values(findings: StairsFindings) -> dict[str, Any]:
    """Return the effects of choices and of printed equations, for the table of differences."""
    best, arrays = findings.best("jerk", DRAWN_CASE), move(findings, "jerk", DRAWN_CASE)[0].arrays
    swing = arrays["ankle"][arrays["t"] > best.x["t2_s"]]
    landing = [findings.best("landing", case).verdict.objective for case in findings.cases]
    flat = [findings.best("jerk", case).verdict.objective for case in findings.cases]
    return {
        "plan_effect": {name: _describe_effect(findings, name) for name in PLAN_CHOICES},
        "eq": measure_printed_equations(TABLE_4[DRAWN_CASE], swing),
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
        "explicit_quanta": _join(findings.others[f"printed-{case}"]["explicit_quanta"] for case in findings.cases),
        **{
            f"network_{name}": found["converged"]
            for name, found in zip(("adam", "printed"), _networks(findings), strict=True)
        },
        "network_poses": _networks(findings)[0]["poses"],
        "aco": _join(_track_costs(findings, "aco")),
        "aco_grid": _join(_track_costs(findings, "aco-grid")),
        "energy_factor": _join(
            TABLE_4[case].energy / findings.best_track(case).verdict.indexes["energy_J"] for case in findings.cases
        ),
        "ideal_climbs": "; ".join(describe_climb(findings.others[f"climb-ideal-{case}"]) for case in findings.cases),
    }


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


def _compare_time(name: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        ours, other = ([findings.best(what, case).x[name] for case in findings.cases] for what in PLANS)
        return compare_levels(np.full(len(ours), TABLE_3[name]), ours, found=_join(ours), other=_join(other))

    return check


def _get_peaks(findings: StairsFindings, quantity: str, what: str = "jerk") -> dict[int, float]:
    return {case: findings.others[f"differences-{what}-{case}"][quantity] for case in findings.cases}


def _compare_peaks(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        ours, other = (_get_peaks(findings, quantity, what) for what in ("jerk", "plan"))
        printed = [float(getattr(TABLE_4[case], quantity)) for case in findings.cases]
        return compare_levels(printed, list(ours.values()), found=_join(ours.values()), other=_join(other.values()))

    return check


def _require_least_peak(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        ours, other = (_get_peaks(findings, quantity, what) for what in ("jerk", "plan"))
        texts = {"found": _join(ours.values()), "other": _join(other.values())}
        if len(ours) < len(TABLE_4):
            return decide(Verdict.NOT_SHOWN, **texts)
        rest = min(value for case, value in ours.items() if case != DRAWN_CASE)
        return require_change(100 * (rest / ours[DRAWN_CASE] - 1), **texts)

    return check


def _compare_jerk_changes(findings: StairsFindings) -> Check:
    ours = _get_peaks(findings, "jerk")
    ratio = get_choice(findings, "jerk", "ratio").verdict.indexes["peak_jerk_rad_s3"]
    own = get_choice(findings, "jerk", "").verdict.indexes["peak_jerk_rad_s3"]
    texts: dict[str, Any] = {"found": _join(ours.values()), "ratio": ratio, "own": own}
    if len(ours) < len(TABLE_4):
        return decide(Verdict.NOT_SHOWN, **texts, changes="")
    printed = {case: row.jerk for case, row in TABLE_4.items()}
    theirs, changes = ([100 * (peak[b] / peak[a] - 1) for a, b in ((1, 2), (2, 3))] for peak in (printed, ours))
    return compare_changes(theirs, changes, **texts, changes=_join(changes))


def _count_feasible_hips(findings: StairsFindings) -> list[int]:
    return [sum(run.verdict.feasible for run in findings.runs[f"hip-{case}", IPOPT]) for case in findings.cases]


def _describe_worst_hips(findings: StairsFindings) -> str:
    return "; ".join(", ".join(findings.best("hip", case).verdict.violated[:1]) or "nothing" for case in findings.cases)


def _check_hip_height(findings: StairsFindings) -> Check:
    feasible, worst = _count_feasible_hips(findings), _describe_worst_hips(findings)
    best = _join(findings.best("jerk", case).x["hip_height_m"] for case in findings.cases)
    return decide(all(feasible), feasible=_join(feasible), starts=findings.effort.hip_starts, worst=worst, best=best)


def _check_step(what: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        runs = [findings.best(what, case).verdict for case in findings.cases]
        margins = [1e3 * run.indexes["zmp_margin_min_m"] for run in runs]
        return decide(all(run.feasible for run in runs) and min(margins) >= 0, found=_join(margins))

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
    names = ("peak_torque_Nm", "energy_J", "peak_jerk_rad_s3")
    found = {name: [[own[name] for own in step] for step in indexes] for name in names}
    savings = [100 * (1 - one / two) for pair in found.values() for one, two in zip(*pair, strict=True)]
    texts = {name: f"{_join(first)} against {_join(landing)}" for name, (first, landing) in found.items()}
    return require_change(savings, **texts)


def _check_network(findings: StairsFindings) -> Check:
    adam, printed = _networks(findings)
    return decide(printed["converged"] == printed["poses"], adam=adam, printed=printed)


def _check_warm_network(findings: StairsFindings) -> Check:
    iterations = findings.others["network"]["adam"]["iterations"]
    later = float(np.mean(iterations[1:]))
    return require_change(100 * (1 - later / iterations[0]), first=iterations[0], later=later)


def _check_cycloid_end(findings: StairsFindings) -> Check:
    rates = [findings.best("jerk", case).x["end_rate_rad_s"] for case in findings.cases]
    ours = [rate**2 * TABLE_4[case].step_m[1] for rate, case in zip(rates, findings.cases, strict=True)]
    return compare_levels(np.zeros(len(ours) + 1), [GRAVITY, *ours], found=_join(ours), printed_m_s2=GRAVITY)


PLANNING_CHECKS: dict[str, Checker] = {
    **{f"jerk-{name}": _compare_time(name) for name in ("t1_s", "t2_s", "t_bc_s")},
    "hip-height": _check_hip_height,
    **{f"peak-{quantity}": _compare_peaks(quantity) for quantity in ("acceleration", "jerk")},
    **{f"least-{quantity}": _require_least_peak(quantity) for quantity in ("acceleration", "jerk")},
    "jerk-changes": _compare_jerk_changes,
    "first-step": _check_step("first"),
    "reverse-support": _check_step("landing"),
    "collisions": _check_collisions,
    "easier": _check_easier,
    "network": _check_network,
    "warm-network": _check_warm_network,
    "cycloid-end": _check_cycloid_end,
}
