"""Checks of the claims of the 12-joint walk's paper: ``walk12_claims.toml`` names them with their arguments."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, pairwise, product

import numpy as np

from compare.papers import claims
from compare.papers.claims import Check, ClaimVerdict, compare_changes, compare_levels, decide, require_change
from compare.papers.paper_runs import compute_range, get_point, list_objectives
from compare.papers.walk12 import walk12_findings, walk12_runs
from compare.papers.walk12.walk12_findings import Walk12Findings, compute_stable_share, follow, list_rounded
from compare.papers.walk12.walk12_paper import CHANGES, F1MAX, F2MAX, SHARES, TABLE_3, TABLE_4, find_row
from compare.papers.walk12.walk12_runs import GA, HORIZONS, PAPER, compute_f, compute_f1, title_table_3, title_table_4
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.walk12_model import Zmp, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_problem import PRINTED_STEPS, Horizon

CONVERGED_EPOCH = 15
CONVERGED = 1e-3  # relative gain after that epoch
DIGIT_M, DIGIT_F = 5e-4, 5e-4  # half the last printed digit
CIRCLE_M = 1e-3


def _check_most_stable(findings: Walk12Findings) -> Check:
    *others, last = findings.f1_by()
    shares = ", ".join(f"{stable.share:.3f}" for stable in findings.stable)
    return require_change(100 * (last / max(others) - 1), f1=last, next=max(others), shares=shares)


def _check_short_steps(findings: Walk12Findings) -> Check:
    f1, s = [1 / point.Q_m2s for point in findings.front], [point.at for point in findings.front]
    falls = all(after < before for before, after in pairwise(f1))
    return require_change(100 * (f1[0] / f1[-1] - 1) if falls else -math.inf, ends=(f1[0], f1[-1]), s=(s[0], s[-1]))


def _check_f(findings: Walk12Findings, zmp: Zmp) -> Check:
    f1 = findings.f1_by(zmp)
    changes = [100 * (value / row.implied_f1 - 1) for row, value in zip(TABLE_3, f1, strict=True)]
    ours = findings.f_of_printed_gaits(PAPER, zmp)
    return compare_levels([row.f for row in TABLE_3], ours, low=min(changes), high=max(changes))


def _check_f1max(findings: Walk12Findings, zmp: Zmp = "exact", solver: str = IPOPT) -> Check:
    f = [findings.list_optima(zmp)[-1]] if solver == IPOPT else list_objectives(findings.records(PAPER, 1.0, solver))
    ours, ends = F1MAX * float(np.median(f)), [F1MAX * end for end in compute_range(f)]
    is_among = "is" if ends[0] <= F1MAX <= ends[1] else "is not"
    return compare_levels(F1MAX, ours, own=ours, ends=ends, share=100 * (F1MAX / ours - 1), is_among=is_among)


def _check_fitness(findings: Walk12Findings) -> Check:
    f = [list_objectives(findings.records(PAPER, row.weight, "ga")) for row in TABLE_3]
    printed, medians = [row.f for row in TABLE_3], [float(np.median(runs)) for runs in f]
    inside = sum(min(runs) <= row.f <= max(runs) for row, runs in zip(TABLE_3, f, strict=True))
    shares = ", ".join(f"{100 * (ours / row - 1):+.1f}" for ours, row in zip(medians, printed, strict=True))
    texts = {"medians": ", ".join(f"{ours:.4f}" for ours in medians), "shares": shares}
    return compare_levels(printed, medians, inside=inside, **texts)


def _check_stability_term(findings: Walk12Findings) -> Check:
    row = find_row(0.15)
    rest = (1 - row.weight) / F2MAX
    ends = findings.records(PAPER, row.weight, "ga")
    ours = float(np.median([run.verdict.objective - rest * get_point(run)[0] for run in ends]))
    printed = row.f - rest * row.x[0]
    return compare_levels(printed, ours, printed=printed, ours=ours, share=100 * (ours / printed - 1))


def _check_optimal(findings: Walk12Findings, zmp: Zmp) -> Check:
    best, printed = findings.list_optima(zmp), findings.f_of_printed_gaits(PAPER, zmp)
    gaps = [100 * (1 - f / b) for f, b in zip(printed, best, strict=True)]
    return compare_levels(best, printed, low=min(gaps), high=max(gaps))


def _check_optimal_by_print(_: Walk12Findings) -> Check:
    """Check by the printed numbers and (11) alone whether a printed gait is better than the one of another lambda.

    f of a gait at another lambda is linear in its printed f and s, so the effect of their rounding is known; s is within (7).
    """
    better = []
    for at, row in product(TABLE_3, repeat=2):
        of_f = at.weight / row.weight
        of_s = ((1 - at.weight) - (1 - row.weight) * of_f) / F2MAX
        f = of_f * row.f + of_s * row.x[0]
        lengths = (row.x[0] - DIGIT_M, min(row.x[0] + DIGIT_M, F2MAX))
        if of_f * (row.f - DIGIT_F) + min(of_s * s for s in lengths) > at.f + DIGIT_F:
            better.append(f"at λ = {at.weight:g} that of {row.weight:g} has {f:.3f} (printed {at.f:.3f})")
    return decide(not better, found="; ".join(better) or "none is")


def list_x(findings: Walk12Findings, solver: str = IPOPT, horizon: Horizon | None = None) -> Array:
    """Return the gaits of Table III (7, 4), or of Table IV (4, 4) with a horizon of Q [mm]: IPOPT's optima or the median runs."""
    titles = [title_table_3(PAPER, row.weight) for row in TABLE_3]
    if horizon:
        titles = [title_table_4(row, horizon) for row in TABLE_4]
    return 1e3 * np.array([get_point(findings.best(title, solver)) for title in titles])


