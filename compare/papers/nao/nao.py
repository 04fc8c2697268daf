"""Gupta, Pratihar, Deb (2023): NAO's single and double support at least power, in two readings of the margins.

The reconstructed reading takes ten samples, (19) and (20) with g = 9.8 as a number, and 23 masses in double support, which gives
the printed margins; the physical one takes ten intervals and physical gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from compare.analysis.record_statistics import approximate_rank_sum
from compare.papers.nao.page import compute_misfit, show
from compare.papers.nao.results import (
    COMPARED,
    HIPS_M,
    INDEXES,
    MARGINS,
    OPEN_GA,
    PHASES,
    PHYSICAL,
    PRINTED_OPTIONS,
    PRINTED_X,
    READINGS,
    RECONSTRUCTED,
    SEARCHES,
    SWEEPS,
    TIMES,
    NaoEffort,
    NaoResults,
    compute,
    make_spec,
)
from compare.papers.paper import DifferenceRow, Paper
from compare.papers.paper_runs import evaluate_point
from compare.papers.rules import Found
from nlp_gait.gaits.nao.body import measure_leg
from nlp_gait.robots import load_robot

KINDS = {"power": "power_W", "torque": "torque_change_Nm"}
TEST_RUNS = 11  # of each search in the paper's tests
PACES = 9  # durations at which a printed gait is evaluated
FORWARD_M_S = (0.008, 0.02, 0.05)
LATERAL = (1.0, 1.5, 2.0)  # multiples of the printed lateral velocities
MISFIT_MM = 1.0  # of a margin, ten printed digits: a reading that misses by more is excluded
FALLEN_DEG = 90.0
STRAIGHT = {"hip_vz_start_m_s": 0.0, "hip_vz_end_m_s": 0.0}  # a hip without vertical motion
HIGHEST = {"hip_height_m": HIPS_M[-1]}


def list_levels(result: NaoResults, phase: str, kind: str) -> list[float]:
    """Return the power [W] or the torque change [Nm] of both printed solutions."""
    return [result.measure(phase, search)[KINDS[kind]] for search in SEARCHES]


def compute_lead(result: NaoResults, phase: str, kind: str) -> float:
    """Return GA's printed solution less PSO's [mW, mNm]."""
    pso, ga = list_levels(result, phase, kind)
    return 1000 * (ga - pso)


def list_margins(result: NaoResults, phase: str, metrics: Sequence[str] = MARGINS) -> list[float]:
    """Return margins of both printed solutions [mm]."""
    return [1000 * result.measure(phase, search)[metric] for search in SEARCHES for metric in metrics]


def list_leads(result: NaoResults, phase: str, metrics: Sequence[str]) -> list[float]:
    """Return margins of PSO's printed solution less those of GA's [mm], as many digits as in print."""
    pso, ga = (result.measure(phase, search) for search in SEARCHES)
    return [round(1000 * (pso[metric] - ga[metric]), 1) for metric in metrics]


def compute_excess(result: NaoResults, phase: str) -> float | None:
    """Return the power of PSO's printed solution above the optimum [%]; None without a feasible optimum."""
    best = result.best(make_spec(phase, result.reading))
    return 100 * (result.measure(phase)["power_W"] / best.objective - 1) if best.feasible else None


def list_powers(result: NaoResults, what: str, phase: str) -> list[float] | None:
    """Return the least powers along a sweep [W]; None without two gaits."""
    powers = [power for _, power in result.sweep(what, phase)]
    return powers if len(powers) > 1 else None


def choose_lowest(result: NaoResults, phase: str) -> dict[str, float]:
    """Return the change to the lowest hip of the sweep at which there is a gait."""
    return {"hip_height_m": result.sweep("hip", phase)[0][0]}


