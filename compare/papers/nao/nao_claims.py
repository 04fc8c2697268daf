"""Checks of the NAO paper's claims about searches and power; ``nao_claims.toml`` names them with their arguments.

Claims about PSO are checked twice: with the constant inertia weight that the paper prints (the id) and with the damping of the
code that it cites (the id with ``-damped``). Other checks are in ``nao_gait_claims.py``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from compare.analysis.statistics.inference import a12, rank_sum_normal
from compare.papers.claims import (
    Check,
    Verdict,
    compare_changes,
    compare_levels,
    decide,
    require_change,
    require_significance,
)
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings
from compare.papers.nao.nao_paper import PAPER, SWING_HEIGHT, SWING_POWER_W
from compare.papers.nao.nao_runs import ALGORITHMS, SEARCHES

# A solution that costs this share more than the optimum is as good for a walker.
NEARLY_OPTIMAL = 0.01
# "In this range" of the runs: at least this share of the values at their ends.
MOST = 0.9
# A curve that rises by less than this share of itself between two points counts as falling: IPOPT's local optima differ so.
RIPPLE = 1e-3
RANK_SUM = "rank-sum test"


def _check_better(phase: PhaseFindings, swarm: str) -> Check:
    pso, ga = phase.final_powers(swarm), phase.final_powers("ga")
    test, effect, of_pso, of_ga = phase.test(swarm), a12(pso, ga), np.median(pso), np.median(ga)
    printed = {name: phase.paper.optima[name].power_W for name in ALGORITHMS}
    printed_lead, lead = (1000 * (b - a) for a, b in ((printed["pso"], printed["ga"]), (of_pso, of_ga)))
    check = compare_changes(
        printed_lead,
        lead,
        swarm=NAMES[swarm],
        test=test,
        effect=effect,
        wins=100 * effect,
        pso=of_pso,
        ga=of_ga,
        best=phase.best,
        best_run=min(pso + ga),
        printed_lead=printed_lead,
        lead=lead,
        share=100 * (of_ga / of_pso - 1),
        survival=phase.test(swarm, "ga-generational").p_two_sided,
        penalty=phase.test(f"{swarm}-penalty", "ga-penalty").p_two_sided,
        more=phase.test(f"{swarm}-more", "ga-more").p_two_sided,
        pairs=len(phase.final_powers("ga-more")),
    )
    return require_significance(check, RANK_SUM, test.p_two_sided)


def _check_more_pairs(phase: PhaseFindings) -> Check:
    """Check damped PSO's lead over GA [mW] over the further initial populations."""
    pso, ga = (phase.final_powers(f"{name}-more") for name in ALGORITHMS)
    printed = 1000 * (phase.paper.optima["ga"].power_W - phase.paper.optima["pso"].power_W)
    lead, p = 1000 * float(np.median(ga) - np.median(pso)), phase.test("pso-more", "ga-more").p_two_sided
    check = compare_changes(
        printed, lead, swarm=NAMES["pso"], printed_lead=printed, lead=lead, pairs=len(pso), p=p, wins=100 * a12(pso, ga)
    )
    return require_significance(check, RANK_SUM, p)


def _check_statistic(phase: PhaseFindings) -> Check:
    printed, runs = phase.paper.test, 11
    variance = runs * runs * (2 * runs + 1) / 12
    z = (printed.rank_sum - runs * (2 * runs + 1) / 2 + 0.5) / math.sqrt(variance)
    p = math.erfc(abs(z) / math.sqrt(2))
    both = [printed.z, printed.p_two_sided, printed.p_less]
    return compare_levels(both, [z, p, p / 2], test=printed, z=z, p=p, p_less=p / 2)


def _check_steadier(phase: PhaseFindings, swarm: str) -> Check:
    powers = [np.array(phase.final_powers(name)) for name in (swarm, "ga")]
    pso, ga = (1000 * float(np.ptp(power)) for power in powers)
    p = rank_sum_normal(*(np.abs(power - np.median(power)).tolist() for power in powers)).p_two_sided
    change = 100 * (pso / ga - 1)
    check = require_change(-change, swarm=NAMES[swarm], pso=pso, ga=ga, change=change, p=p)
    return require_significance(check, "rank-sum test of distances from the median", p)


def _check_same_optimum(phase: PhaseFindings, swarm: str) -> Check:
    gaps = 100 * (np.array(phase.final_powers(swarm)) / phase.best - 1)
    return decide(bool(np.all(gaps <= 100 * NEARLY_OPTIMAL)), swarm=NAMES[swarm], low=gaps.min(), high=gaps.max())


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
    values = {
        "pso": np.median(pso),
        "ga": np.median(ga),
        "printed_lead": printed,
        "lead": ours,
        "middle": middle,
        "p": p,
    }
    return require_significance(compare_changes(printed, ours, swarm=NAMES[swarm], **values), RANK_SUM, p)


