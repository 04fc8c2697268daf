"""Checks of the NAO paper's claims about searches and power; ``nao_claims.toml`` names them with their arguments.

Claims about PSO are checked twice: with the constant inertia weight that the paper prints (the id) and with the damping of the
code that it cites (the id with ``-damped``). Other checks are in ``nao_gait_claims.py``.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from compare.analysis.record_statistics import approximate_rank_sum, compute_a12
from compare.papers import claims
from compare.papers.claims import Check, ClaimVerdict, compare_changes, compare_levels, decide, require_change
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings
from compare.papers.nao.nao_runs import ALGORITHMS, PAPER, SWING_HEIGHT, SWING_POWER_W
from nlp_gait.formulation import Array

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
    values: dict[str, Any] = {
        "swarm": NAMES[swarm],
        "test": test,
        "p": test.p_two_sided,
        "effect": compute_a12(pso, ga),
    }
    values |= {"pso": of_pso, "ga": of_ga, "best": phase.best, "best_run": min(pso + ga), "pairs": len(pso)}
    values |= {"printed_lead": printed_lead, "lead": 1000 * (of_ga - of_pso), "share": 100 * (of_ga / of_pso - 1)}
    values["printed_share"] = 100 * (phase.paper.optima["ga"].power_W / phase.paper.optima["pso"].power_W - 1)
    values["generational"] = phase.test(swarm, "ga-generational").p_two_sided
    for name in ("penalty", "more"):
        values[name] = phase.test(f"{swarm}-{name}", f"ga-{name}").p_two_sided
    check = compare_changes(printed_lead, values["lead"], **values, wins=100 * values["effect"])
    return claims.require_significance(check, RANK_SUM, test.p_two_sided)


def _check_left_tail(phase: PhaseFindings, swarm: str) -> Check:
    p = phase.test(swarm, "ga").p_less
    shown = {p < claims.SIGNIFICANT: ClaimVerdict.HOLDS, p > 1 - claims.SIGNIFICANT: ClaimVerdict.FAILS}
    return decide(shown.get(True, ClaimVerdict.NOT_SHOWN), swarm=NAMES[swarm], p_less=p)


def _check_each_run(phase: PhaseFindings, swarm: str) -> Check:
    pairs = list(zip(phase.final_powers(swarm), phase.final_powers("ga"), strict=True))
    won = sum(pso < ga for pso, ga in pairs)
    return decide(won == len(pairs), swarm=NAMES[swarm], won=won, pairs=len(pairs))


def _check_near_least(phase: PhaseFindings) -> Check:
    ends = {name: phase.final_powers(name) for name in phase.searches}
    above = {name: 100 * (float(np.mean(powers)) / min(powers) - 1) for name, powers in ends.items()}
    words = ", ".join(f"{NAMES[name]} {share:.2f} %" for name, share in above.items())
    return decide([above["ga"] < share for name, share in above.items() if name != "ga"], found=words)


def _check_alike(phase: PhaseFindings, swarm: str, first: int = 0, last: int = 9) -> Check:
    """Compare the variables of the median solutions from position ``first`` to before ``last``."""
    printed = [np.array(phase.paper.optima[name].x) for name in ALGORITHMS]
    ours = [np.array(list(phase.median(name).x.values())) for name in (swarm, "ga")]
    width = phase.problem.upper - phase.problem.lower
    apart = [100 * float((np.abs(a - b) / width)[first:last].max()) for a, b in (printed, ours)]
    return decide(apart[1] <= apart[0], swarm=NAMES[swarm], printed=apart[0], ours=apart[1])


def _check_statistic(phase: PhaseFindings) -> Check:
    printed, runs = phase.paper.test, 11
    variance = runs * runs * (2 * runs + 1) / 12
    z = (printed.rank_sum - runs * (2 * runs + 1) / 2 + 0.5) / math.sqrt(variance)
    p = math.erfc(abs(z) / math.sqrt(2))
    both = [printed.z, printed.p_two_sided, printed.p_less]
    return compare_levels(both, [z, p, p / 2], test=printed, z=z, p_both=p, p_less=p / 2)


def _check_steadier(phase: PhaseFindings, swarm: str) -> Check:
    powers = [np.array(phase.final_powers(name)) for name in (swarm, "ga")]
    pso, ga = (1000 * float(np.ptp(power)) for power in powers)
    p = approximate_rank_sum(*(np.abs(power - np.median(power)).tolist() for power in powers)).p_two_sided
    change = 100 * (pso / ga - 1)
    check = require_change(-change, swarm=NAMES[swarm], pso=pso, ga=ga, change=change, p=p)
    return claims.require_significance(check, "rank-sum test of distances from the median", p)


def _check_same_optimum(phase: PhaseFindings, swarm: str) -> Check:
    gaps = 100 * (np.array(phase.final_powers(swarm)) / phase.best - 1)
    within = gaps <= 100 * NEARLY_OPTIMAL
    best = [objective or math.inf for objective in phase.median(swarm).history.objective]
    reached = [k for k, power in enumerate(best, start=1) if power <= phase.best * (1 + NEARLY_OPTIMAL)]
    after = f"is within 1 % from generation {reached[0]} on" if reached else "is never within 1 %"
    ends = {"low": gaps.min(), "high": gaps.max(), "within": within.sum(), "runs": len(gaps), "after": after}
    return decide(bool(within.all()), swarm=NAMES[swarm], **ends)


def _check_at_bounds(phase: PhaseFindings, algorithm: str, ends: Mapping[str, int]) -> Check:
    """Check variables against their lower (0) or upper (1) bounds."""
    problem, x = phase.problem, phase.median(algorithm).x
    far = {}
    for name, end in ends.items():
        i = problem.names.index(name)
        share = (x[name] - problem.lower[i]) / (problem.upper[i] - problem.lower[i])
        far[f"x{i + 1}"] = 100 * abs(float(share) - end)
    words = ", ".join(f"{symbol} {share:.1f} %" for symbol, share in far.items())
    return compare_levels(np.zeros(len(far)), list(far.values()), search=NAMES[algorithm], found=words)


def _check_falling(phase: PhaseFindings, over: Literal["hip", "time"]) -> Check:
    sweep = [point for point in phase.sweeps[phase.paper.duration if over == "time" else 0] if point.feasible]
    prices = (bound.price for bound in phase.optimum.active_constraints if bound.name == "bounds[hip_height_m]")
    power = np.array([point.power_W for point in sweep])
    falls = bool(np.all(power[1:] <= power[:-1] * (1 + RIPPLE)))
    gain = 100 * (1 - power[-1] / power[0])
    values = {"gain": gain, "factor": power[0] / power[-1], "price": -next(prices, 0.0)}
    falling = "falling" if falls else "not falling"
    return require_change(gain if falls else -math.inf, first=sweep[0], last=sweep[-1], falling=falling, **values)


def _check_torque_change(phase: PhaseFindings, swarm: str) -> Check:
    ends = [[run.verdict.indexes["torque_change_Nm"] for run in phase.searches[name]] for name in (swarm, "ga")]
    middle = [phase.median(name).verdict.indexes["torque_change_Nm"] for name in (swarm, "ga")]
    printed = [phase.paper.optima[name].indexes["torque_change_Nm"] for name in ALGORITHMS]
    (pso, ga), p = (float(np.median(values)) for values in ends), approximate_rank_sum(*ends).p_two_sided
    leads = {"printed_lead": 100 * (printed[0] / printed[1] - 1), "lead": 100 * (pso / ga - 1)}
    check = compare_changes(*leads.values(), **leads, swarm=NAMES[swarm], pso=pso, ga=ga, middle=middle, p=p)
    return claims.require_significance(check, RANK_SUM, p)


def _check_swing_price(findings: NaoFindings, algorithm: str, height_m: float) -> Check:
    ssp, at = findings.ssp, PAPER.swing_heights_m.index(height_m)
    printed = SWING_POWER_W["ga" if algorithm == "ga" else "pso"]
    middle = ssp.list_swing_powers(algorithm)[at] / ssp.median(algorithm).verdict.objective
    every = ssp.list_swing_powers(algorithm, whole=True)[at] / min(ssp.final_powers(algorithm))
    rises = [100 * (power - 1) for power in (printed[height_m] / printed[0.015], middle, every)]
    true = 100 * (findings.swing_power(height_m) / findings.swing_power(0.015) - 1)
    return _compare_histories(compare_levels, *rises, search=NAMES[algorithm], height=height_m, true=true)


def _compare_histories(
    compare: Callable[..., Check], printed: float, middle: float, every: float, /, **values: Any
) -> Check:
    """Compare a change [%] with that in the median run's history, NaN where it holds no solution; tell that in all runs'."""
    values |= {"printed": printed, "middle": _describe_change(middle), "every": _describe_change(every)}
    return decide(ClaimVerdict.UNTESTABLE, **values) if math.isnan(middle) else compare(printed, middle, **values)


def _describe_change(change: float) -> str:
    return "none found" if math.isnan(change) else f"{change:+.1f} %"


def _check_swing_beyond(findings: NaoFindings) -> Check:
    low, high = findings.swing_power(0.024), findings.swing_power(0.028)
    return require_change(100 * (high / low - 1), low=low, high=high, rise=100 * (high / low - 1))


def _compute_swing_leads(phase: PhaseFindings, swarm: str) -> tuple[Array, Array]:
    """Return how much more GA needs near each swing height than a swarm, by the median runs and by all runs [%]."""
    ga, pso = ([phase.list_swing_powers(name, whole=whole) for whole in (False, True)] for name in ("ga", swarm))
    return 100 * (ga[0] / pso[0] - 1), 100 * (ga[1] / pso[1] - 1)


def _check_swing_heights(phase: PhaseFindings, swarm: str) -> Check:
    """Where a median run has no solution at a height, both outcomes are tried."""
    leads, texts = _compute_swing_leads(phase, swarm), []
    for row in leads:
        pairs = zip(row, PAPER.swing_heights_m, strict=True)
        texts.append(", ".join(f"{_describe_change(lead)} at {at:.3f} m" for lead, at in pairs))
    readings = [np.nan_to_num(leads[0], nan=end) for end in (math.inf, -math.inf)]
    return require_change(readings, swarm=NAMES[swarm], middle=texts[0], every=texts[1])


def _check_swing_lead(phase: PhaseFindings, swarm: str) -> Check:
    at = PAPER.swing_heights_m.index(0.024)
    printed = 100 * (SWING_POWER_W["ga"][0.024] / SWING_POWER_W["pso"][0.024] - 1)
    pso, ga = (f"{phase.list_swing_powers(name)[at]:.4f} W" for name in (swarm, "ga"))
    middle, every = (float(leads[at]) for leads in _compute_swing_leads(phase, swarm))
    return _compare_histories(compare_changes, printed, middle, every, swarm=NAMES[swarm], pso=pso, ga=ga)


def _compute_swing_range(phase: PhaseFindings, algorithm: str) -> float:
    """Return how much higher than its best solution a search's median run steps for at most 3 % more power [mm]."""
    points = phase.points[algorithm]
    own = points.run == phase.median_run(algorithm)
    cheap = own & (points.power_W <= 1.03 * points.power_W[own].min())
    return round(1000 * (float(points.x[cheap, SWING_HEIGHT].max()) - phase.median(algorithm).x["swing_height_m"]), 1)