def list_pairs(result: NaoResults, before: Any, after: Any, kinds: Sequence[str]) -> list[list[float]]:
    """Return kinds of figures of PSO's printed solution under two changes, in both phases, see ``measure_change``.

    A change is values of variables by name, or a function that returns them.
    """
    return [
        [measure_change(result, phase, change, kind) for change in (before, after)]
        for phase in PHASES
        for kind in kinds
    ]


def measure_change(
    result: NaoResults, phase: str, change: Mapping[str, float] | Callable[..., Mapping[str, float]], kind: str
) -> float:
    """Return power [W] or a margin [mm] of PSO's changed solution, or the rms torque of the joints of a kind [Nm]; "": of all."""
    values = change(result, phase) if callable(change) else change
    if kind in INDEXES:
        return (1.0 if kind == "power_W" else 1000.0) * result.measure(phase, **values)[kind]
    signals = result.sample(phase, **values)
    columns = [name[1:].startswith(kind) for name in signals.joints]
    return float(np.sqrt(np.mean(np.square(signals.arrays["tau"][:, columns]))))


def list_hip_ranges(result: NaoResults, searches: Iterable[str]) -> list[float]:
    """Return the vertical range of the hip in single support [mm]."""
    return [1000 * float(np.ptp(result.sample("ssp", search).arrays["hip"][:, 2])) for search in searches]


def list_swing_shares(result: NaoResults) -> list[float]:
    """Return the share of the swing leg in the power of the hips, with heat, and of its mechanical part [%]."""
    from scipy.integrate import trapezoid

    signals, problem = result.sample("ssp"), make_spec("ssp", result.reading).load()
    t, tau, qd = (signals.arrays[name] for name in ("t", "tau", "qd"))
    mechanical, heat = np.abs(tau * qd), problem.value("heat_loss_W_per_Nm2") * tau**2
    shares = []
    for power in (mechanical + heat, mechanical):
        energies = dict(zip(signals.joints, trapezoid(power, t, axis=0), strict=True))
        swing, support = (sum(energies[f"{side}Hip{axis}"] for axis in ("Roll", "Pitch")) for side in "RL")
        shares.append(100 * swing / (swing + support))
    return shares


def list_swing_joints(result: NaoResults) -> list[float]:
    """Return how much more knee and ankle move than the hip between two swing heights [degrees]."""
    ends = [result.sample("ssp", swing_height_m=height) for height in (0.015, 0.030)]
    columns = [ends[0].joints.index(f"R{joint}Pitch") for joint in ("Hip", "Knee", "Ankle")]
    hip, knee, ankle = np.degrees(np.abs(ends[1].arrays["q"] - ends[0].arrays["q"]).max(axis=0)[columns])
    return [float(knee - hip), float(ankle - hip)]


def compute_pace_loss(result: NaoResults, phase: str, end: int) -> float:
    """Return how far the least margin of PSO's printed path at the fastest (0) or slowest (-1) pace is below the best [%]."""
    problem, time = make_spec(phase, result.reading).load(), TIMES[phase]
    x = dict(zip(problem.names, PRINTED_X[phase, "PSO"], strict=True))
    margins = []
    for duration in np.geomspace(problem.value(f"{time}.lower"), problem.value(f"{time}.upper"), PACES).tolist():
        rates = {name: value * x[time] / duration for name, value in x.items() if name.startswith("hip_v")}
        gait = result.measure(phase, **{time: duration}, **rates)
        margins.append(min(gait[index] for index in MARGINS[:2]))
    return 100 * (1 - margins[end] / max(margins))


def change_lateral(factor: float) -> dict[str, float]:
    """Return the lateral velocities of PSO's printed single support times a factor."""
    x6, x7 = PRINTED_X["ssp", "PSO"][5:7]
    return {"hip_vy_start_m_s": factor * x6, "hip_vy_end_m_s": factor * x7}


def compute_lateral_gain(result: NaoResults) -> float:
    """Return the change of the mean margin in y with half the lateral velocities [mm]."""
    printed, halved = (result.measure("ssp", **change_lateral(k))["dbm_y_mean_m"] for k in (1.0, 0.5))
    return 1000 * (printed - halved)


