"""The NAO paper's own claims, each held against what is found here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compare.analysis.statistics.inference import a12
from compare.papers.nao.nao_findings import Findings, PhaseFindings
from compare.papers.nao.nao_paper import SWING_POWER_W, VELOCITY_RANGES, VelocityRange
from compare.papers.nao.nao_runs import ALGORITHMS, Held

SIGNIFICANT = 0.05
# A solution that costs this share more than the optimum is as good for a walker.
NEARLY_OPTIMAL = 0.01
# A curve that rises by less than this share of itself between two points counts as falling: IPOPT's local optima differ so.
RIPPLE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A claim of the paper: where it stands, what it says, what is found here."""

    section: str
    text: str
    verdict: str
    evidence: str


HOLDS, FAILS = "holds", "does not hold"


def claims(findings: Findings) -> list[Claim]:
    """All claims, in the order of the paper."""
    ssp, dsp = findings.phases
    found = [claim for phase in findings.phases for claim in (_better(phase), _steadier(phase), _higher_hip(phase))]
    found += [_torque_change(ssp, "13 %"), _swing_plateau(findings), _swing_rise(findings)]
    found += [_slower(phase) for phase in findings.phases]
    found += [_velocity(findings, claimed) for claimed in VELOCITY_RANGES]
    found += [_wider(findings), *_double_support(dsp)]
    return sorted(found, key=lambda claim: tuple(int(part) for part in claim.section.split(".")))


def _better(phase: PhaseFindings) -> Claim:
    pso, ga = phase.final_powers("pso"), phase.final_powers("ga")
    test, effect = phase.test, a12(pso, ga)
    one_sided = "" if test.p_two_sided < SIGNIFICANT else ", significantly in the one-sided test only"
    lead = 100 * (np.median(ga) / np.median(pso) - 1)
    return Claim(
        section="5.3.1" if phase.paper.problem == "nao-ssp" else "5.3.2",
        text=f"PSO is better than GA in {phase.paper.title}",
        verdict=f"holds in our model by {lead:.2f} % of the median power{one_sided}"
        if test.p_less < SIGNIFICANT
        else FAILS,
        evidence=f"W = {test.rank_sum:.0f}, z = {test.z:.3f}, p = {test.p_two_sided:.3g} (two-sided), {test.p_less:.3g} "
        f"(left-tailed); A12 = {effect:.2f}: PSO wins {100 * effect:.0f} % of all pairs of runs. Medians {np.median(pso):.5f} W "
        f"and {np.median(ga):.5f} W; IPOPT {phase.best:.5f} W, the best of all runs {min(pso + ga):.5f} W",
    )


def _steadier(phase: PhaseFindings) -> Claim:
    pso, ga = (float(np.ptp(phase.final_powers(name))) for name in ALGORITHMS)
    return Claim(
        section="5.1" if phase.paper.problem == "nao-ssp" else "5.2",
        text=f"PSO's runs differ less from each other than GA's in {phase.paper.title}",
        verdict=f"holds in our model by a factor of {ga / pso:.1f}" if pso < ga else FAILS,
        evidence=f"from best to worst of the runs {1000 * pso:.2f} mW for PSO, {1000 * ga:.2f} mW for GA",
    )


def _higher_hip(phase: PhaseFindings) -> Claim:
    sweep = [point for point in phase.sweeps[0] if point.feasible]
    low, high = sweep[0], sweep[-1]
    saved = 100 * (1 - high.power_W / low.power_W)
    price = next(
        (bound.price for bound in phase.optimum.active_constraints if bound.name == "bounds[hip_height_m]"), 0.0
    )
    return Claim(
        section="5.1.2" if phase.paper.problem == "nao-ssp" else "5.2.2",
        text=f"A higher hip saves power in {phase.paper.title}",
        verdict=f"holds in our model by {saved:.0f} %" if _falls(sweep) else FAILS,
        evidence=f"optimum {low.power_W:.4f} W with the hip at {low.at:.4f} m, {high.power_W:.4f} W at "
        f"{high.at:.4f} m, {'falling all the way' if _falls(sweep) else 'not falling all the way'}; at the upper bound "
        f"one millimetre more is worth {-price:z.2f} mW",
    )


def _slower(phase: PhaseFindings) -> Claim:
    sweep = [point for point in phase.sweeps[phase.paper.duration] if point.feasible]
    fast, slow = sweep[0], sweep[-1]
    return Claim(
        section="5.1.6" if phase.paper.problem == "nao-ssp" else "5.2.5",
        text=f"Slower saves power in {phase.paper.title}",
        verdict=f"holds in our model by a factor of {fast.power_W / slow.power_W:.1f}" if _falls(sweep) else FAILS,
        evidence=f"optimum {fast.power_W:.4f} W in {fast.at:.2f} s, {slow.power_W:.4f} W in {slow.at:.2f} s"
        + (", falling all the way" if _falls(sweep) else ", not falling all the way"),
    )


def _falls(sweep: Sequence[Held]) -> bool:
    power = np.array([point.power_W for point in sweep])
    return bool(np.all(power[1:] <= power[:-1] * (1 + RIPPLE)))