def _check_swing_range(phase: PhaseFindings, algorithm: str, printed_mm: float) -> Check:
    values = {"search": NAMES[algorithm], "start": phase.median(algorithm).x["swing_height_m"], "printed": printed_mm}
    ours = _compute_swing_range(phase, algorithm)
    return compare_levels(printed_mm, ours, **values, ours=ours)


def _check_swing_range_lead(phase: PhaseFindings, swarm: str, printed_mm: float) -> Check:
    pso, ga = (_compute_swing_range(phase, name) for name in (swarm, "ga"))
    return compare_changes(printed_mm, pso - ga, swarm=NAMES[swarm], printed=printed_mm, pso=pso, ga=ga, lead=pso - ga)


def _check_velocity(phase: PhaseFindings, name: str) -> Check:
    printed = PAPER.velocity_ranges[name]
    symbols, chosen = {i: f"x{i + 1}" for i in printed.variables}, list(printed.variables)
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
    ends = np.concatenate([x[:, chosen] for x in phase.gather_solutions(whole=False).values()])
    values: dict[str, Any] = {"low": printed.low, "high": printed.high, "nearly": 100 * NEARLY_OPTIMAL}
    values |= {"symbols": " and ".join(symbols.values()), "near": ", ".join(near), "ends": (ends.min(), ends.max())}
    values["outside"] = f" (but {', '.join(outside)} in print)" if outside else ""

    def select(x: Array) -> Any:
        return (printed.low <= x[:, chosen]) & (x[:, chosen] <= printed.high)

    return _check_shares(phase, select, lambda shares: float(np.mean(shares)) >= MOST, **values)