def list_arm_gains(result: NaoResults) -> list[float]:
    """Return the margin that gains most against arms at rest, in both phases [mm]."""
    held = {p: evaluate_point(make_spec(p, result.reading, arms="held"), PRINTED_X[p, "PSO"]) for p in PHASES}
    return [max(1000 * (result.measure(phase)[index] - held[phase][index]) for index in MARGINS) for phase in PHASES]


def compute_test(rank_sum: int) -> list[float]:
    """Return z, the two-sided and the one-sided p-value of a rank sum of 11 runs each."""
    n = TEST_RUNS
    z = (rank_sum - n * (2 * n + 1) / 2 + 0.5) / math.sqrt(n**2 * (2 * n + 1) / 12)
    p = math.erfc(abs(z) / math.sqrt(2))
    return [z, p, p / 2]


def compare_searches(result: NaoResults, phase: str) -> Found:
    """Return the lead of PSO's median [mW], and the p-values of the paper's test, repeated with other runs."""
    pso, ga = (result.final_powers(phase, search) for search in SEARCHES)
    firsts = range(0, min(len(pso), len(ga)) - TEST_RUNS + 1, TEST_RUNS) or range(1)
    tests = [approximate_rank_sum(pso[k : k + TEST_RUNS], ga[k : k + TEST_RUNS]) for k in firsts]
    return Found(1000 * float(np.median(ga) - np.median(pso)), p=tests)


def count_found_optima(result: NaoResults, phase: str) -> list[list[int]]:
    """Return how many of 11 runs of PSO end within 1 % of the optimum, for all sets of 11."""
    best = result.best(make_spec(phase, result.reading)).objective
    found = [power <= 1.01 * best for power in result.final_powers(phase, "PSO")]
    return [[sum(found[k : k + TEST_RUNS]) for k in range(0, len(found) - TEST_RUNS + 1, TEST_RUNS)] or [sum(found)]]


def list_swing_price(result: NaoResults, search: str, height_m: float, other_m: float) -> list[float]:
    """Return the power of a search's printed solution at a swing height above that of PSO's at another one [%]."""
    power = result.measure("ssp", search, swing_height_m=height_m)["power_W"]
    return [100 * (power / result.measure("ssp", swing_height_m=other_m)["power_W"] - 1)]


def list_simulated(result: NaoResults, key: str) -> list[float] | None:
    """Return a number of the simulated printed solutions, of the tilt of one that fell 90 degrees; None without MuJoCo."""
    runs = [result.computed[f"simulation-{phase}-{search}"] for phase in PHASES for search in SEARCHES]
    fallen = {"tilt_deg": FALLEN_DEG}
    return [run[key] if run["fell_at_s"] is None else fallen.get(key, run[key]) for run in runs] if all(runs) else None


def list_faster(result: NaoResults) -> list[list[float]]:
    """Return the power of PSO's printed single support at larger forward velocities at its start, and at its end [W]."""
    names = ("hip_vx_start_m_s", "hip_vx_end_m_s")
    return [[result.measure("ssp", **{name: v})["power_W"] for v in FORWARD_M_S] for name in names]


def count_gaps(result: NaoResults) -> int | None:
    """Return the number of durations of double support without a gait; None in the physical reading, which is excluded."""
    return len(SWEEPS["gap", "dsp"][1]) - len(result.sweep("gap", "dsp")) if result.reading == RECONSTRUCTED else None


def compute_highest_hip() -> float:
    """Return the height of the torso above the sole of a stretched leg [m]."""
    robot = load_robot("nao-v5")
    leg = measure_leg(robot, "L")
    return robot.feet["left"].ankle_height_m + leg.tibia_m + leg.thigh_m - leg.hip_m[2]


