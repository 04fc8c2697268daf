"""Checks of the NAO paper's claims about searches and power, by id in ``nao_claims.toml``; others are in ``nao_gait_claims.py``.

Claims about PSO are checked twice: with the constant inertia weight that the paper prints (the id) and with the damping of the
code that it cites (the id with ``-damped``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

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
from compare.papers.nao.nao_gait_claims import GAIT_CHECKS
from compare.papers.nao.nao_paper import DSP, PAPER, SSP, SWING_HEIGHT, SWING_POWER_W, PrintedPhase, VelocityRange
from compare.papers.nao.nao_runs import ALGORITHMS

# A solution that costs this share more than the optimum is as good for a walker.
NEARLY_OPTIMAL = 0.01
# A curve that rises by less than this share of itself between two points counts as falling: IPOPT's local optima differ so.
RIPPLE = 1e-3
SWARMS = {"": "pso-constant", "-damped": "pso"}  # by end of the id
RANK_SUM = "rank-sum test"


def _check_better(phase: PhaseFindings, swarm: str) -> Check:
    pso, ga = phase.final_powers(swarm), phase.final_powers("ga")
    test, effect, of_pso, of_ga = phase.test(swarm), a12(pso, ga), np.median(pso), np.median(ga)
    printed = {name: phase.paper.optima[name].power_W for name in ALGORITHMS}
    printed_lead, lead = (100 * (b / a - 1) for a, b in ((printed["pso"], printed["ga"]), (of_pso, of_ga)))
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
    )
    return require_significance(check, RANK_SUM, test.p_two_sided)


def _check_statistic(phase: PhaseFindings) -> Check:
    printed, runs = phase.paper.test, 11
    variance = runs * runs * (2 * runs + 1) / 12
    z = (printed.rank_sum - runs * (2 * runs + 1) / 2 + 0.5) / math.sqrt(variance)
    p = math.erfc(abs(z) / math.sqrt(2))
    return compare_levels([printed.z, printed.p_two_sided], [z, p], test=printed, z=z, p=p)


def _check_steadier(phase: PhaseFindings, swarm: str) -> Check:
    pso, ga = (1000 * float(np.ptp(phase.final_powers(name))) for name in (swarm, "ga"))
    return require_change(100 * (1 - pso / ga), swarm=NAMES[swarm], pso=pso, ga=ga, change=100 * (pso / ga - 1))


def _check_same_optimum(phase: PhaseFindings, swarm: str) -> Check:
    gaps = 100 * (np.array(phase.final_powers(swarm)) / phase.best - 1)
    return decide(bool(np.all(gaps <= 100 * NEARLY_OPTIMAL)), swarm=NAMES[swarm], low=gaps.min(), high=gaps.max())


def _check_higher_hip(phase: PhaseFindings) -> Check:
    prices = (bound.price for bound in phase.optimum.active_constraints if bound.name == "bounds[hip_height_m]")
    return _check_falling(phase, 0, price=-next(prices, 0.0))


def _check_slower(phase: PhaseFindings) -> Check:
    return _check_falling(phase, phase.paper.duration)


def _check_falling(phase: PhaseFindings, position: int, **values: float) -> Check:
    """Check whether the feasible optima over a variable fall."""
    sweep = [point for point in phase.sweeps[position] if point.feasible]
    power = np.array([point.power_W for point in sweep])
    falls = bool(np.all(power[1:] <= power[:-1] * (1 + RIPPLE)))
    gain = 100 * (1 - power[-1] / power[0])
    values |= {"gain": gain, "factor": power[0] / power[-1]}
    falling = "falling" if falls else "not falling"
    return require_change(gain if falls else -math.inf, first=sweep[0], last=sweep[-1], falling=falling, **values)


def _check_torque_change(phase: PhaseFindings, swarm: str) -> Check:
    """Check PSO's median against GA's over the final solutions of all runs."""
    pso, ga = ([run.verdict.indexes["torque_change_Nm"] for run in phase.searches[name]] for name in (swarm, "ga"))
    printed = _compute_lead({name: phase.paper.optima[name].indexes["torque_change_Nm"] for name in ALGORITHMS})
    ours = _compute_lead({"pso": float(np.median(pso)), "ga": float(np.median(ga))})
    values = {"pso": np.median(pso), "ga": np.median(ga), "printed_lead": printed, "lead": ours}
    check = compare_changes(printed, ours, swarm=NAMES[swarm], **values)
    return require_significance(check, RANK_SUM, rank_sum_normal(pso, ga).p_two_sided)


def _compute_lead(values: dict[str, float]) -> float:
    """Return how much PSO's value is above GA's [%]."""
    return 100 * (values["pso"] / values["ga"] - 1)


def _check_swing_price(findings: NaoFindings, algorithm: str, height_m: float) -> Check:
    low, high = findings.swing_power(0.015), findings.swing_power(height_m)
    printed = 100 * (SWING_POWER_W[algorithm][height_m] / SWING_POWER_W[algorithm][0.015] - 1)
    ours = 100 * (high / low - 1)
    return compare_changes(printed, ours, low=low, high=high, rise=ours, printed_rise=printed)


def _check_swing_lead(phase: PhaseFindings, swarm: str) -> Check:
    """Check GA's power at 0.024 m above PSO's, as read off the histories of all runs."""
    printed = 100 * (SWING_POWER_W["ga"][0.024] / SWING_POWER_W["pso"][0.024] - 1)
    pso, ga = (phase.points[name].cheapest_near(SWING_HEIGHT, 0.024, 5e-4) for name in (swarm, "ga"))
    cheapest = ["none" if math.isnan(power) else f"{power:.4f} W" for power in (pso, ga)]
    values = {"swarm": NAMES[swarm], "pso": cheapest[0], "ga": cheapest[1], "printed_lead": printed}
    if "none" in cheapest:
        return decide(Verdict.UNTESTABLE, **values)
    return compare_changes(printed, 100 * (ga / pso - 1), **values)


def _check_swing_range(phase: PhaseFindings, algorithm: str, printed_mm: float) -> Check:
    """Check how much higher than 0.015 m a search's median run steps for at most 3 % more power than its best."""
    points, run = phase.points[algorithm], phase.median_run(algorithm)
    own = points.run == run
    cheap = own & (points.power_W <= 1.03 * points.power_W[own].min())
    ours = 1000 * (float(points.x[cheap, SWING_HEIGHT].max()) - 0.015)
    return compare_changes(printed_mm, round(ours, 1), search=NAMES[algorithm], ours=ours, printed=printed_mm)