def _check_signs(phase: PhaseFindings, signs: Mapping[str, int]) -> Check:
    columns, sign = [phase.problem.names.index(name) for name in signs], np.array(list(signs.values()))
    best = ", ".join(f"{phase.optimum.x[name]:z.4f}" for name in signs)
    return _check_shares(
        phase, lambda x: (sign * x[:, columns] > 0).all(axis=1), lambda shares: min(shares) > 0.5, best=best
    )


def _check_shares(
    phase: PhaseFindings, select: Callable[[Array], Any], is_most: Callable[[list[float]], bool], **values: Any
) -> Check:
    holds = []
    for key, whole in (("shares", False), ("whole", True)):
        shares = {name: float(select(x).mean()) for name, x in phase.gather_solutions(whole=whole).items()}
        values[key] = ", ".join(f"{NAMES[name]} {100 * share:.0f} %" for name, share in shares.items())
        holds.append(is_most([*shares.values()]))
    return decide(holds, **values, agree=holds[0] == holds[1])


def _check_lateral(phase: PhaseFindings, swarm: str) -> Check:

    def compute_ratio(x: Array) -> float:
        lateral = np.abs(x[:, 5:7])
        return float(np.median(lateral.max(axis=1) / lateral.min(axis=1)))

    pso, ga = (compute_ratio(phase.gather_solutions(whole=False)[name]) for name in (swarm, "ga"))
    printed = {name: compute_ratio(np.array([optimum.x])) for name, optimum in phase.paper.optima.items()}
    values = {"printed": printed, "pso": pso, "ga": ga, "most": 1.25 * printed["pso"]}
    return compare_levels(printed["pso"], pso, swarm=NAMES[swarm], **values)


