"""Checks of the NAO paper's claims about gaits: values of its solutions, stability, arms, joints, and the simulation."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from compare.analysis.record_statistics import approximate_rank_sum
from compare.papers import claims
from compare.papers.claims import Check, Series, compare_changes, compare_levels, decide, require_change
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings
from compare.papers.nao.nao_runs import ALGORITHMS, SWING_HEIGHT, WEBOTS_DRIVE
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.nao.joints import measure_leg
from nlp_gait.robots import load_robot

MARGINS = tuple(f"dbm_{axis}_{kind}_m" for kind in ("min", "mean") for axis in "xy")
STRAIGHT = {"hip_vz_start_m_s": 0.0, "hip_vz_end_m_s": 0.0}  # variables of a hip without vertical motion
TORQUE_LIMIT = "torque_change_limit_Nm"
NEAR_ZERO_M_S = (0.0, -0.01, -0.02)  # values of x6 near zero; printed are -0.0367 and -0.0384
PACES = 9  # durations at which a printed gait is evaluated
KINDS = {"HipYawPitch": "hip yaw-pitch", "Hip": "hip roll and pitch", "Knee": "knees", "Ankle": "ankles"}


def compute_joint_shares(problem: GaitProblem, x: Sequence[float], *, heat: bool = True) -> dict[str, float]:
    """Return the share of each kind of joint in the power of a solution, or in its mechanical part; the last is the arms'."""
    drawn = _compute_joint_powers(problem, x, heat=heat)
    shares = dict.fromkeys([*KINDS, "arms"], 0.0)
    for joint, value in drawn.items():
        shares[next((kind for kind in KINDS if joint[1:].startswith(kind)), "arms")] += value / sum(drawn.values())
    return shares


def _compute_joint_powers(problem: GaitProblem, x: Sequence[float], *, heat: bool = True) -> dict[str, float]:
    """Return the energy that each joint draws, or its mechanical part [J]."""
    signals = problem.signals(problem.check_x(x))
    tau = signals.arrays["tau"]
    loss = heat * problem.value("heat_loss_W_per_Nm2")
    drawn = np.abs(tau * signals.arrays["qd"]) + loss * tau**2
    energies = np.asarray(np.trapezoid(drawn, signals.arrays["t"], axis=0))
    return dict(zip(signals.joints, map(float, energies), strict=True))


def describe_effect(phase: PhaseFindings, choice: str) -> str:
    """Return how another choice changes the printed solutions and the optimum, in words."""
    before, after, optimum = phase.printed_here, phase.printed_by_choice[choice], phase.optimum_with(choice)
    changes = {
        words: [100 * (after[name][index] / before[name][index] - 1) for name in ALGORITHMS]
        for index, words in (("power_W", "power"), ("torque_change_Nm", "torque change"))
    }
    margin = 1000 * max(abs(after[n][index] - before[n][index]) for n in ALGORITHMS for index in MARGINS)
    best = ""
    if optimum is not None and optimum.verdict.feasible:
        best = f"; optimum {optimum.verdict.objective:.5f} W instead of {phase.best:.5f} W"
    texts = [f"{words} {values[0]:+.1f} and {values[1]:+.1f} %" for words, values in changes.items()]
    return f"{phase.paper.title}, printed solutions of PSO and GA: {', '.join(texts)}, margins by up to {margin:.1f} mm{best}"


def _check_levels(phase: PhaseFindings, indexes: Sequence[str]) -> Check:
    pairs = [(o.figures[i], phase.printed_here[name][i]) for name, o in phase.paper.optima.items() for i in indexes]
    printed, here = np.array(pairs).T
    share, gap = 100 * np.abs(here / printed - 1), np.abs(here - printed)
    values = {"printed": printed, "all_printed": ", ".join(f"{value:.4f}" for value in printed), "here": here}
    return compare_levels(printed, here, **values, share=share.max(), gap_mm=1000 * gap.max())


