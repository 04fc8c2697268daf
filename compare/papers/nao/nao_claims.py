"""Checks of the NAO paper's claims about searches and power; ``nao_claims.toml`` names them with their arguments.

Claims about PSO are checked twice: with the constant inertia weight that the paper prints (the id) and with the damping of the
code that it cites (the id with ``-damped``). Other checks are in ``nao_gait_claims.py``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from compare.analysis.record_statistics import a12, rank_sum_normal
from compare.papers import claims
from compare.papers.claims import Check, Verdict, compare_changes, decide, require_change, require_significance
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings
from compare.papers.nao.nao_paper import PAPER, SWING_HEIGHT, SWING_POWER_W
from compare.papers.nao.nao_runs import ALGORITHMS, SEARCHES
from compare.papers.paper_runs import compute_range

# A solution that costs this share more than the optimum is as good for a walker.
NEARLY_OPTIMAL = 0.01
# "In this range" of the runs: at least this share of the values at their ends.
MOST = 0.9
# A curve that rises by less than this share of itself between two points counts as falling: IPOPT's local optima differ so.
RIPPLE = 1e-3
RANK_SUM = "rank-sum test"


def _check_better(phase: PhaseFindings, swarm: str, kind: str = "") -> Check:
    """Check a swarm's lead over GA [mW]; ``kind`` is how the names of other runs of both end."""
    pso, ga = (phase.final_powers(f"{name}{kind}") for name in (swarm, "ga"))
    test, of_pso, of_ga = phase.test(f"{swarm}{kind}", f"ga{kind}"), float(np.median(pso)), float(np.median(ga))
    printed_lead = 1000 * (phase.paper.optima["ga"].power_W - phase.paper.optima["pso"].power_W)
    values: dict[str, Any] = {"swarm": NAMES[swarm], "test": test, "p": test.p_two_sided, "effect": a12(pso, ga)}
    values |= {"pso": of_pso, "ga": of_ga, "best": phase.best, "best_run": min(pso + ga), "pairs": len(pso)}
    values |= {"printed_lead": printed_lead, "lead": 1000 * (of_ga - of_pso), "share": 100 * (of_ga / of_pso - 1)}
    values["generational"] = phase.test(swarm, "ga-generational").p_two_sided
    for name in ("penalty", "more"):
        values[name] = phase.test(f"{swarm}-{name}", f"ga-{name}").p_two_sided
    check = compare_changes(printed_lead, values["lead"], **values, wins=100 * values["effect"])
    return require_significance(check, RANK_SUM, test.p_two_sided)


def _check_each_run(phase: PhaseFindings, swarm: str) -> Check:
    pairs = list(zip(phase.final_powers(swarm), phase.final_powers("ga"), strict=True))
    won = sum(pso < ga for pso, ga in pairs)
    return decide(won == len(pairs), swarm=NAMES[swarm], won=won, pairs=len(pairs))


def _check_near_least(phase: PhaseFindings) -> Check:
    """Check whether GA's average is nearer to its least power than PSO's, with both weights [%]."""
    ends = {name: phase.final_powers(name) for name in phase.searches}
    above = {name: 100 * (float(np.mean(powers)) / min(powers) - 1) for name, powers in ends.items()}
    words = ", ".join(f"{NAMES[name]} {share:.2f} %" for name, share in above.items())
    return decide([above["ga"] < share for name, share in above.items() if name != "ga"], found=words)


def _check_alike(phase: PhaseFindings, swarm: str) -> Check:
    """Check whether a swarm's and GA's median solutions differ by no more than the printed ones: of the ranges [%]."""
    printed = [np.array(phase.paper.optima[name].x) for name in ALGORITHMS]
    ours = [np.array(list(phase.median(name).x.values())) for name in (swarm, "ga")]
    width = phase.problem.upper - phase.problem.lower
    apart = [100 * float((np.abs(a - b) / width).max()) for a, b in (printed, ours)]
    return decide(apart[1] <= apart[0], swarm=NAMES[swarm], printed=apart[0], ours=apart[1])