def _check_x(findings: Walk12Findings, solver: str, names: str, horizon: Horizon | None = None) -> Check:
    columns = ["snHh".index(name) for name in names]
    printed = 1e3 * np.array([row.x for row in (TABLE_4 if horizon else TABLE_3)])[:, columns]
    ours = list_x(findings, solver, horizon)[:, columns]
    ends = zip(names, ours.min(axis=0), ours.max(axis=0), strict=True)
    ranges = ", ".join(f"{name} {low:.1f} to {high:.1f}" for name, low, high in ends)
    return compare_levels(printed, ours, found=", ".join(f"{value:.0f}" for value in ours[:, 0]), ranges=ranges)


def _check_slower(findings: Walk12Findings) -> Check:
    ordered = sorted(zip(findings.f1_by(), (1e3 * row.x[0] for row in TABLE_3), strict=True))
    ours = list_x(findings)[:, 0]
    holds = [all(a > b for (_, a), (_, b) in pairwise(ordered)), bool(ours[-1] < ours[0])]
    return decide(holds, steps=", ".join(f"{s:.0f}" for _, s in ordered), change=ours[-1] - ours[0])


def _check_fastest(findings: Walk12Findings) -> Check:
    first, *others = sorted(findings.weighted, key=lambda point: point.at)
    longest = max(point.step_length_m for point in others)
    tie = max(point.at for point in findings.weighted if point.step_length_m > first.step_length_m - DIGIT_M)
    lead = 1e3 * (first.step_length_m - longest)
    values = {"s": 1e3 * first.step_length_m, "weight": first.at, "others": 1e3 * longest, "tie": tie}
    return require_change(round(lead, 3), **values, inside=_describe_inside(findings))


def _describe_inside(findings: Walk12Findings) -> str:
    """Return between which lambda the optimal step length is inside its range, and how it changes there, as words."""
    path = sorted(findings.weighted, key=lambda point: point.at)
    ends = path[0].step_length_m, path[-1].step_length_m
    inside = [p for p in path if min(ends) + DIGIT_M < p.step_length_m < max(ends) - DIGIT_M]
    if not inside:
        return "for no λ solved is the optimal step between both ends"
    weights = [inside[0].at, inside[-1].at]
    steps = [1e3 * p.step_length_m for p in (inside[0], inside[-1])]
    where = f"from λ = {weights[0]:.4g} to {weights[1]:.4g} the optimal step is between both ends"
    return f"{where}, {steps[0]:.0f} to {steps[1]:.0f} mm"


def _check_ends(findings: Walk12Findings) -> Check:
    *inner, last = findings.list_optima("exact")
    return decide(max(inner) <= max(1.0, last), inner=max(inner), last=last)