def compute_speed_gain(result: NaoResults) -> float:
    """Return the mean speed of the hip at the shortest feasible duration of the sweeps, double by single support."""
    speeds = []
    for phase in PHASES:
        hip = result.sample(phase).arrays["hip"]
        shortest = min(duration for duration, _ in result.sweep("time", phase))
        speeds.append(float(np.linalg.norm(hip[-1] - hip[0])) / shortest)
    return speeds[1] / speeds[0]


def list_excluded(results: Mapping[str, NaoResults]) -> dict[str, str]:
    """Return why the print excludes readings."""
    reasons, physical = dict[str, str](), compute_misfit("ssp")
    if physical > MISFIT_MM:
        reasons[PHYSICAL] = (
            f"its margins of single support miss the printed ones by up to {physical:.1f} mm, those of the "
            f"reconstructed reading by {compute_misfit('ssp', **PRINTED_OPTIONS):.2f} mm"
        )
    if "constant" in results:
        powers, printed = results["constant"].final_powers("ssp", "PSO"), results["constant"].measure("ssp")["power_W"]
        if min(powers) > printed:
            reasons["constant"] = (
                f"the best of {len(powers)} runs needs {100 * (min(powers) / printed - 1):.1f} % more power in single support "
                "than the printed median run"
            )
    return reasons


def measure_choice(row: DifferenceRow, results: Mapping[str, NaoResults]) -> dict[str, float]:
    """Return the largest error of the printed margins with one choice of the reconstructed reading alone [mm]."""
    words = {"ssp": "margins of single support", "dsp": "least margins of double support"}
    if row.id == "masses":
        del words["ssp"]
    return {f"{text}, this choice alone [mm]": compute_misfit(phase, **row.options) for phase, text in words.items()}


def measure_option(row: DifferenceRow, results: Mapping[str, NaoResults]) -> dict[str, float]:
    """Return the changes of PSO's printed solutions with the option of a difference."""
    effects = dict[str, float]()
    for phase in ("dsp",) if row.id in ("lever", "arms-shared") else PHASES:  # of double support alone
        after = evaluate_point(make_spec(phase, RECONSTRUCTED, **row.options), PRINTED_X[phase, "PSO"])
        before = results[RECONSTRUCTED].measure(phase)
        for name, index in zip(("power", "torque change"), KINDS.values(), strict=True):
            effects[f"{name} of {PHASES[phase]} [%]"] = 100 * (after[index] / before[index] - 1)
        largest = max(1000 * abs(after[index] - before[index]) for index in MARGINS)
        effects[f"margins of {PHASES[phase]} by up to [mm]"] = largest
    return effects