def _check_velocity(phase: PhaseFindings, printed: VelocityRange) -> Check:
    symbols = [f"x{i + 1}" for i in printed.variables]
    names = [phase.problem.names[i] for i in printed.variables]
    optimum = np.array([phase.optimum.x[name] for name in names])
    ends = np.array([[run.x[name] for name in names] for runs in phase.searches.values() for run in runs])
    near = [
        f"{symbol} = {best:z.4f} ({f'{low:z.4f} to {high:z.4f}' if math.isfinite(low) else 'no point of the sweep'})"
        for symbol, best, (low, high) in zip(
            symbols, optimum, (phase.range_within(i, NEARLY_OPTIMAL) for i in printed.variables), strict=True
        )
    ]
    return decide(
        bool(np.all((printed.low <= optimum) & (optimum <= printed.high))),
        symbols=" and ".join(symbols),
        low=printed.low,
        high=printed.high,
        nearly=100 * NEARLY_OPTIMAL,
        near=", ".join(near),
        ends=(ends.min(), ends.max()),
        within=100 * float(np.mean((printed.low <= ends) & (ends <= printed.high))),
    )


def _check_lateral(phase: PhaseFindings, swarm: str) -> Check:
    printed = phase.paper.optima["pso"].x
    ratios = [abs(run.x["hip_vy_start_m_s"] / run.x["hip_vy_end_m_s"]) for run in phase.searches[swarm]]
    ours, of_ga = float(np.median(ratios)), phase.paper.optima["ga"].x
    best = abs(phase.optimum.x["hip_vy_start_m_s"] / phase.optimum.x["hip_vy_end_m_s"])
    values = {
        "ratio": ours,
        "printed": abs(printed[5] / printed[6]),
        "printed_ga": abs(of_ga[5] / of_ga[6]),
        "best": best,
    }
    return compare_levels(values["printed"], ours, swarm=NAMES[swarm], **values)