def _torque_change(phase: PhaseFindings, claimed: str) -> Claim:
    pso, ga = (phase.median_index(name, "torque_change_Nm") for name in ALGORITHMS)
    return Claim(
        section="5.1.1",
        text=f"PSO's solution has a torque change {claimed} lower than GA's in single support",
        verdict=f"holds in our model by {100 * (1 - pso / ga):.0f} %" if pso < ga else FAILS,
        evidence=f"medians over all runs PSO {pso:.4f} Nm, GA {ga:.4f} Nm; nobody minimises it, it is only limited",
    )


def _swing_power(findings: Findings, height: float) -> float:
    return next(point.power_W for point in findings.swing if point.at == height)


def _swing_plateau(findings: Findings) -> Claim:
    price = 100 * (_swing_power(findings, 0.024) / _swing_power(findings, 0.015) - 1)
    return Claim(
        section="5.1.5",
        text="A swing height of 0.024 m costs 2.6 % more than one of 0.015 m (PSO; 27.9 % with GA)",
        verdict=f"holds in our model by {price:z.1f} %, whatever the algorithm",
        evidence=f"optimum {_swing_power(findings, 0.015):.5f} W at 0.015 m, {_swing_power(findings, 0.024):.5f} W at 0.024 m; "
        "the difference between PSO and GA is one of search histories, not of gaits",
    )


def _swing_rise(findings: Findings) -> Claim:
    true = 100 * (_swing_power(findings, 0.028) / _swing_power(findings, 0.015) - 1)
    claimed = [100 * (SWING_POWER_W[name][0.028] / SWING_POWER_W[name][0.015] - 1) for name in ALGORITHMS]
    steep = true > min(claimed) / 2
    return Claim(
        section="5.1.5",
        text=f"Beyond 0.024 m power rises steeply: at 0.028 m by {claimed[0]:.0f} % (PSO) and {claimed[1]:.0f} % (GA)",
        verdict=f"holds in our model by {true:z.1f} %" if steep else FAILS,
        evidence=f"the true price of 0.028 m is {true:.1f} % ({_swing_power(findings, 0.028):.5f} W); the printed rise is read "
        "off search histories, which hold few and poor solutions there (see the table of swing heights)",
    )


def _velocity(findings: Findings, claimed: VelocityRange) -> Claim:
    phase = next(p for p in findings.phases if p.paper is claimed.phase)
    symbols = [f"x{i + 1}" for i in claimed.variables]
    names = [phase.problem.names[i] for i in claimed.variables]
    optimum = np.array([phase.optimum.x[name] for name in names])
    ends = np.array([[run.x[name] for name in names] for runs in phase.searches.values() for run in runs])
    within = float(np.mean((claimed.low <= ends) & (ends <= claimed.high)))
    good = bool(np.all((claimed.low <= optimum) & (optimum <= claimed.high)))
    ranges = [phase.range_within(i, NEARLY_OPTIMAL) for i in claimed.variables]
    named = zip(symbols, optimum, ranges, strict=True)
    found = ", ".join(f"{name} = {best:z.4f} ({low:z.4f} to {high:z.4f})" for name, best, (low, high) in named)
    return Claim(
        section=claimed.section,
        text=f"In {phase.paper.title} the solutions have {' and '.join(symbols)} from {claimed.low:g} to {claimed.high:g} m/s",
        verdict=f"holds in our model by {100 * within:.0f} % of the values at the ends of all runs" if good else FAILS,
        evidence=f"IPOPT's optimum, and where it costs less than {100 * NEARLY_OPTIMAL:.0f} % more: {found} m/s; the runs end "
        f"between {ends.min():z.4f} and {ends.max():z.4f} m/s, {100 * within:.0f} % of the values within the range",
    )


def _wider(findings: Findings) -> Claim:
    widths = []
    for phase in findings.phases:
        ranges = [phase.range_within(i, 5 * NEARLY_OPTIMAL) for i in (3, 4)]
        widths.append([high - low for low, high in ranges])
    ssp, dsp = (sum(width) / 2 for width in widths)
    return Claim(
        section="5.2.3",
        text="Double support leaves a wider range of sagittal velocities than single support",
        verdict=f"holds in our model by a factor of {dsp / ssp:.1f}" if dsp > ssp else FAILS,
        evidence=f"within {500 * NEARLY_OPTIMAL:.0f} % of the least power, start and end velocity may vary by "
        f"{widths[1][0]:.3f} and {widths[1][1]:.3f} m/s in double support, {widths[0][0]:.3f} and {widths[0][1]:.3f} m/s in "
        "single support",
    )


def _double_support(phase: PhaseFindings) -> Iterator[Claim]:
    pso, ga = (phase.median_index(name, "torque_change_Nm") for name in ALGORITHMS)
    yield Claim(
        section="5.2.1",
        text="GA's solution has a torque change 3 % lower than PSO's in double support",
        verdict=f"holds in our model by {100 * (1 - ga / pso):.0f} %" if ga < pso else FAILS,
        evidence=f"medians over all runs PSO {pso:.4f} Nm, GA {ga:.4f} Nm",
    )
    durations = phase.sweeps[phase.paper.duration]
    missing = [f"{point.at:.2f} s" for point in durations if not point.feasible]
    yield Claim(
        section="5.2.5",
        text="For some durations of double support there is no solution that keeps the mean balance margin",
        verdict=HOLDS if missing else FAILS,
        evidence=f"none is found at {', '.join(missing)}"
        if missing
        else f"IPOPT finds a feasible optimum at each of {len(durations)} durations from {durations[0].at:.2f} to "
        f"{durations[-1].at:.2f} s; gaps in the picture are gaps of the search",
    )