def _compute_lead(values: dict[str, float]) -> float:
    """Return how much PSO's value is above GA's [%]."""
    return 100 * (values["pso"] / values["ga"] - 1)


def _check_swing_price(findings: NaoFindings, algorithm: str, height_m: float) -> Check:
    low, high = findings.swing_power(0.015), findings.swing_power(height_m)
    printed = 100 * (SWING_POWER_W[algorithm][height_m] / SWING_POWER_W[algorithm][0.015] - 1)
    ours = 100 * (high / low - 1)
    return compare_changes(printed, ours, low=low, high=high, rise=ours, printed_rise=printed)


def _check_swing_rise(findings: NaoFindings, algorithm: str) -> Check:
    """Check how much steeper power rises above 0.024 m than below it [%]."""
    printed, ours = SWING_POWER_W[algorithm], {point.at: point.power_W for point in findings.swing}
    steeper, ours_steeper = (
        (power[0.028] - power[0.024]) / (power[0.024] - power[0.015]) * 9 / 4 for power in (printed, ours)
    )
    rises = []
    for name in SEARCHES:
        for words, run in (("all runs", None), ("median run", findings.ssp.median_run(name))):
            low, high = (findings.ssp.points[name].cheapest_near(SWING_HEIGHT, at, 5e-4, run) for at in (0.015, 0.028))
            rise = "none found" if math.isnan(high / low) else f"{100 * (high / low - 1):+.0f} %"
            rises.append(f"{NAMES[name]}, {words} {rise}")
    return require_change(
        100 * (ours_steeper - 1),
        rise=100 * (printed[0.028] / printed[0.015] - 1),
        steeper=steeper,
        ours=ours_steeper,
        found=100 * (ours[0.028] / ours[0.015] - 1),
        rises="; ".join(rises),
    )


def _check_swing_heights(phase: PhaseFindings, swarm: str) -> Check:
    """Check that a swarm's cheapest solution near each swing height needs less than GA's, in the histories of all runs."""
    powers = {
        at: [phase.points[name].cheapest_near(SWING_HEIGHT, at, 5e-4) for name in (swarm, "ga")]
        for at in PAPER.swing_heights_m
    }
    leads = ", ".join(
        f"{'none found' if math.isnan(ga / pso) else f'{100 * (ga / pso - 1):+.1f} %'} at {at:.3f} m"
        for at, (pso, ga) in powers.items()
    )
    return decide(all(pso < ga for pso, ga in powers.values()), swarm=NAMES[swarm], leads=leads)


def _check_swing_lead(phase: PhaseFindings, swarm: str) -> Check:
    """Check GA's power at 0.024 m above PSO's, as read off the histories of all runs."""
    printed = 100 * (SWING_POWER_W["ga"][0.024] / SWING_POWER_W["pso"][0.024] - 1)
    pso, ga = (phase.points[name].cheapest_near(SWING_HEIGHT, 0.024, 5e-4) for name in (swarm, "ga"))
    middle = [
        phase.points[name].cheapest_near(SWING_HEIGHT, 0.024, 5e-4, phase.median_run(name)) for name in (swarm, "ga")
    ]
    cheapest = ["none" if math.isnan(power) else f"{power:.4f} W" for power in (pso, ga, *middle)]
    values = {
        "swarm": NAMES[swarm],
        "pso": cheapest[0],
        "ga": cheapest[1],
        "printed_lead": printed,
        "middle": cheapest[2:],
    }
    if "none" in cheapest:
        return decide(Verdict.UNTESTABLE, **values)
    return compare_changes(printed, 100 * (ga / pso - 1), **values)


def _check_swing_range(phase: PhaseFindings, algorithm: str, printed_mm: float) -> Check:
    """Check how much higher than its best solution a search's median run steps for at most 3 % more power."""
    points, run = phase.points[algorithm], phase.median_run(algorithm)
    own = points.run == run
    cheap = own & (points.power_W <= 1.03 * points.power_W[own].min())
    start = phase.median(algorithm).x["swing_height_m"]
    ours = 1000 * (float(points.x[cheap, SWING_HEIGHT].max()) - start)
    return compare_changes(
        printed_mm, round(ours, 1), search=NAMES[algorithm], ours=ours, start=start, printed=printed_mm
    )