def _check_wider(findings: NaoFindings) -> Check:
    share = 5 * NEARLY_OPTIMAL
    ssp, dsp = ([float(np.ptp(phase.range_within(i, share))) for i in (3, 4)] for phase in findings.phases)
    factor = sum(dsp) / sum(ssp) if any(ssp) else math.inf if any(dsp) else 1.0
    return require_change(100 * (factor - 1), share=100 * share, ssp=ssp, dsp=dsp, factor=factor)


def _check_gaps(phase: PhaseFindings) -> Check:
    durations = phase.sweeps[phase.paper.duration]
    missing = [f"{point.at:.2f} s" for point in durations if not point.feasible]
    found = (
        f"IPOPT finds a feasible optimum at each of {len(durations)} durations from {durations[0].at:.2f} to "
        f"{durations[-1].at:.2f} s; gaps in the picture are gaps of the search"
    )
    return decide(bool(missing), found=f"none is found at {', '.join(missing)}" if missing else found)


def _in(printed: PrintedPhase, check: Callable[[PhaseFindings], Check]) -> Callable[[NaoFindings], Check]:
    """Return the check of one phase as a check of all findings."""
    return lambda findings: check(findings.ssp if printed is SSP else findings.dsp)


CHECKS: dict[str, Callable[[NaoFindings], Check]] = {
    "swing-plateau": partial(_check_swing_price, algorithm="pso", height_m=0.024),
    "swing-plateau-ga": partial(_check_swing_price, algorithm="ga", height_m=0.024),
    "swing-rise": partial(_check_swing_price, algorithm="pso", height_m=0.028),
    "swing-rise-ga": partial(_check_swing_price, algorithm="ga", height_m=0.028),
    "swing-range-ga": _in(SSP, partial(_check_swing_range, algorithm="ga", printed_mm=2.0)),
    "wider": _check_wider,
    "gaps": _in(DSP, _check_gaps),
    **GAIT_CHECKS,
}
for _suffix, _phase in (("ssp", SSP), ("dsp", DSP)):
    CHECKS[f"statistic-{_suffix}"] = _in(_phase, _check_statistic)
    CHECKS[f"higher-hip-{_suffix}"] = _in(_phase, _check_higher_hip)
    CHECKS[f"slower-{_suffix}"] = _in(_phase, _check_slower)
    for _end, _swarm in SWARMS.items():
        CHECKS[f"better-{_suffix}{_end}"] = _in(_phase, partial(_check_better, swarm=_swarm))
        CHECKS[f"steadier-{_suffix}{_end}"] = _in(_phase, partial(_check_steadier, swarm=_swarm))
        CHECKS[f"run-torque-change-{_suffix}{_end}"] = _in(_phase, partial(_check_torque_change, swarm=_swarm))
for _end, _swarm in SWARMS.items():
    CHECKS[f"same-optimum{_end}"] = _in(SSP, partial(_check_same_optimum, swarm=_swarm))
    CHECKS[f"swing-lead{_end}"] = _in(SSP, partial(_check_swing_lead, swarm=_swarm))
    CHECKS[f"swing-range{_end}"] = _in(SSP, partial(_check_swing_range, algorithm=_swarm, printed_mm=9.0))
    CHECKS[f"lateral-equal{_end}"] = _in(SSP, partial(_check_lateral, swarm=_swarm))
for _id, _range in PAPER.velocity_ranges.items():
    CHECKS[_id] = _in(SSP if _range.phase == "ssp" else DSP, partial(_check_velocity, printed=_range))