def _check_lead(
    phase: PhaseFindings, indexes: Sequence[str], sign: float = 1.0, share: bool = False, level: bool = False
) -> Check:
    """Check PSO's printed solution above GA's, or below it for a negative sign [mm, to a tenth], or a share [%].

    As a level, the sign does not count.
    """
    optima, rows = phase.paper.optima, []
    for found in ({name: optimum.figures for name, optimum in optima.items()}, phase.printed_here):
        pairs = [(found["pso"][i], found["ga"][i]) for i in indexes]
        rows.append([100 * (a / b - 1) if share else 1000 * sign * (a - b) for a, b in pairs])
    printed, ours = rows if share else np.round(rows, 1).tolist()
    values: dict[str, Any] = {"velocities": [(optima[name].x[3], optima[name].x[5]) for name in ALGORITHMS]}
    values |= {"printed": rows[0], "ours": ours, "apart": abs(ours[0] - rows[0][0])}
    return compare_levels(printed, ours, not level, **values)


def _check_more_stable(findings: NaoFindings) -> Check:
    ssp, dsp = (phase.paper.optima["pso"].indexes for phase in findings.phases)
    here = [phase.printed_here["pso"] for phase in findings.phases]
    printed, ours = ([1000 * (b[m] - a[m]) for m in MARGINS] for a, b in ((ssp, dsp), (here[0], here[1])))
    return compare_changes(printed, ours, printed=printed, ours=ours)


def _check_lower_hip(findings: NaoFindings, axis: str) -> Check:
    lowest, changes = [], []
    for phase in findings.phases:
        lowest.append(phase.lowest_hip_m)
        low, here = phase.evaluate_printed(hip_height_m=lowest[-1]), phase.printed_here["pso"]
        changes.append([1000 * (low[index] - here[index]) for index in (f"dbm_{axis}_min_m", f"dbm_{axis}_mean_m")])
    ours, means = zip(*changes, strict=True)
    return require_change(ours, ours=ours, means=means, lowest=lowest)


def _check_arms(findings: NaoFindings) -> Check:
    pairs = [(phase.printed_here["pso"], phase.printed_by_choice["held"]["pso"]) for phase in findings.phases]
    gains = [[1000 * (here[index] - held[index]) for index in MARGINS] for here, held in pairs]
    cost = [100 * (here["power_W"] / held["power_W"] - 1) for here, held in pairs]
    return require_change([max(gain) for gain in gains], gains=gains, cost=cost)


def _check_pace(phase: PhaseFindings, slow: bool, share: bool = True) -> Check:
    """Check the loss of margin at the slowest or the fastest pace along the same path [%], or [mm] if no share."""
    problem, time, x = phase.problem, phase.problem.names[phase.paper.duration], phase.printed_pso
    rates, margins = [name for name in x if name.startswith("hip_v")], {}
    for at in np.geomspace(problem.value(f"{time}.lower"), problem.value(f"{time}.upper"), PACES).tolist():
        found = phase.evaluate_printed(**{time: at}, **{v: x[v] * x[time] / at for v in rates})
        margins[at] = 1000 * min(found["dbm_x_min_m"], found["dbm_y_min_m"])
    best, end = max(margins, key=margins.__getitem__), max(margins) if slow else min(margins)
    lost = margins[best] - margins[end]
    shown = {"at_best": margins[best], "at_end": margins[end]}
    fall = 100 * lost / margins[best]
    return require_change(fall if share else lost, **shown, best=best, end=end, lost=lost, fall=fall)


def _check_straight(findings: NaoFindings, low: bool = False) -> Check:
    ours, lowest = [], [phase.lowest_hip_m for phase in findings.phases]
    for phase, height in zip(findings.phases, lowest, strict=True):
        straight = phase.evaluate_printed(**STRAIGHT, **({"hip_height_m": height} if low else {}))
        ours += [1000 * (straight[index] - phase.printed_here["pso"][index]) for index in MARGINS[:2]]
    return require_change(ours, ours=ours, lowest=lowest)