def _check_velocity(phase: PhaseFindings, name: str) -> Check:
    printed = PAPER.velocity_ranges[name]
    symbols = [f"x{i + 1}" for i in printed.variables]
    names = [phase.problem.names[i] for i in printed.variables]
    optimum = np.array([phase.optimum.x[name] for name in names])
    ends = {
        title: np.array([[run.x[name] for name in names] for run in runs]) for title, runs in phase.searches.items()
    }
    inside = {title: (printed.low <= values) & (values <= printed.high) for title, values in ends.items()}
    outside = [
        f"{search.upper()} {symbol} = {optimum.x[i]}"
        for search, optimum in phase.paper.optima.items()
        for symbol, i in zip(symbols, printed.variables, strict=True)
        if not printed.low <= optimum.x[i] <= printed.high
    ]
    near = [
        f"{symbol} = {best:z.4f} ({f'{low:z.4f} to {high:z.4f}' if math.isfinite(low) else 'no point of the sweep'})"
        for symbol, best, (low, high) in zip(
            symbols, optimum, (phase.range_within(i, NEARLY_OPTIMAL) for i in printed.variables), strict=True
        )
    ]
    return decide(
        bool(np.mean(list(inside.values())) >= MOST),
        symbols=" and ".join(symbols),
        low=printed.low,
        high=printed.high,
        nearly=100 * NEARLY_OPTIMAL,
        near=", ".join(near),
        ends=(min(values.min() for values in ends.values()), max(values.max() for values in ends.values())),
        within=", ".join(f"{NAMES[title]} {100 * values.mean():.0f} %" for title, values in inside.items()),
        outside=f" (but {', '.join(outside)} in print)" if outside else "",
    )


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


def _check_wider(findings: NaoFindings, ranges: Sequence[str], position: int) -> Check:
    share, printed = 5 * NEARLY_OPTIMAL, [PAPER.velocity_ranges[name] for name in ranges]
    ssp, dsp = (float(np.ptp(phase.range_within(position, share))) for phase in findings.phases)
    factors = ((printed[1].high - printed[1].low) / (printed[0].high - printed[0].low), dsp / ssp if ssp else math.inf)
    before, after = (100 * (factor - 1) for factor in factors)
    return compare_changes(
        before, after, share=100 * share, ssp=ssp, dsp=dsp, factor=1 + after / 100, printed=1 + before / 100
    )


def _check_gaps(phase: PhaseFindings) -> Check:
    """Check whether a duration without a feasible point lies between two with one."""
    durations = phase.sweeps[phase.paper.duration]
    feasible = [point.at for point in durations if point.feasible]
    missing = [point.at for point in durations if not point.feasible]
    inside = [at for at in missing if min(feasible) < at < max(feasible)]
    short = [f"{at:.2f}" for at in missing if at < min(feasible)]
    found = (
        f"none found at {', '.join(f'{at:.2f}' for at in inside) or 'no duration'} s between {min(feasible):.2f} and "
        f"{max(feasible):.2f} s ({len(durations)} durations); below, none at {', '.join(short) or 'no duration'} s of the sweep"
    )
    return decide(bool(inside), found=found)


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
    found = {name: points.power_W[points.x[:, 5] > 0] for name, points in phase.points.items()}
    cheapest = min((float(power.min()) for power in found.values() if len(power)), default=math.nan)
    share = sum(map(len, found.values())) / sum(len(points.power_W) for points in phase.points.values())
    change = 100 * (cheapest / phase.best - 1)
    words = f"the cheapest costs {change:.0f} % more" if share else "none"
    return require_change(change if share else -math.inf, words=words, share=100 * share)


def _check_faster(findings: NaoFindings) -> Check:
    """Check how much faster the hip moves forwards in the shortest feasible duration of double than of single support [%]."""
    speeds, ranges = [], []
    for phase in findings.phases:
        times = [point.at for point in phase.sweeps[phase.paper.duration] if point.feasible]
        hip = phase.problem.signals(phase.problem.check_x(phase.paper.optima["pso"].x)).arrays["hip"]
        speeds.append(float(hip[-1, 0] - hip[0, 0]) / min(times))
        ranges.append(max(times) / min(times))
    change = 100 * (speeds[1] / speeds[0] - 1)
    return require_change(change, speeds=speeds, ranges=ranges, change=change)


def _check_same_median(phase: PhaseFindings, swarm: str) -> Check:
    pso, ga = phase.median_run(swarm), phase.median_run("ga")
    return decide(pso == ga, swarm=NAMES[swarm], pso=pso, ga=ga)