def _check_statistic(phase: PhaseFindings) -> Check:
    printed, runs = phase.paper.test, 11
    variance = runs * runs * (2 * runs + 1) / 12
    z = (printed.rank_sum - runs * (2 * runs + 1) / 2 + 0.5) / math.sqrt(variance)
    p = math.erfc(abs(z) / math.sqrt(2))
    both = [printed.z, printed.p_two_sided, printed.p_less]
    return claims.compare_levels(both, [z, p, p / 2], test=printed, z=z, p_both=p, p_less=p / 2)


def _check_steadier(phase: PhaseFindings, swarm: str) -> Check:
    powers = [np.array(phase.final_powers(name)) for name in (swarm, "ga")]
    pso, ga = (1000 * float(np.ptp(power)) for power in powers)
    p = rank_sum_normal(*(np.abs(power - np.median(power)).tolist() for power in powers)).p_two_sided
    change = 100 * (pso / ga - 1)
    check = require_change(-change, swarm=NAMES[swarm], pso=pso, ga=ga, change=change, p=p)
    return require_significance(check, "rank-sum test of distances from the median", p)


def _check_same_optimum(phase: PhaseFindings, swarm: str) -> Check:
    gaps = 100 * (np.array(phase.final_powers(swarm)) / phase.best - 1)
    within = gaps <= 100 * NEARLY_OPTIMAL
    ends = {"low": gaps.min(), "high": gaps.max(), "within": within.sum(), "runs": len(gaps)}
    return decide(bool(within.all()), swarm=NAMES[swarm], **ends)


def _check_falling(phase: PhaseFindings, over: Literal["hip", "time"]) -> Check:
    """Check whether the feasible optima over the hip's height or the time fall, and give the price of its bound."""
    sweep = [point for point in phase.sweeps[phase.paper.duration if over == "time" else 0] if point.feasible]
    prices = (bound.price for bound in phase.optimum.active_constraints if bound.name == "bounds[hip_height_m]")
    power = np.array([point.power_W for point in sweep])
    falls = bool(np.all(power[1:] <= power[:-1] * (1 + RIPPLE)))
    gain = 100 * (1 - power[-1] / power[0])
    values = {"gain": gain, "factor": power[0] / power[-1], "price": -next(prices, 0.0)}
    falling = "falling" if falls else "not falling"
    return require_change(gain if falls else -math.inf, first=sweep[0], last=sweep[-1], falling=falling, **values)


def _check_torque_change(phase: PhaseFindings, swarm: str) -> Check:
    """Check PSO's median against GA's over the final solutions of all runs."""
    pso, ga = ([run.verdict.indexes["torque_change_Nm"] for run in phase.searches[name]] for name in (swarm, "ga"))
    printed = _compute_lead({name: phase.paper.optima[name].indexes["torque_change_Nm"] for name in ALGORITHMS})
    ours = _compute_lead({"pso": float(np.median(pso)), "ga": float(np.median(ga))})
    middle = [phase.median(name).verdict.indexes["torque_change_Nm"] for name in (swarm, "ga")]
    p = rank_sum_normal(pso, ga).p_two_sided
    values = {"swarm": NAMES[swarm], "pso": np.median(pso), "ga": np.median(ga), "middle": middle, "p": p}
    return require_significance(compare_changes(printed, ours, printed_lead=printed, lead=ours, **values), RANK_SUM, p)


def _compute_lead(values: dict[str, float]) -> float:
    """Return how much PSO's value is above GA's [%]."""
    return 100 * (values["pso"] / values["ga"] - 1)


def _check_swing_price(findings: NaoFindings, algorithm: str, height_m: float) -> Check:
    low, high = findings.swing_power(0.015), findings.swing_power(height_m)
    printed = 100 * (SWING_POWER_W[algorithm][height_m] / SWING_POWER_W[algorithm][0.015] - 1)
    ours = 100 * (high / low - 1)
    rises = _describe_rises(findings, height_m)
    return compare_changes(printed, ours, low=low, high=high, rise=ours, printed_rise=printed, rises=rises)