def _check_wider(findings: NaoFindings, position: int, ranges: Sequence[str] = ()) -> Check:
    share, printed = 5 * NEARLY_OPTIMAL, [PAPER.velocity_ranges[name] for name in ranges]
    ssp, dsp = (float(np.ptp(phase.range_within(position, share))) for phase in findings.phases)
    values = {"share": 100 * share, "ssp": ssp, "dsp": dsp, "factor": dsp / ssp if ssp else math.inf}
    after = 100 * (values["factor"] - 1)
    if not printed:
        return require_change(after, **values)
    factor = (printed[1].high - printed[1].low) / (printed[0].high - printed[0].low)
    return compare_changes(100 * (factor - 1), after, **values, printed=factor)


def _check_gaps(phase: PhaseFindings) -> Check:
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
    feasible = [point.power_W for point in phase.sweeps[phase.paper.duration] if point.feasible]
    paces = max(feasible) / min(feasible)
    others = [100 * (here["power_W"] / phase.best - 1) for here in phase.printed_here.values()]
    return decide(paces - 1 >= 2 * max(others) / 100, paces=paces, others=others)


def _check_exponential(findings: NaoFindings) -> Check:
    time, power = np.array([(point.at, point.power_W) for point in findings.durations if point.feasible]).T
    exponential, law = (float(np.corrcoef(x, np.log(power))[0, 1] ** 2) for x in (time, np.log(time)))
    rates = -np.diff(np.log(power)) / np.diff(time)
    return decide(exponential > law, exponential=exponential, law=law, fast=rates[0], slow=rates[-1])


def _check_dearer(phase: PhaseFindings, positions: Sequence[int], beyond: float) -> Check:
    dearer = []
    for position in positions:
        powers = [point.power_W for point in phase.sweeps[position] if point.feasible and abs(point.at) > beyond]
        dearer.append(100 * (min(powers) / phase.best - 1) if powers else math.inf)
    words = ", ".join("none feasible" if math.isinf(value) else f"{value:.2f} %" for value in dearer)
    return require_change(dearer, found=words)


def _check_near_zero(phase: PhaseFindings) -> Check:
    x6 = np.concatenate([points.x[:, 5] for points in phase.points.values()])
    printed = PAPER.velocity_ranges["lateral-velocity-dsp"]
    near, within = np.mean((x6 > printed.high) & (x6 <= 0)), np.mean((printed.low <= x6) & (x6 <= printed.high))
    density = (near / -printed.high) / (within / (printed.high - printed.low)) if within else math.inf
    return require_change(100 * (1 - density), near=100 * near, within=100 * within, density=density)


def _check_positive(phase: PhaseFindings) -> Check:
    every = phase.points.values()
    positive = np.concatenate([points.power_W[points.x[:, 5] > 0] for points in every])
    change = 100 * (positive.min() / phase.best - 1) if len(positive) else -math.inf
    words = f"the cheapest costs {change:.0f} % more" if len(positive) else "none"
    return require_change(change, words=words, share=100 * len(positive) / sum(len(points.x) for points in every))


def _check_speeds(findings: NaoFindings, by: Literal["fastest", "ratio", "difference"]) -> Check:
    ends = []
    for phase in findings.phases:
        times = [point.at for point in phase.sweeps[phase.paper.duration] if point.feasible]
        hip = phase.sample_printed().arrays["hip"]
        ends.append([float(hip[-1, 0] - hip[0, 0]) / time for time in (min(times), max(times))])
    fast, slow = np.array(ends).T
    speeds = {"fastest": fast, "ratio": fast / slow, "difference": fast - slow}[by]
    change = 100 * (speeds[1] / max(speeds[0], 1e-9) - 1)
    ssp = findings.ssp
    shortest = min(point.at for point in ssp.sweeps[ssp.paper.duration] if point.feasible)
    is_at_bound = shortest <= 1.001 * ssp.problem.lower[ssp.paper.duration]
    check = require_change(change, speeds=speeds, ranges=fast / slow, change=change)
    return decide(ClaimVerdict.UNTESTABLE, **check.values) if change > 0 and is_at_bound else check


def _check_same_median(phase: PhaseFindings, swarm: str) -> Check:
    pso, ga = phase.median_run(swarm), phase.median_run("ga")
    return decide(pso == ga, swarm=NAMES[swarm], pso=pso, ga=ga)
