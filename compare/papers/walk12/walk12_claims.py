"""Checks of the claims of the 12-joint walk's paper against our numbers, by id in ``walk12_claims.toml``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from compare.papers.claims import Check, Verdict, compare_changes, compare_levels, decide, require_change
from compare.papers.paper_runs import choose_best, get_point, list_objectives
from compare.papers.walk12.walk12_findings import Walk12Findings, compute_hip_miss, compute_stable_share
from compare.papers.walk12.walk12_paper import F1_CHANGES, F1MAX, TABLE_3, TABLE_4, PaperRow, find_row
from compare.papers.walk12.walk12_runs import GA, HORIZONS, PAPER, compute_f1, find_f1max, title_table_4
from compare.papers.walk12.walk12_walks import DRIVES, ROBOT_STEP_S, STEP_TIMES_S, WalkedGait
from compare.study.task import IPOPT
from nlp_gait.gaits.walk12.point_mass_biped import load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_problem import PRINTED_STEPS
from nlp_gait.gaits.walk12.walk12_steps import compute_steps

STATIC_WEIGHT = 0.2  # the paper: dynamic walking below
CONVERGED_EPOCH = 15
CONVERGED = 1e-3  # relative gain after that epoch
DIGIT_M, DIGIT_F = 5e-4, 5e-4  # half the last printed digit
CIRCLE_M = 1e-3
NO_ENGINE = "the simulator is not installed (extra sim)"


def _check_most_stable(findings: Walk12Findings) -> Check:
    *others, last = findings.f1_of_table_3
    shares = ", ".join(f"{stable.share:.3f}" for stable in findings.stable)
    return require_change(100 * (last / max(others) - 1), f1=last, next=max(others), shares=shares)


def _check_short_steps(findings: Walk12Findings) -> Check:
    f1, s = [1 / point.Q_m2s for point in findings.front], [point.at for point in findings.front]
    falls = all(after < before for before, after in pairwise(f1))
    return require_change(100 * (f1[0] / f1[-1] - 1) if falls else -math.inf, ends=(f1[0], f1[-1]), s=(s[0], s[-1]))


def _check_f_of_table_3(findings: Walk12Findings) -> Check:
    ours = findings.f_of_printed_gaits(PAPER)
    changes = [100 * (f1 / row.implied_f1 - 1) for row, f1 in zip(TABLE_3, findings.f1_of_table_3, strict=True)]
    return compare_levels([row.f for row in TABLE_3], ours, low=min(changes), high=max(changes))


def _check_optimal(findings: Walk12Findings) -> Check:
    best = _list_optima(findings)
    gaps = [100 * (1 - f / b) for f, b in zip(findings.f_of_printed_gaits(PAPER), best, strict=True)]
    return compare_levels(best, findings.f_of_printed_gaits(PAPER), low=min(gaps), high=max(gaps))


def _list_optima(findings: Walk12Findings) -> list[float]:
    return list_objectives(findings.optimum(PAPER, row.weight) for row in TABLE_3)


def _list_steps(findings: Walk12Findings) -> list[float]:
    """Step length of the optima of Table III [mm]."""
    return [1e3 * get_point(findings.optimum(PAPER, row.weight))[0] for row in TABLE_3]


def _check_slower(findings: Walk12Findings) -> Check:
    printed, ours = [1e3 * row.x[0] for row in TABLE_3], _list_steps(findings)
    changes = printed[-1] - printed[0], ours[-1] - ours[0]
    return compare_changes(*changes, change=changes[0], found=changes[1])


def _check_fastest(findings: Walk12Findings) -> Check:
    first, *others = sorted(findings.weighted, key=lambda point: point.at)
    longest = max(point.step_length_m for point in others)
    tie = max(point.at for point in findings.weighted if point.step_length_m > first.step_length_m - DIGIT_M)
    lead = 1e3 * (first.step_length_m - longest)
    return require_change(round(lead, 3), s=1e3 * first.step_length_m, weight=first.at, others=1e3 * longest, tie=tie)


def _check_motor_mass(_: Walk12Findings) -> Check:
    robot = load_point_mass_biped()
    mass = 2 * (robot.knee_mass_kg + robot.foot_mass_kg + robot.hip_mass_kg) + robot.waist_mass_kg
    return compare_levels(0.07, mass / 12, mass=mass, each=mass / 12)


def _check_steps(findings: Walk12Findings) -> Check:
    ours = _list_steps(findings)
    return compare_levels([1e3 * row.x[0] for row in TABLE_3], ours, found=", ".join(f"{s:.0f}" for s in ours))


def _check_margin(findings: Walk12Findings) -> Check:
    f1 = [(findings.optimum(PAPER, row.weight).verdict.dense or {})["f1_per_m2s"] for row in TABLE_3]
    falls = any(after < (1 - 1e-3) * before for before, after in pairwise(f1))
    return require_change(-math.inf if falls else 100 * (f1[-1] / f1[0] - 1), found=", ".join(f"{v:.0f}" for v in f1))


def _check_margin_of_table_3(findings: Walk12Findings) -> Check:
    f1 = findings.f1_of_table_3
    changes = [100 * (after / before - 1) for before, after in pairwise(f1)]
    return require_change(changes, found=", ".join(f"{value:.0f}" for value in f1), low=min(changes))


def _check_margin_by_duration(findings: Walk12Findings) -> Check:
    shares = [stable.share for stable in findings.stable]
    optima = [compute_stable_share(tuple(get_point(findings.optimum(PAPER, row.weight)))).share for row in TABLE_3]
    texts = [", ".join(f"{1 - share:.3f}" for share in values) for values in (shares, optima)]
    return require_change(np.diff(shares), printed=texts[0], optima=texts[1])


def _check_static(findings: Walk12Findings) -> Check:
    best = compute_stable_share(tuple(get_point(findings.optimum(PAPER, 1.0))))
    return compare_levels(1.0, findings.stable[-1].share, stable=findings.stable[-1], optimum=best.share)


def _check_static_above(findings: Walk12Findings) -> Check:
    shares = [stable.share for row, stable in zip(TABLE_3, findings.stable, strict=True) if row.weight >= STATIC_WEIGHT]
    return compare_levels(np.ones(len(shares)), shares, low=min(shares), high=max(shares))


def _check_dynamic(findings: Walk12Findings) -> Check:
    shares = [stable.share for row, stable in zip(TABLE_3, findings.stable, strict=True) if row.weight < STATIC_WEIGHT]
    every = [stable.share for stable in findings.stable]
    return require_change(
        [1 - share for share in shares], low=min(shares), high=max(shares), all=(min(every), max(every))
    )


def _check_speed(weight: float, printed_m_s: float, share: float) -> Check:
    """Check a speed of this share of the step length in a step."""
    s = find_row(weight).x[0]
    return compare_levels(
        printed_m_s, share * s, s=s, ours=share * s, slow=share * s / ROBOT_STEP_S, implied=s / printed_m_s
    )


def _check_faster(findings: Walk12Findings) -> Check:
    table = 1e3 * (find_row(0.1).x[0] - find_row(0.15).x[0])
    optima = _list_steps(findings)
    return compare_changes(128.0 - 125.0, table, optima=optima[0] - optima[1], table=table)


def _check_table_4_f1max(findings: Walk12Findings, horizon: str) -> Check:
    f1max = [_get_f1max(findings, row, horizon) for row in TABLE_4]
    return compare_levels([row.f1max for row in TABLE_4], f1max, found=", ".join(f"{value:.0f}" for value in f1max))


def _get_f1max(findings: Walk12Findings, row: PaperRow, horizon: str) -> float:
    return find_f1max(findings.runs, title_table_4(row, horizon, most_stable=True))  # type: ignore[arg-type]


def _check_trend(findings: Walk12Findings, horizon: str) -> Check:
    slow, fast = TABLE_4[0], TABLE_4[-1]
    ours = 100 * (_get_f1max(findings, slow, horizon) / _get_f1max(findings, fast, horizon) - 1)
    return compare_changes(
        100 * (slow.f1max / fast.f1max - 1), ours, slow=slow.step_time_s, fast=fast.step_time_s, found=ours
    )


def _list_table_4(findings: Walk12Findings, horizon: str) -> list[tuple[float, list[float]]]:
    best = [choose_best(findings.runs[title_table_4(row, horizon), IPOPT]) for row in TABLE_4]  # type: ignore[arg-type]
    return [(record.verdict.objective, get_point(record)) for record in best]


def _check_f_over_time(findings: Walk12Findings) -> Check:
    printed = [row.f for row in TABLE_4]
    f = {horizon: [f for f, _ in _list_table_4(findings, horizon)] for horizon in HORIZONS}
    texts = {name: ", ".join(f"{value:.4f}" for value in values) for name, values in f.items()}
    spreads = [100 * (max(values) / min(values) - 1) for values in (f["step"], f["1s"], printed)]
    return compare_levels(0.0, spreads[0], step=texts["step"], second=texts["1s"], spreads=spreads)


def _check_variables_over_time(findings: Walk12Findings, horizon: str) -> Check:
    rows = [TABLE_3[1].x, *(row.x for row in TABLE_4)]
    optima = [get_point(findings.optimum(PAPER, 0.15)), *(x for _, x in _list_table_4(findings, horizon))]
    printed, ours = (1e3 * np.ptp(np.array(values), axis=0) for values in (rows, optima))
    texts = [", ".join(f"{value:.0f}" for value in values) for values in (printed, ours)]
    return compare_levels(printed, ours, ranges=texts[0], found=texts[1])


def _check_f1_over_time(horizon: str) -> Check:
    f1 = [compute_f1(row, horizon=horizon) for row in TABLE_4]
    return require_change([100 * (a / b - 1) for a, b in pairwise(f1)], found=", ".join(f"{v:.0f}" for v in f1))


def _check_variables(findings: Walk12Findings) -> Check:
    printed = 1e3 * np.array([row.x[1:] for row in TABLE_3])
    ours = 1e3 * np.array([get_point(findings.optimum(PAPER, row.weight))[1:] for row in TABLE_3])
    ranges = [
        f"{name} {low:.1f} to {high:.1f}"
        for name, low, high in zip("nHh", ours.min(axis=0), ours.max(axis=0), strict=True)
    ]
    return compare_levels(printed, ours, found=", ".join(ranges))


def _check_fitness(findings: Walk12Findings) -> Check:
    f = list_objectives(findings.records(PAPER, 0.15, "ga"))
    return compare_levels(find_row(0.15).f, float(np.median(f)), median=float(np.median(f)), best=max(f))


def _check_epochs(findings: Walk12Findings) -> Check:
    histories = [run.history for run in findings.records(PAPER, 0.15, "ga")]
    gains = [
        1 - float(np.array(h.objective, dtype=float)[np.searchsorted(h.evaluations, GA.population * (1 + CONVERGED_EPOCH))])
        / float(h.objective[-1] or math.nan)
        for h in histories
    ]  # fmt: skip
    return decide(float(np.median(gains)) < CONVERGED, gain=100 * float(np.median(gains)), worst=100 * max(gains))


def count_upright(walks: Sequence[WalkedGait], drives: str, by: str = "") -> str:
    """Return how many walks from perturbed starts do not fall, as words, at each step time; of all gaits, or one kind."""
    parts = []
    for time in STEP_TIMES_S:
        chosen = [w for w in walks if (w.drives, w.step_time_s) == (drives, time) and by in ("", w.by)]
        parts.append(f"{sum(w.upright for w in chosen)} of {sum(w.starts for w in chosen)} at {time:g} s")
    return " and ".join(parts)


def _check_walks(findings: Walk12Findings, step_time_s: float) -> Check:
    walks = [walk for walk in findings.walks if walk.step_time_s == step_time_s]
    same = [row.weight for row in TABLE_3 if row.weight < 0.9]
    gaits = np.array([get_point(findings.optimum(PAPER, weight)) for weight in same])
    texts = []
    for drives in DRIVES:
        driven = [walk for walk in walks if walk.drives == drives]
        equal = [walk.fell_at_s is None for walk in driven if walk.by == IPOPT.upper() and walk.weight in same]
        counts = (f"{_describe_walks([w for w in driven if w.by == by])} by {by}" for by in ("paper", "IPOPT"))
        texts.append(f"drives {drives!r}: {', '.join(counts)}; of the equal optima {sum(equal)} of {len(equal)}")
    apart = float(np.ptp(gaits, axis=0).max())
    return decide(Verdict.UNTESTABLE, found="; ".join(texts) if walks else NO_ENGINE, apart=apart)


def _describe_walks(walks: Sequence[WalkedGait]) -> str:
    upright, starts = sum(walk.upright for walk in walks), sum(walk.starts for walk in walks)
    walked = sum(walk.fell_at_s is None for walk in walks)
    return f"{walked} of {len(walks)} gaits and {upright} of {starts} perturbed starts"


def _check_same_fate(findings: Walk12Findings) -> Check:
    found = count_upright(findings.walks, "printed", "paper")
    return decide(Verdict.UNTESTABLE, found=found if findings.walks else NO_ENGINE)


def _check_below(findings: Walk12Findings) -> Check:
    below = get_point(choose_best(findings.runs["below", IPOPT]))
    apart = 1e3 * max(abs(a - b) for a, b in zip(below, get_point(findings.optimum(PAPER, 0.1)), strict=True))
    return decide(Verdict.UNTESTABLE, apart=apart)


def _check_ends(findings: Walk12Findings) -> Check:
    *inner, last = _list_optima(findings)
    return decide(max(inner) <= max(1.0, last), inner=max(inner), last=last)


def _check_accuracy(zmp: str) -> Check:
    free, ours = ([compute_f1(row, zmp=reading) for row in TABLE_3] for reading in ("moment-free", zmp))
    changes = [100 * (f1 / exact - 1) for f1, exact in zip(ours, free, strict=True)]
    return compare_levels(free, ours, low=min(changes), high=max(changes))


def _check_circle(findings: Walk12Findings) -> Check:
    turn, x = math.radians(8.0), np.array(get_point(findings.optimum(PAPER, 0.9)))
    arrays = compute_steps(load_point_mass_biped(), x, steps=90, intervals=2, turn_rad=turn).arrays
    prints = np.unique(np.round(arrays["left_ankle"][arrays["left_stance"] == 1.0][:, :2], 7), axis=0)
    radii = np.linalg.norm(prints - prints.mean(axis=0), axis=1)
    return decide(
        float(np.ptp(radii)) < CIRCLE_M, radius=radii.mean(), spread=1e3 * float(np.ptp(radii)), prints=len(prints)
    )


CHECKS: dict[str, Callable[[Walk12Findings], Check]] = {
    "most-stable": _check_most_stable,
    "short-steps": _check_short_steps,
    "ends": _check_ends,
    "circle": _check_circle,
    "f1max": lambda findings: compare_levels(F1MAX, findings.own_f1max, own=findings.own_f1max),
    "f": _check_f_of_table_3,
    "optimal": _check_optimal,
    "steps": _check_steps,
    "fastest": _check_fastest,
    "motor-mass": _check_motor_mass,
    "moments": lambda _: compare_levels(
        np.zeros(2), F1_CHANGES["rods"], rods=F1_CHANGES["rods"], spheres=F1_CHANGES["spheres"]
    ),
    "time-steps": lambda _: compare_levels(
        300_000, GA.population * PRINTED_STEPS, steps=PRINTED_STEPS, population=GA.population
    ),
    "variables": _check_variables,
    "fitness": _check_fitness,
    "inverse-kinematics": lambda _: compare_levels(0.0, 1e3 * compute_hip_miss(), miss=1e3 * compute_hip_miss()),
    "slower": _check_slower,
    "below": _check_below,
    "walks": lambda findings: _check_walks(findings, 1.0),
    "walks-slowly": lambda findings: _check_walks(findings, ROBOT_STEP_S),
    "dynamic": _check_dynamic,
    "static-above": _check_static_above,
    "epochs": _check_epochs,
    "speed-0.1": lambda _: _check_speed(0.1, 0.128, 0.5),
    "speed-0.1-foot": lambda _: _check_speed(0.1, 0.128, 1.0),
    "speed-0.15": lambda _: _check_speed(0.15, 0.125, 0.5),
    "speed-0.15-foot": lambda _: _check_speed(0.15, 0.125, 1.0),
    "margin": _check_margin,
    "margin-printed": _check_margin_of_table_3,
    "margin-duration": _check_margin_by_duration,
    "margin-0.1": lambda findings: require_change(
        100 * (findings.f1_of_table_3[1] / findings.f1_of_table_3[0] - 1),
        f1=findings.f1_of_table_3[:2],
        shares=[stable.share for stable in findings.stable[:2]],
    ),
    "static": _check_static,
    "speed-1": lambda _: _check_speed(1.0, 0.05, 0.5),
    "speed-1-foot": lambda _: _check_speed(1.0, 0.05, 1.0),
    "faster": _check_faster,
    "trend": lambda findings: _check_trend(findings, "step"),
    "trend-1s": lambda findings: _check_trend(findings, "1s"),
    "f1-over-time": lambda _: _check_f1_over_time("step"),
    "f1-over-time-1s": lambda _: _check_f1_over_time("1s"),
    "f1max-over-time": lambda findings: _check_table_4_f1max(findings, "step"),
    "f1max-over-time-1s": lambda findings: _check_table_4_f1max(findings, "1s"),
    "f-over-time": _check_f_over_time,
    "variables-over-time": lambda findings: _check_variables_over_time(findings, "step"),
    "variables-over-time-1s": lambda findings: _check_variables_over_time(findings, "1s"),
    "same-fate": _check_same_fate,
    "accuracy": lambda _: _check_accuracy("exact"),
    "accuracy-a1": lambda _: _check_accuracy("appendix-as-printed"),
}