def _check_near_zero_reason(phase: PhaseFindings) -> Check:
    exact, texts, holds = build_exact_model(phase.problem), [], []
    for velocity, (name, optimum) in product(NEAR_ZERO_M_S, phase.paper.optima.items()):
        x = [*optimum.x[:5], velocity, *optimum.x[6:]]
        violated = exact.find_violated(exact.at(phase.problem.check_x(x), phase.problem.p))
        if velocity == 0.0:
            holds.append(bool(violated) and all(row.name.startswith("dbm") for row in violated))
        rows = ", ".join(f"{row.name} by {1000 * row.violation:.2f} mm" for row in violated)
        texts.append(f"{name.upper()} at {velocity:.2f} m/s {rows or 'none'}")
    return decide(all(holds), found=", ".join(texts))


def _check_oscillation(findings: NaoFindings) -> Check:
    pairs = [(phase.printed_here["pso"], phase.evaluate_printed(**STRAIGHT)) for phase in findings.phases]
    ours = [100 * (1 - curved["power_W"] / line["power_W"]) for curved, line in pairs]
    return require_change(ours, ours=ours)


def _check_oscillation_torque(findings: NaoFindings) -> Check:
    torques = [[phase.sample_printed(**at).arrays["tau"] for at in ({}, STRAIGHT)] for phase in findings.phases]
    ours = [100 * (1 - float(np.linalg.norm(curved) / np.linalg.norm(line))) for curved, line in torques]
    greatest = [100 * (1 - float(np.abs(curved).max() / np.abs(line).max())) for curved, line in torques]
    return require_change(ours, ours=ours, greatest=greatest)


def _check_relief(findings: NaoFindings) -> Check:
    ours = []
    for phase in findings.phases:
        ends = []
        for height in (phase.lowest_hip_m, phase.problem.upper[0]):
            signals = phase.sample_printed(hip_height_m=height)
            kinds = [[name[1:].startswith(kind) for name in signals.joints] for kind in ("Knee", "Ankle")]
            ends.append([float(np.sqrt((signals.arrays["tau"][:, kind] ** 2).mean())) for kind in kinds])
        ours += [100 * (1 - high / low) for low, high in zip(*ends, strict=True)]
    return require_change(ours, ours=ours)


def _check_lateral_margin(phase: PhaseFindings) -> Check:
    x, here = phase.paper.optima["pso"].x, phase.printed_here["pso"]
    halved = phase.evaluate_printed(hip_vy_start_m_s=x[5] / 2, hip_vy_end_m_s=x[6] / 2)
    ours = [1000 * (here[index] - halved[index]) for index in ("dbm_y_min_m", "dbm_y_mean_m")]
    return require_change(max(ours), ours=ours)


def _check_torque_limit(phase: PhaseFindings) -> Check:
    ends = [run.verdict.indexes["torque_change_Nm"] for runs in phase.searches.values() for run in runs]
    greatest, limit = max([*ends, phase.optimum.verdict.indexes["torque_change_Nm"]]), phase.problem.value(TORQUE_LIMIT)
    return decide(greatest > 0.99 * limit, greatest=greatest, limit=limit)


def _check_contradiction(findings: NaoFindings) -> Check:
    prices = [
        max((abs(row.price) for row in phase.optimum.active_constraints if row.name.startswith("dbm")), default=0.0)
        for phase in findings.phases
    ]
    return require_change(prices, prices=prices)


def _check_joints(findings: NaoFindings, kind: str) -> Check:
    ssp, texts = findings.ssp, []
    for phase in findings.phases:
        shares = compute_joint_shares(phase.problem, phase.paper.optima["pso"].x)
        words = ", ".join(f"{KINDS.get(name, name)} {100 * share:.0f} %" for name, share in shares.items())
        texts.append(f"{phase.paper.title}: {words}")
    others = [*(ssp.paper.optima[name].x for name in ALGORITHMS), [*ssp.optimum.x.values()]]
    every = [compute_joint_shares(ssp.problem, x) for x in others]
    work = compute_joint_shares(ssp.problem, others[0], heat=False)[kind]
    values = {"shares": "; ".join(texts), "work": 100 * work, "each": [100 * shares[kind] for shares in every]}
    return decide([max(shares, key=shares.__getitem__) == kind for shares in every], **values)