def _describe_rises(findings: NaoFindings, height_m: float) -> str:
    """Return how much more than near 0.015 m the cheapest solution near a height costs, in words by search and runs."""
    rises = []
    for name in SEARCHES:
        for words, run in (("all runs", None), ("median run", findings.ssp.median_run(name))):
            low, high = (
                findings.ssp.points[name].cheapest_near(SWING_HEIGHT, at, 5e-4, run) for at in (0.015, height_m)
            )
            rise = "none found" if math.isnan(high / low) else f"{100 * (high / low - 1):+.1f} %"
            rises.append(f"{NAMES[name]}, {words} {rise}")
    return "; ".join(rises)


def _check_swing_rise(findings: NaoFindings, algorithm: str) -> Check:
    """Check how much steeper power rises above 0.024 m than below it [%]."""
    printed, ours = SWING_POWER_W[algorithm], {point.at: point.power_W for point in findings.swing}
    steeper, ours_steeper = (
        (power[0.028] - power[0.024]) / (power[0.024] - power[0.015]) * 9 / 4 for power in (printed, ours)
    )
    rise, found = (100 * (power[0.028] / power[0.015] - 1) for power in (printed, ours))
    values = {"rise": rise, "found": found, "steeper": steeper, "rises": _describe_rises(findings, 0.028)}
    return require_change(100 * (ours_steeper - 1), ours=ours_steeper, **values)


def _check_swing_heights(phase: PhaseFindings, swarm: str) -> Check:
    """Check how much more GA's cheapest solution near each swing height needs than a swarm's, over all runs [%]."""
    leads = []
    for at in PAPER.swing_heights_m:
        pso, ga = (phase.points[name].cheapest_near(SWING_HEIGHT, at, 5e-4) for name in (swarm, "ga"))
        leads.append(100 * (ga / pso - 1))
    words = ["none found" if math.isnan(lead) else f"{lead:+.1f} %" for lead in leads]
    found = ", ".join(f"{word} at {at:.3f} m" for word, at in zip(words, PAPER.swing_heights_m, strict=True))
    return require_change(leads, swarm=NAMES[swarm], leads=found)


def _check_swing_lead(phase: PhaseFindings, swarm: str) -> Check:
    """Check GA's power at 0.024 m above PSO's, as read off the histories of all runs."""
    printed = 100 * (SWING_POWER_W["ga"][0.024] / SWING_POWER_W["pso"][0.024] - 1)
    sources = [(name, run) for run in (None, phase.median_run) for name in (swarm, "ga")]
    powers = [phase.points[at].cheapest_near(SWING_HEIGHT, 0.024, 5e-4, run and run(at)) for at, run in sources]
    words = ["none" if math.isnan(power) else f"{power:.4f} W" for power in powers]
    values = {"swarm": NAMES[swarm], "pso": words[0], "ga": words[1], "middle": words[2:]}
    if "none" in words:
        return decide(Verdict.UNTESTABLE, **values)
    return compare_changes(printed, 100 * (powers[1] / powers[0] - 1), **values)


def _check_swing_range(phase: PhaseFindings, algorithm: str, printed_mm: float) -> Check:
    """Check how much higher than its best solution a search's median run steps for at most 3 % more power."""
    points, run = phase.points[algorithm], phase.median_run(algorithm)
    own = points.run == run
    cheap = own & (points.power_W <= 1.03 * points.power_W[own].min())
    start = phase.median(algorithm).x["swing_height_m"]
    ours = 1000 * (float(points.x[cheap, SWING_HEIGHT].max()) - start)
    values = {"search": NAMES[algorithm], "ours": ours, "start": start, "printed": printed_mm}
    return compare_changes(printed_mm, round(ours, 1), **values)