def _check_masses(_: Walk12Findings, motors_kg: Sequence[float]) -> Check:
    robot = load_point_mass_biped()
    mass = 2 * (robot.knee_mass_kg + robot.foot_mass_kg + robot.hip_mass_kg) + robot.waist_mass_kg
    shares = [100 * (mass / (12 * motor) - 1) for motor in motors_kg]
    if len(motors_kg) == 1:
        return compare_levels(motors_kg[0], mass / 12, mass=mass, each=mass / 12)
    return decide([5 <= share <= 10 for share in shares], shares=shares)


def _check_moments(_: Walk12Findings) -> Check:
    return compare_levels(np.zeros(2), CHANGES["rods"], **CHANGES)


def _check_time_steps(_: Walk12Findings) -> Check:
    return compare_levels(300_000, GA.population * PRINTED_STEPS, steps=PRINTED_STEPS, population=GA.population)


def _check_margin(findings: Walk12Findings) -> Check:
    f1 = [(findings.optimum(PAPER, row.weight).verdict.dense or {})["f1_per_m2s"] for row in TABLE_3]
    falls = any(after < (1 - 1e-3) * before for before, after in pairwise(f1))
    texts = {"found": ", ".join(f"{v:.0f}" for v in f1), "inside": _describe_inside(findings)}
    return require_change(-math.inf if falls else 100 * (f1[-1] / f1[0] - 1), **texts)


def _check_margin_of_table_3(findings: Walk12Findings, rows: int) -> Check:
    f1 = findings.f1_by()[:rows]
    shares = [stable.share for stable in findings.stable]
    changes = [100 * (after / before - 1) for before, after in pairwise(f1)]
    return require_change(changes, found=", ".join(f"{v:.1f}" for v in f1), low=min(changes), shares=shares)


def _check_steps(findings: Walk12Findings) -> Check:
    check = _check_x(findings, IPOPT, "s")
    return replace(check, values={**check.values, "inside": _describe_inside(findings)})


def _check_margin_by_print(_: Walk12Findings) -> Check:
    shares = [row.implied_f1 / row.f1max for row in TABLE_3]
    reach = [(DIGIT_F + (1 - row.weight) * DIGIT_M / F2MAX) / row.weight for row in TABLE_3]
    highest = list(accumulate((a - r for a, r in zip(shares, reach, strict=True)), max))  # that a share has to exceed
    possible = [a + r > high for a, r, high in zip(shares[1:], reach[1:], highest, strict=False)]
    texts = [", ".join(f"{value:.3f}" for value in values) for values in (shares, reach)]
    return decide([all(b > a for a, b in pairwise(shares)), all(possible)], found=texts[0], reach=texts[1])


def _check_static_stability(findings: Walk12Findings) -> Check:
    optima = [compute_stable_share(tuple(x / 1e3)).share for x in list_x(findings)]
    shares = [stable.share for stable in findings.stable]
    texts = [", ".join(f"{1 - share:.3f}" for share in values) for values in (shares, optima)]
    values = {"stable": findings.stable, "optimum": optima[-1], "all": compute_range(shares)}
    return decide(ClaimVerdict.UNTESTABLE, printed=texts[0], optima=texts[1], **values)


def _check_stable(findings: Walk12Findings, weights: Sequence[float], throughout: bool) -> Check:
    shares = [stable.share for stable in findings.stable]
    chosen = [share for row, share in zip(TABLE_3, shares, strict=True) if row.weight in weights]
    optimum = compute_stable_share(tuple(list_x(findings)[-1] / 1e3)).share
    holds = min(*chosen, optimum) == 1 if throughout else max(chosen) < 1
    return decide(holds, shares=chosen, optimum=optimum, all=compute_range(shares))


def _check_contrast(findings: Walk12Findings, weight: float) -> Check:
    other, last = findings.stable[TABLE_3.index(find_row(weight))], findings.stable[-1]
    return decide(last.first_s < other.first_s or last.last_s > other.last_s, weight=weight, other=other, last=last)


def _check_speed(_: Walk12Findings, weight: float, printed_m_s: float, share: float, times_s: Sequence[float]) -> Check:
    s = find_row(weight).x[0]
    ours = [share * s / time for time in times_s]
    texts = {"ours": " or ".join(f"{v:.4f}" for v in ours), "times": " or ".join(f"{t:g}" for t in times_s)}
    off = 100 * (ours[0] / printed_m_s - 1)
    return claims.compare_readings([printed_m_s], [[v] for v in ours], s=s, implied=s / printed_m_s, off=off, **texts)


