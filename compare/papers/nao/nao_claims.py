"""Checks of the NAO paper's claims against our numbers, by id in ``nao_claims.toml``."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from compare.analysis.statistics.inference import a12
from compare.papers.claims import SIGNIFICANT, Check, decide
from compare.papers.nao.nao_findings import NaoFindings, PhaseFindings
from compare.papers.nao.nao_paper import DSP, PAPER, SSP, SWING_POWER_W, PrintedPhase, VelocityRange
from compare.papers.nao.nao_runs import ALGORITHMS

# A solution that costs this share more than the optimum is as good for a walker.
NEARLY_OPTIMAL = 0.01
# A curve that rises by less than this share of itself between two points counts as falling: IPOPT's local optima differ so.
RIPPLE = 1e-3


def _check_better(phase: PhaseFindings) -> Check:
    pso, ga = phase.final_powers("pso"), phase.final_powers("ga")
    test, effect, of_pso, of_ga = phase.test, a12(pso, ga), np.median(pso), np.median(ga)
    return decide(
        test.p_less < SIGNIFICANT,
        test=test,
        effect=effect,
        wins=100 * effect,
        pso=of_pso,
        ga=of_ga,
        best=phase.best,
        best_run=min(pso + ga),
        lead=100 * (of_ga / of_pso - 1),
        one_sided="" if test.p_two_sided < SIGNIFICANT else ", significantly in the one-sided test only",
    )


def _check_steadier(phase: PhaseFindings) -> Check:
    pso, ga = (1000 * float(np.ptp(phase.final_powers(name))) for name in ALGORITHMS)
    return decide(pso < ga, pso=pso, ga=ga, factor=ga / pso if pso else math.inf)


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
    values |= {"gain": 100 * (1 - power[-1] / power[0]), "factor": power[0] / power[-1]}
    return decide(falls, first=sweep[0], last=sweep[-1], falling="falling" if falls else "not falling", **values)


def _check_torque_change(phase: PhaseFindings, lower: str, higher: str) -> Check:
    medians = {name: phase.median_index(name, "torque_change_Nm") for name in ALGORITHMS}
    share = medians[lower] / medians[higher]
    return decide(share < 1, **medians, gain=100 * (1 - share))


def _check_swing_plateau(findings: NaoFindings) -> Check:
    low, high = findings.swing_power(0.015), findings.swing_power(0.024)
    return decide(True, low=low, high=high, rise=100 * (high / low - 1))


def _check_swing_rise(findings: NaoFindings) -> Check:
    high = findings.swing_power(0.028)
    rise = 100 * (high / findings.swing_power(0.015) - 1)
    printed = [100 * (SWING_POWER_W[name][0.028] / SWING_POWER_W[name][0.015] - 1) for name in ALGORITHMS]
    return decide(rise > min(printed) / 2, rise=rise, high=high, printed=printed)


def _check_velocity(phase: PhaseFindings, printed: VelocityRange) -> Check:
    symbols = [f"x{i + 1}" for i in printed.variables]
    names = [phase.problem.names[i] for i in printed.variables]
    optimum = np.array([phase.optimum.x[name] for name in names])
    ends = np.array([[run.x[name] for name in names] for runs in phase.searches.values() for run in runs])
    near = [
        f"{symbol} = {best:z.4f} ({low:z.4f} to {high:z.4f})"
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


def _check_wider(findings: NaoFindings) -> Check:
    share = 5 * NEARLY_OPTIMAL
    ssp, dsp = ([float(np.ptp(phase.range_within(i, share))) for i in (3, 4)] for phase in findings.phases)
    factor = sum(dsp) / sum(ssp) if any(ssp) else math.inf
    return decide(sum(dsp) > sum(ssp), share=100 * share, ssp=ssp, dsp=dsp, factor=factor)


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
    "torque-change-ssp": _in(SSP, partial(_check_torque_change, lower="pso", higher="ga")),
    "torque-change-dsp": _in(DSP, partial(_check_torque_change, lower="ga", higher="pso")),
    "swing-plateau": _check_swing_plateau,
    "swing-rise": _check_swing_rise,
    "wider": _check_wider,
    "gaps": _in(DSP, _check_gaps),
}
for _suffix, _phase in (("ssp", SSP), ("dsp", DSP)):
    CHECKS[f"better-{_suffix}"] = _in(_phase, _check_better)
    CHECKS[f"steadier-{_suffix}"] = _in(_phase, _check_steadier)
    CHECKS[f"higher-hip-{_suffix}"] = _in(_phase, _check_higher_hip)
    CHECKS[f"slower-{_suffix}"] = _in(_phase, _check_slower)
for _id, _range in PAPER.velocity_ranges.items():
    CHECKS[_id] = _in(SSP if _range.phase == "ssp" else DSP, partial(_check_velocity, printed=_range))