def _check_velocity(phase: PhaseFindings, name: str) -> Check:
    printed = PAPER.velocity_ranges[name]
    symbols = {i: f"x{i + 1}" for i in printed.variables}
    chosen = list(printed.variables)
    ends = {title: np.array([[*run.x.values()] for run in runs])[:, chosen] for title, runs in phase.searches.items()}
    inside = {title: (printed.low <= values) & (values <= printed.high) for title, values in ends.items()}
    outside = [
        f"{search.upper()} {symbol} = {optimum.x[i]}"
        for search, optimum in phase.paper.optima.items()
        for i, symbol in symbols.items()
        if not printed.low <= optimum.x[i] <= printed.high
    ]
    near = []
    for i, symbol in symbols.items():
        low, high = phase.range_within(i, NEARLY_OPTIMAL)
        cheap = f"{low:z.4f} to {high:z.4f}" if math.isfinite(low) else "no point of the sweep"
        near.append(f"{symbol} = {[*phase.optimum.x.values()][i]:z.4f} ({cheap})")
    within = (f"{NAMES[title]} {100 * values.mean():.0f} %" for title, values in inside.items())
    texts = {"symbols": " and ".join(symbols.values()), "near": ", ".join(near), "within": ", ".join(within)}
    texts["outside"] = f" (but {', '.join(outside)} in print)" if outside else ""
    found = compute_range(np.concatenate(list(ends.values())).ravel())
    values = {"low": printed.low, "high": printed.high, "nearly": 100 * NEARLY_OPTIMAL, "ends": found}
    return decide(bool(np.mean(list(inside.values())) >= MOST), **texts, **values)


def _check_lateral(phase: PhaseFindings, swarm: str) -> Check:
    """Check whether the ratio of lateral velocities is nearer to one for PSO's runs than for GA's."""
    start, end = "hip_vy_start_m_s", "hip_vy_end_m_s"
    pso, ga = ([abs(run.x[start] / run.x[end]) for run in phase.searches[name]] for name in (swarm, "ga"))
    printed = {name: abs(optimum.x[5] / optimum.x[6]) for name, optimum in phase.paper.optima.items()}
    far = [np.abs(np.log(ratios)).tolist() for ratios in (pso, ga)]
    p = rank_sum_normal(*far).p_two_sided
    values = {"pso": np.median(pso), "ga": np.median(ga), "best": abs(phase.optimum.x[start] / phase.optimum.x[end])}
    check = decide(bool(np.median(far[0]) < np.median(far[1])), swarm=NAMES[swarm], printed=printed, p=p, **values)
    return require_significance(check, RANK_SUM, p)


def _check_wider(findings: NaoFindings, position: int, ranges: Sequence[str] = ()) -> Check:
    """Check how much wider a velocity's range of cheap optima is in double support [%]; ``ranges`` are the printed ones."""
    share, printed = 5 * NEARLY_OPTIMAL, [PAPER.velocity_ranges[name] for name in ranges]
    ssp, dsp = (float(np.ptp(phase.range_within(position, share))) for phase in findings.phases)
    values = {"share": 100 * share, "ssp": ssp, "dsp": dsp, "factor": dsp / ssp if ssp else math.inf}
    after = 100 * (values["factor"] - 1)
    if not printed:
        return require_change(after, **values)
    factor = (printed[1].high - printed[1].low) / (printed[0].high - printed[0].low)
    return compare_changes(100 * (factor - 1), after, **values, printed=factor)


def _check_gaps(phase: PhaseFindings) -> Check:
    """Check whether a duration without a feasible point lies between two with one."""
    durations = phase.sweeps[phase.paper.duration]
    feasible = [point.at for point in durations if point.feasible]
    missing = [point.at for point in durations if not point.feasible]
    inside = [at for at in missing if min(feasible) < at < max(feasible)]
    short = [f"{at:.2f}" for at in missing if at < min(feasible)]
    held = np.sort(np.concatenate([points.x[:, phase.paper.duration] for points in phase.points.values()]))
    ends = {"first": min(feasible), "last": max(feasible), "count": len(durations), "gap": float(np.diff(held).max())}
    words = [", ".join(texts) or "none" for texts in ([f"{at:.2f}" for at in inside], short)]
    return decide(bool(inside), inside=words[0], short=words[1], least=held[0], **ends)


def _check_average_speed(phase: PhaseFindings) -> Check:
    """Check the spread of power over durations against that over all else at the printed duration."""
    feasible = [point.power_W for point in phase.sweeps[phase.paper.duration] if point.feasible]
    paces = max(feasible) / min(feasible)
    others = [100 * (here["power_W"] / phase.best - 1) for here in phase.printed_here.values()]
    return decide(paces - 1 >= 2 * max(others) / 100, paces=paces, others=others)