def _check_faster(findings: Walk12Findings) -> Check:
    table = 1e3 * (find_row(0.1).x[0] - find_row(0.15).x[0])
    optima = list_x(findings)[:, 0]
    return compare_changes(128.0 - 125.0, table, optima=optima[0] - optima[1], table=table)


def _check_epochs(findings: Walk12Findings) -> Check:
    def compute_gain(run: RunRecord) -> float:
        f = np.array(run.history.objective, dtype=float)
        epoch = int(np.searchsorted(run.history.evaluations, GA.population * (1 + CONVERGED_EPOCH)))
        return float(1 - f[min(epoch, len(f) - 1)] / f[-1])

    names = ("ga", *walk12_runs.GA_VARIANTS)
    gains = {name: [compute_gain(run) for run in findings.records(PAPER, 0.15, name)] for name in names}
    medians = {name: 100 * float(np.median(values)) for name, values in gains.items()}
    words = ", ".join(f"{name} {gain:.2f} %" for name, gain in medians.items() if name != "ga")
    own = {"gain": medians["ga"], "worst": 100 * max(gains["ga"]), "others": words}
    return decide([gain < 100 * CONVERGED for gain in medians.values()], **own)


def _check_below(findings: Walk12Findings) -> Check:
    below = 1e3 * np.array(get_point(findings.best("below")))
    apart = np.abs(below - list_x(findings)[0]).max()
    return decide(ClaimVerdict.UNTESTABLE, apart=apart)


def _check_accuracy(findings: Walk12Findings, zmp: Zmp) -> Check:
    errors = [1e3 * walk12_findings.compute_zmp_error(row.x, zmp) for row in TABLE_3]
    values = {"low": min(errors), "high": max(errors), "change": findings.describe_f1_change(zmp, "moment-free")}
    return compare_levels(np.zeros(len(errors)), errors, **values, **CHANGES)


def _check_inverse_kinematics(findings: Walk12Findings) -> Check:
    """Check that legs of the printed gaits and the optima are longer than where the printed (2) begins to miss the hip.

    (2) takes theta_B from an arccosine that is never negative; below sqrt(d1^2 - d2^2) between hip and ankle it would be.
    """
    robot = load_point_mass_biped()
    gaits = [*(row.x for row in TABLE_3), *list_x(findings) / 1e3]
    bent = max(float(walk12_findings.compute_knees(x, 400).max()) for x in gaits)  # up to a straight angle
    thigh, shank = robot.thigh_m, robot.shank_m
    shortest = math.sqrt(thigh**2 + shank**2 + 2 * thigh * shank * math.cos(bent))
    branch_m = math.sqrt(abs(thigh**2 - shank**2))
    return decide(shortest > branch_m, shortest=1e3 * shortest, branch_m=branch_m)


def _check_ranges(_: Walk12Findings) -> Check:
    return compare_levels(0.0, SHARES["out_of_reach"], **SHARES)


def _check_circle(findings: Walk12Findings, degrees: float) -> Check:
    turn = math.radians(degrees)
    x = get_point(findings.optimum(PAPER, 0.9))
    arrays = follow(x, steps=90, intervals=2, turn_rad=turn)
    prints = np.unique(np.round(arrays["left_ankle"][arrays["left_stance"] == 1.0][:, :2], 7), axis=0)
    radii = np.linalg.norm(prints - prints.mean(axis=0), axis=1)
    feet = [follow(x, steps=1, turn_rad=angle)["right_ankle"] for angle in (0.0, turn)]
    off = 1e3 * float(np.linalg.norm(feet[1] - feet[0], axis=1).max())
    values = {"radius": radii.mean(), "spread": 1e3 * float(np.ptp(radii)), "prints": len(prints), "s": x[0]}
    return decide(float(np.ptp(radii)) < CIRCLE_M, **values, off=off)


def list_f1max(findings: Walk12Findings, horizon: Horizon, solver: str = IPOPT) -> list[float]:
    """Return f1 of the most stable gait at each T of Table IV [1/(m^2 s)], IPOPT's or that of a search's median run."""
    best = [findings.best(title_table_4(row, horizon, most_stable=True), solver) for row in TABLE_4]
    return [F1MAX * f for f in list_objectives(best)]


def _list_best(findings: Walk12Findings, horizon: Horizon) -> list[RunRecord]:
    return [findings.best(title_table_4(row, horizon)) for row in TABLE_4]


