"""Claims of the NAO paper, each checked against our numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.analysis.statistics.inference import a12
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings
from compare.papers.nao.nao_paper import SWING_POWER_W, VELOCITY_RANGES, VelocityRange
from compare.papers.nao.nao_runs import ALGORITHMS, SweepPoint
from compare.papers.reproduction import SIGNIFICANT, Claim, check_claim

# A solution that costs this share more than the optimum is as good for a walker.
NEARLY_OPTIMAL = 0.01
# A curve that rises by less than this share of itself between two points counts as falling: IPOPT's local optima differ so.
RIPPLE = 1e-3


def check_claims(findings: NaoFindings) -> list[Claim]:
    """Return all claims, in the order of the paper."""
    ssp, dsp = findings.phases
    claims = [
        check(phase) for phase in findings.phases for check in (_check_better, _check_steadier, _check_higher_hip)
    ]
    claims += [_check_torque_change(ssp, "5.1.1", "pso", "ga", "13 % lower")]
    claims += [_check_swing_plateau(findings), _check_swing_rise(findings)]
    claims += [_check_slower(phase) for phase in findings.phases]
    claims += [_check_velocity(findings, printed) for printed in VELOCITY_RANGES]
    claims += [_check_wider(findings), _check_torque_change(dsp, "5.2.1", "ga", "pso", "3 % lower"), _check_gaps(dsp)]
    return sorted(claims, key=lambda claim: [int(number) for number in claim.where.split(".")])


def _check_better(phase: PhaseFindings) -> Claim:
    pso, ga = phase.final_powers("pso"), phase.final_powers("ga")
    test, effect = phase.test, a12(pso, ga)
    one_sided = "" if test.p_two_sided < SIGNIFICANT else ", significantly in the one-sided test only"
    lead = 100 * (np.median(ga) / np.median(pso) - 1)
    return check_claim(
        test.p_less < SIGNIFICANT,
        where=phase.paper.better,
        text=f"PSO is better than GA in {phase.paper.title}",
        found=f"W = {test.rank_sum:.0f}, z = {test.z:.3f}, p = {test.p_two_sided:.3g} (two-sided), {test.p_less:.3g} "
        f"(left-tailed); A12 = {effect:.2f}: PSO wins {100 * effect:.0f} % of all pairs of runs. Medians "
        f"{np.median(pso):.5f} W and {np.median(ga):.5f} W; IPOPT {phase.best:.5f} W, the best of all runs "
        f"{min(pso + ga):.5f} W",
        detail=f"in our model by {lead:.2f} % of the median power{one_sided}",
    )


def _check_steadier(phase: PhaseFindings) -> Claim:
    pso, ga = (float(np.ptp(phase.final_powers(name))) for name in ALGORITHMS)
    return check_claim(
        pso < ga,
        where=phase.paper.steadier,
        text=f"PSO's runs differ less from each other than GA's in {phase.paper.title}",
        found=f"from best to worst of the runs {1000 * pso:.2f} mW for PSO, {1000 * ga:.2f} mW for GA",
        detail=f"in our model by a factor of {ga / pso:.1f}" if pso else "",
    )


def _check_higher_hip(phase: PhaseFindings) -> Claim:
    sweep, falls, how = _follow(phase, 0)
    low, high = sweep[0], sweep[-1]
    prices = (bound.price for bound in phase.optimum.active_constraints if bound.name == "bounds[hip_height_m]")
    return check_claim(
        falls,
        where=phase.paper.higher_hip,
        text=f"A higher hip saves power in {phase.paper.title}",
        found=f"optimum {low.power_W:.4f} W with the hip at {low.at:.4f} m, {high.power_W:.4f} W at {high.at:.4f} m, {how}; "
        f"at the upper bound one millimetre more is worth {-next(prices, 0.0):z.2f} mW",
        detail=f"in our model by {100 * (1 - high.power_W / low.power_W):.0f} %",
    )


def _check_slower(phase: PhaseFindings) -> Claim:
    sweep, falls, how = _follow(phase, phase.paper.duration)
    fast, slow = sweep[0], sweep[-1]
    return check_claim(
        falls,
        where=phase.paper.slower,
        text=f"Slower saves power in {phase.paper.title}",
        found=f"optimum {fast.power_W:.4f} W in {fast.at:.2f} s, {slow.power_W:.4f} W in {slow.at:.2f} s, {how}",
        detail=f"in our model by a factor of {fast.power_W / slow.power_W:.1f}",
    )


def _follow(phase: PhaseFindings, position: int) -> tuple[Sequence[SweepPoint], bool, str]:
    """Feasible optima over a variable, and whether they fall."""
    sweep = [point for point in phase.sweeps[position] if point.feasible]
    power = np.array([point.power_W for point in sweep])
    falls = bool(np.all(power[1:] <= power[:-1] * (1 + RIPPLE)))
    return sweep, falls, "falling all the way" if falls else "not falling all the way"


def _check_torque_change(phase: PhaseFindings, where: str, lower: str, higher: str, printed: str) -> Claim:
    medians = {name: phase.median_index(name, "torque_change_Nm") for name in ALGORITHMS}
    share = medians[lower] / medians[higher]
    return check_claim(
        share < 1,
        where=where,
        text=f"{NAMES[lower]}'s solution has a lower torque change than {NAMES[higher]}'s in {phase.paper.title}",
        printed=printed,
        found=f"medians over all runs PSO {medians['pso']:.4f} Nm, GA {medians['ga']:.4f} Nm; no solver minimises it, "
        "it is only limited",
        detail=f"in our model by {100 * (1 - share):.0f} %",
    )


def _check_swing_plateau(findings: NaoFindings) -> Claim:
    low, high = _swing_power(findings, 0.015), _swing_power(findings, 0.024)
    return check_claim(
        True,
        where="5.1.5",
        text="A swing height of 0.024 m costs more than one of 0.015 m",
        printed="2.6 % (PSO), 27.9 % (GA)",
        found=f"optimum {low:.5f} W at 0.015 m, {high:.5f} W at 0.024 m; the difference between PSO and GA is one of search "
        "histories, not of gaits",
        detail=f"in our model by {100 * (high / low - 1):z.1f} %, whatever the solver",
    )


def _check_swing_rise(findings: NaoFindings) -> Claim:
    rise = 100 * (_swing_power(findings, 0.028) / _swing_power(findings, 0.015) - 1)
    printed = [100 * (SWING_POWER_W[name][0.028] / SWING_POWER_W[name][0.015] - 1) for name in ALGORITHMS]
    return check_claim(
        rise > min(printed) / 2,
        where="5.1.5",
        text="Beyond 0.024 m power rises steeply",
        printed=f"at 0.028 m by {printed[0]:.0f} % (PSO) and {printed[1]:.0f} % (GA)",
        found=f"the true price of 0.028 m is {rise:.1f} % ({_swing_power(findings, 0.028):.5f} W); the printed rise is read "
        "off search histories, which hold few and poor solutions there (see the table of swing heights)",
        detail=f"in our model by {rise:z.1f} %",
    )


def _swing_power(findings: NaoFindings, height: float) -> float:
    return next(point.power_W for point in findings.swing if point.at == height)


def _check_velocity(findings: NaoFindings, printed: VelocityRange) -> Claim:
    phase = next(p for p in findings.phases if p.paper is printed.phase)
    symbols = [f"x{i + 1}" for i in printed.variables]
    names = [phase.problem.names[i] for i in printed.variables]
    optimum = np.array([phase.optimum.x[name] for name in names])
    ends = np.array([[run.x[name] for name in names] for runs in phase.searches.values() for run in runs])
    within = 100 * float(np.mean((printed.low <= ends) & (ends <= printed.high)))
    ranges = [phase.range_within(i, NEARLY_OPTIMAL) for i in printed.variables]
    near = ", ".join(
        f"{name} = {best:z.4f} ({low:z.4f} to {high:z.4f})"
        for name, best, (low, high) in zip(symbols, optimum, ranges, strict=True)
    )
    return check_claim(
        bool(np.all((printed.low <= optimum) & (optimum <= printed.high))),
        where=printed.section,
        text=f"In {phase.paper.title} the solutions have {' and '.join(symbols)} in this range",
        printed=f"{printed.low:g} to {printed.high:g} m/s",
        found=f"IPOPT's optimum, and where it costs less than {100 * NEARLY_OPTIMAL:.0f} % more: {near} m/s; the runs end "
        f"between {ends.min():z.4f} and {ends.max():z.4f} m/s, {within:.0f} % of the values within the range",
        detail=f"in our model by {within:.0f} % of the values at the ends of all runs",
    )


def _check_wider(findings: NaoFindings) -> Claim:
    share = 5 * NEARLY_OPTIMAL
    ssp, dsp = ([np.ptp(phase.range_within(i, share)) for i in (3, 4)] for phase in findings.phases)
    return check_claim(
        sum(dsp) > sum(ssp),
        where="5.2.3",
        text="Double support leaves a wider range of sagittal velocities than single support",
        found=f"within {100 * share:.0f} % of the least power, start and end velocity may vary by {dsp[0]:.3f} and {dsp[1]:.3f} "
        f"m/s in double support, {ssp[0]:.3f} and {ssp[1]:.3f} m/s in single support",
        detail=f"in our model by a factor of {sum(dsp) / sum(ssp):.1f}" if any(ssp) else "",
    )


def _check_gaps(phase: PhaseFindings) -> Claim:
    durations = phase.sweeps[phase.paper.duration]
    missing = [f"{point.at:.2f} s" for point in durations if not point.feasible]
    everywhere = (
        f"IPOPT finds a feasible optimum at each of {len(durations)} durations from {durations[0].at:.2f} to "
        f"{durations[-1].at:.2f} s; gaps in the picture are gaps of the search"
    )
    return check_claim(
        bool(missing),
        where="5.2.5",
        text="For some durations of double support there is no solution that keeps the mean balance margin",
        found=f"none is found at {', '.join(missing)}" if missing else everywhere,
    )