def _check_swing_hip(findings: NaoFindings) -> Check:
    ssp, shares = findings.ssp, []
    for x in (*(ssp.paper.optima[name].x for name in ALGORITHMS), [*ssp.optimum.x.values()]):
        for heat in (True, False):
            drawn = _compute_joint_powers(ssp.problem, x, heat=heat)
            swing, support = (sum(drawn[f"{side}Hip{axis}"] for axis in ("Roll", "Pitch")) for side in "RL")
            shares.append(100 * swing / (swing + support))
    return decide([share > 50 for share in shares], shares=Series(shares[0::2]), work=Series(shares[1::2]))


def _check_swing_joints(findings: NaoFindings) -> Check:
    ssp, angles = findings.ssp, []
    for end in (ssp.problem.lower, ssp.problem.upper):
        signals = ssp.sample_printed(swing_height_m=end[SWING_HEIGHT])
        columns = [signals.joints.index(f"R{joint}Pitch") for joint in ("Hip", "Knee", "Ankle")]
        angles.append(np.degrees(signals.arrays["q"][:, columns]))
    hip, knee, ankle = np.abs(angles[1] - angles[0]).max(axis=0)
    return decide(bool(min(knee, ankle) > hip), hip=hip, knee=knee, ankle=ankle)


def _check_hip_variation(phase: PhaseFindings, swarm: str = "") -> Check:
    if swarm:
        found = [[list(run.x.values()) for run in phase.searches[name]] for name in (swarm, "ga")]
    else:
        found = [[list(optimum.x)] for optimum in phase.paper.optima.values()]
    rises = [[_compute_hip_rise(phase, x) for x in solutions] for solutions in found]
    (pso, ga), p = map(np.median, rises), approximate_rank_sum(*rises).p_two_sided
    values = {"pso": pso, "ga": ga, "change": 100 * float(pso / ga - 1)}
    check = require_change(-values["change"], **values, swarm=NAMES.get(swarm))
    with_p = replace(check, values={**check.values, "p": p})
    return claims.require_significance(with_p, "rank-sum test", p) if swarm else check


def _check_few_mm(phase: PhaseFindings) -> Check:
    printed = [_compute_hip_rise(phase, optimum.x) for optimum in phase.paper.optima.values()]
    ends = [_compute_hip_rise(phase, [*run.x.values()]) for runs in phase.searches.values() for run in runs]
    every = [*printed, *ends]
    return compare_levels(np.zeros(len(every)), every, printed=Series(printed), most=max(ends))


def _compute_hip_rise(phase: PhaseFindings, x: Sequence[float]) -> float:
    """Return the hip's vertical range over the samples [mm]."""
    return 1000 * float(np.ptp(phase.problem.signals(phase.problem.check_x(x)).arrays["hip"][:, 2]))


def _check_stretched(findings: NaoFindings) -> Check:
    leg = measure_leg(load_robot(str(findings.ssp.problem.options["robot"])), "L")
    height = leg.ankle_height_m + leg.thigh_m + leg.tibia_m - leg.hip_m[2]
    return compare_levels(0.334, height, height=height)


def _check_simulations(findings: NaoFindings, key: str) -> Check:
    found = {f"{p.paper.title}, {n.upper()}": s for p in findings.phases for n, s in p.simulations.items()}
    tilts = ", ".join(f"{name} {np.degrees(s['tilt_rad']):.1f}" for name, s in found.items())
    room = min(-np.degrees(s["simulated_beyond_rad"]) for s in found.values())
    falls = ", ".join(name for name, s in found.items() if s["fell_at_s"] is not None)
    holds = not falls if key == "fell_at_s" else room >= 0.0
    period_ms = 1000 * WEBOTS_DRIVE.period_s
    return decide(holds, tilts=tilts, room=room, falls=falls or "no gait", period=period_ms)