def _check_f1max_over_time(findings: Walk12Findings, horizon: Horizon, solver: str) -> Check:
    f1max = list_f1max(findings, horizon, solver)
    return compare_levels([row.f1max for row in TABLE_4], f1max, found=", ".join(f"{value:.0f}" for value in f1max))


def _check_trend(findings: Walk12Findings, horizon: Horizon) -> Check:
    slow = TABLE_4[0]
    fast = TABLE_4[-1]
    f1max = list_f1max(findings, horizon)
    ours = 100 * (f1max[0] / f1max[-1] - 1)
    times = {"slow": slow.step_time_s, "fast": fast.step_time_s}
    return compare_changes(100 * (slow.f1max / fast.f1max - 1), ours, **times, found=ours)


def _check_slows(findings: Walk12Findings) -> Check:
    times, printed = np.array([[row.step_time_s, row.x[0]] for row in TABLE_4]).T
    speeds = [printed / times, 1e-3 * list_x(findings, IPOPT, "step")[:, 0] / times]
    changes = [[100 * (1 - slow / fast) for slow, fast in pairwise(row)] for row in speeds]
    texts = [", ".join(f"{speed:.3f}" for speed in row) for row in speeds]
    return require_change(changes, printed=texts[0], optima=texts[1], times=times)


def _check_f1_over_time(_: Walk12Findings, horizon: Horizon) -> Check:
    f1 = [compute_f1(row, horizon=horizon) for row in TABLE_4]
    ranges = [compute_range(compute_f1(row, horizon=horizon) for row in list_rounded(row)) for row in TABLE_4]
    least, most = ([100 * (a[k] / b[1 - k] - 1) for a, b in pairwise(ranges)] for k in (0, 1))
    texts = (", ".join(f"{v:.0f}" for v in f1), ", ".join(f"{low:.0f} to {high:.0f}" for low, high in ranges))
    return require_change([least, most], found=texts[0], ranges=texts[1])


def _check_variables_over_time(findings: Walk12Findings, horizon: Horizon, solver: str) -> Check:
    printed = np.ptp([row.x for row in TABLE_4], axis=0) * 1e3
    found = np.ptp(list_x(findings, solver, horizon), axis=0)
    texts = [", ".join(f"{value:.0f}" for value in values) for values in (printed, found)]
    return compare_levels(printed, found, ranges=texts[0], found=texts[1])


def _check_f_of_table_4(_: Walk12Findings, horizon: Horizon) -> Check:
    ours = [compute_f(row, row.f1max, horizon=horizon) for row in TABLE_4]
    return compare_levels([row.f for row in TABLE_4], ours, found=", ".join(f"{f:.4f}" for f in ours))


def _check_optimal_over_time(findings: Walk12Findings, horizon: Horizon) -> Check:
    best = list_objectives(_list_best(findings, horizon))
    f1max = list_f1max(findings, horizon)
    ours = [compute_f(row, most, horizon=horizon) for row, most in zip(TABLE_4, f1max, strict=True)]
    gaps = compute_range(100 * (1 - f / b) for f, b in zip(ours, best, strict=True))
    return compare_levels(best, ours, gaps=gaps)


def _check_f_over_time(findings: Walk12Findings) -> Check:
    values: dict[str, list[float]] = {h: list_objectives(_list_best(findings, h)) for h in HORIZONS}
    values["printed"] = [row.f for row in TABLE_4]
    spreads = {name: 100 * (max(f) / min(f) - 1) for name, f in values.items()}
    texts = {name: ", ".join(f"{value:.4f}" for value in f) for name, f in values.items()}
    return compare_levels(np.zeros(len(HORIZONS)), [spreads[h] for h in HORIZONS], f=texts, spread=spreads)


def _check_share_over_time(findings: Walk12Findings) -> Check:
    printed = [row.implied_f1 / row.f1max for row in TABLE_4]
    optima, f1max = _list_best(findings, "step"), list_f1max(findings, "step")
    ours = [run.verdict.indexes["f1_per_m2s"] / most for run, most in zip(optima, f1max, strict=True)]
    spreads = [100 * (max(values) / min(values) - 1) for values in (printed, ours)]
    texts = [", ".join(f"{value:.3f}" for value in values) for values in (printed, ours)]
    return compare_levels(np.zeros(2), spreads, printed=texts[0], ours=texts[1], spreads=spreads)