NUMBERS: dict[str, Callable[[NaoResults], Any]] = {
    "least-margins-dsp": lambda r: list_margins(r, "dsp", MARGINS[:2]),
    "mean-x-lead-ssp": lambda r: list_leads(r, "ssp", MARGINS[2:3]),
    "least-leads-ssp": lambda r: list_leads(r, "ssp", MARGINS[:2]),
    "margin-leads-dsp": lambda r: list_leads(r, "dsp", MARGINS),
    "more-stable": lambda r: [1000 * (r.measure("dsp")[index] - r.measure("ssp")[index]) for index in MARGINS],
    "swing-beyond": lambda r: list_powers(r, "swing", "ssp"),
    "lower-hip-x": lambda r: list_pairs(r, {}, choose_lowest, MARGINS[:1]),
    "lower-hip-y": lambda r: list_pairs(r, {}, choose_lowest, MARGINS[1:2]),
    "straight": lambda r: list_pairs(r, {}, STRAIGHT, MARGINS[:2]),
    "oscillation": lambda r: list_pairs(r, STRAIGHT, {}, ["power_W"]),
    "oscillation-torque": lambda r: list_pairs(r, STRAIGHT, {}, [""]),
    "relief": lambda r: list_pairs(r, choose_lowest, HIGHEST, ["Knee", "Ankle"]),
    "few-mm": lambda r: list_hip_ranges(r, SEARCHES),
    "hip-variation": lambda r: list_hip_ranges(r, reversed(SEARCHES)),
    "swing-24": lambda r: list_swing_price(r, "PSO", 0.024, 0.015),
    "swing-28": lambda r: list_swing_price(r, "PSO", 0.028, 0.015),
    "swing-ga": lambda r: list_swing_price(r, "GA", 0.024, 0.024),
    "simulator": lambda r: list_simulated(r, "tilt_deg"),
    "simulator-limits": lambda r: list_simulated(r, "outside"),
    "forward-range": list_faster,
    "lateral-range": lambda r: [r.measure("ssp", **change_lateral(k))["power_W"] for k in LATERAL],
    "velocities-dsp": lambda r: list(r.best(make_spec("dsp", r.reading)).x.values())[3:5],
    "gap-dsp": count_gaps,
    "highest-hip": lambda r: compute_highest_hip(),
    "faster-dsp": compute_speed_gain,
    "swing-hip": list_swing_shares,
    "swing-joints": list_swing_joints,
    "lateral-margin": compute_lateral_gain,
    "arms": list_arm_gains,
    "statistic-ssp": lambda r: compute_test(70),
    "statistic-dsp": lambda r: compute_test(90),
}
NUMBERS_OF_RUNS: dict[str, Callable[[NaoResults], Any]] = {
    "torque-rank": lambda r: [run.metrics["torque_change_Nm"] for run in r.list_runs("ssp", "PSO")]
}
for _phase in PHASES:
    NUMBERS |= {
        f"margins-{_phase}": partial(list_margins, phase=_phase),
        f"pso-optimal-{_phase}": partial(compute_excess, phase=_phase),
        f"higher-hip-{_phase}": partial(list_powers, what="hip", phase=_phase),
        f"slower-{_phase}": partial(list_powers, what="time", phase=_phase),
        f"too-fast-{_phase}": partial(compute_pace_loss, phase=_phase, end=0),
        f"too-slow-{_phase}": partial(compute_pace_loss, phase=_phase, end=-1),
        **{f"{kind}-level-{_phase}": partial(list_levels, phase=_phase, kind=kind) for kind in KINDS},
        **{f"{kind}-lead-{_phase}": partial(compute_lead, phase=_phase, kind=kind) for kind in KINDS},
    }
    NUMBERS_OF_RUNS[f"better-{_phase}"] = partial(compare_searches, phase=_phase)
    NUMBERS_OF_RUNS[f"same-optimum-{_phase}"] = partial(count_found_optima, phase=_phase)

REPRODUCTION: Paper[NaoEffort, NaoResults] = Paper(
    module=__file__,
    title="The gait cycle of NAO: Gupta, Pratihar, Deb (2023)",
    citation=(
        "P. Gupta, D. K. Pratihar, K. Deb: *Analysis and optimization of gait cycle of 25-DOF NAO robot using particle swarm "
        "optimization and genetic algorithms*, COIN Report 2023008."
    ),
    full=NaoEffort(runs=5 * TEST_RUNS),
    quick=NaoEffort(),
    readings=READINGS,
    run_readings={name: words for name, (_, _, words) in COMPARED.items()},
    choices={name: OPEN_GA for name in ("all crossed", "one elite", "no elite", "penalty")},
    exclude=list_excluded,
    compute=compute,
    numbers=NUMBERS,
    numbers_of_runs=NUMBERS_OF_RUNS,
    effects={
        **dict.fromkeys(("zmp", "samples", "masses"), measure_choice),
        **dict.fromkeys(("lever", "arms-shared", "finite", "robot", "separate", "held"), measure_option),
    },
    headlines=(
        *("margins-ssp", "pso-optimal-ssp", "better-ssp", "better-dsp", "same-optimum-ssp"),
        *("swing-24", "swing-ga", "simulator", "power-level-ssp"),
    ),
    show=show,
)