def _check_exponential(findings: NaoFindings) -> Check:
    """Check whether the logarithm of power is nearer to a line over time than over the logarithm of time."""
    time, power = np.array([(point.at, point.power_W) for point in findings.durations if point.feasible]).T
    exponential, law = (float(np.corrcoef(x, np.log(power))[0, 1] ** 2) for x in (time, np.log(time)))
    rates = -np.diff(np.log(power)) / np.diff(time)
    return decide(exponential > law, exponential=exponential, law=law, fast=rates[0], slow=rates[-1])


def _check_signs(phase: PhaseFindings, signs: Mapping[str, int]) -> Check:
    """Check whether most runs end with these signs of variables."""
    shares = {
        title: float(np.mean([all(sign * run.x[name] > 0 for name, sign in signs.items()) for run in runs]))
        for title, runs in phase.searches.items()
    }
    words = ", ".join(f"{NAMES[title]} {100 * share:.0f} %" for title, share in shares.items())
    best = ", ".join(f"{phase.optimum.x[name]:z.4f}" for name in signs)
    return decide(all(share > 0.5 for share in shares.values()), shares=words, best=best)


def _check_dearer(phase: PhaseFindings, positions: Sequence[int], beyond: float) -> Check:
    """Check how much more the cheapest optimum costs at which a velocity is at least this far beyond zero [%], per variable."""
    dearer = []
    for position in positions:
        powers = [point.power_W for point in phase.sweeps[position] if point.feasible and abs(point.at) > beyond]
        dearer.append(100 * (min(powers) / phase.best - 1) if powers else math.inf)
    words = ", ".join("none feasible" if math.isinf(value) else f"{value:.2f} %" for value in dearer)
    return require_change(dearer, found=words)


def _check_near_zero(phase: PhaseFindings) -> Check:
    """Check how much rarer solutions are between zero and the printed range of x6 than within it, by its width [%]."""
    x6 = np.concatenate([points.x[:, 5] for points in phase.points.values()])
    printed = PAPER.velocity_ranges["lateral-velocity-dsp"]
    near, within = np.mean((x6 > printed.high) & (x6 <= 0)), np.mean((printed.low <= x6) & (x6 <= printed.high))
    density = (near / -printed.high) / (within / (printed.high - printed.low)) if within else math.inf
    return require_change(100 * (1 - density), near=100 * near, within=100 * within, density=density)


def _check_positive(phase: PhaseFindings) -> Check:
    """Check how much more the cheapest solutions with a positive lateral velocity cost than the best [%]."""
    x, power = (
        np.concatenate([getattr(points, name) for points in phase.points.values()]) for name in ("x", "power_W")
    )
    positive = power[x[:, 5] > 0]
    change = 100 * (positive.min() / phase.best - 1) if len(positive) else -math.inf
    words = f"the cheapest costs {change:.0f} % more" if len(positive) else "none"
    return require_change(change, words=words, share=100 * len(positive) / len(power))


def _check_faster(findings: NaoFindings) -> Check:
    """Check how much faster the hip moves forwards in the shortest feasible duration of double than of single support [%].

    There is no verdict if the shortest duration of single support is its bound, not the robot's.
    """
    speeds, ranges = [], []
    for phase in findings.phases:
        times = [point.at for point in phase.sweeps[phase.paper.duration] if point.feasible]
        hip = phase.problem.signals(phase.problem.check_x(phase.paper.optima["pso"].x)).arrays["hip"]
        speeds.append(float(hip[-1, 0] - hip[0, 0]) / min(times))
        ranges.append(max(times) / min(times))
    change = 100 * (speeds[1] / speeds[0] - 1)
    check, ssp = require_change(change, speeds=speeds, ranges=ranges, change=change), findings.ssp
    shortest = min(point.at for point in ssp.sweeps[ssp.paper.duration] if point.feasible)
    bound = 1.001 * ssp.problem.lower[ssp.paper.duration]
    return check if shortest > bound else replace(check, verdict=Verdict.UNTESTABLE)


def _check_same_median(phase: PhaseFindings, swarm: str) -> Check:
    pso, ga = phase.median_run(swarm), phase.median_run("ga")
    return decide(pso == ga, swarm=NAMES[swarm], pso=pso, ga=ga)
