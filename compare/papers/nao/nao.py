"""Gupta, Pratihar, Deb (2023): NAO's single and double support at least power, in two readings of the margins.

The printed reading takes ten samples, (19) and (20) with g = 9.8 as a number, and 23 masses in double support; the other one ten
intervals and physical gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from compare.analysis.record_statistics import approximate_rank_sum
from compare.papers.nao.results import (
    HIPS_M,
    KINDS,
    MARGINS,
    PHASES,
    PRINTED,
    PRINTED_X,
    READINGS,
    SEARCHES,
    TIMES,
    NaoEffort,
    NaoResults,
    compute,
    make_spec,
)
from compare.papers.nao.tables import JOINTS, compute_powers, list_errors, list_levels, list_margins, show
from compare.papers.paper import Paper, parse_settings, read_book
from compare.papers.paper_runs import evaluate_point
from compare.papers.rules import Found
from nlp_gait.formulation.signals import Signals

BOOK = read_book(__file__)
TEST_RUNS = 11  # of each search in the paper's tests
PACES = 9  # durations at which a printed gait is evaluated
Change = Callable[[NaoResults, str], dict[str, float]]


def compute_lead(result: NaoResults, phase: str, kind: str) -> float:
    """Return GA's printed solution less PSO's [mW, mNm]."""
    pso, ga = list_levels(result, phase, kind)
    return 1000 * (ga - pso)


def list_leads(result: NaoResults, phase: str, indexes: Sequence[str]) -> list[float]:
    """Return margins of PSO's printed solution less those of GA's [mm], as many digits as in print."""
    pso, ga = (result.measure(phase, search) for search in SEARCHES)
    return [round(1000 * (pso[index] - ga[index]), 1) for index in indexes]


def list_powers(result: NaoResults, what: str, phase: str) -> list[float] | None:
    """Return the least powers along a sweep [W]; None without two gaits."""
    powers = [power for _, power in result.sweep(what, phase)]
    return powers if len(powers) > 1 else None


def list_pairs(result: NaoResults, before: Change, after: Change, indexes: Sequence[str]) -> list[list[float]]:
    """Return power [W] or margins [mm] of PSO's printed solution under two changes, in both phases."""
    return [
        [
            (1.0 if index == "power_W" else 1000.0) * result.measure(phase, **change(result, phase))[index]
            for change in (before, after)
        ]
        for phase in PHASES
        for index in indexes
    ]


def keep(result: NaoResults, phase: str) -> dict[str, float]:
    """Return no change."""
    return {}


def remove_oscillation(result: NaoResults, phase: str) -> dict[str, float]:
    """Return the change to a hip without vertical motion."""
    return {"hip_vz_start_m_s": 0.0, "hip_vz_end_m_s": 0.0}


def choose_lowest_hip(result: NaoResults, phase: str) -> dict[str, float]:
    """Return the change to the lowest hip of the sweep at which there is a gait."""
    return {"hip_height_m": result.sweep("hip", phase)[0][0]}


def compute_root_mean(signals: Signals, kind: str = "") -> float:
    """Return the rms torque over samples and joints of a kind [Nm]."""
    columns = [name[1:].startswith(kind) for name in signals.joints]
    return float(np.sqrt(np.mean(np.square(signals.arrays["tau"][:, columns]))))


def list_oscillation_torques(result: NaoResults) -> list[list[float]]:
    """Return the rms torque without vertical motion of the hip, and as printed, in both phases [Nm]."""
    changes = [[change(result, phase) for change in (remove_oscillation, keep)] for phase in PHASES]
    pairs = zip(PHASES, changes, strict=True)
    return [[compute_root_mean(result.sample(phase, **change)) for change in pair] for phase, pair in pairs]


def list_relief(result: NaoResults) -> list[list[float]]:
    """Return the rms torque of knees and ankles with the lowest and the highest hip, in both phases [Nm]."""
    highest = {"hip_height_m": HIPS_M[-1]}
    ends = [
        [result.sample(phase, **change) for change in (choose_lowest_hip(result, phase), highest)] for phase in PHASES
    ]
    return [[compute_root_mean(end, kind) for end in pair] for pair in ends for kind in ("Knee", "Ankle")]


def list_hip_ranges(result: NaoResults, searches: Sequence[str]) -> list[float]:
    """Return the vertical range of the hip in single support [mm]."""
    return [1000 * float(np.ptp(result.sample("ssp", search).arrays["hip"][:, 2])) for search in searches]


def list_joint_leads(result: NaoResults, kind: str) -> list[float]:
    """Return the share of a kind of joints in the power less the largest other one, of both printed solutions [%]."""
    leads = []
    for search in SEARCHES:
        (mechanical, heat), shares = compute_powers(result, search), dict.fromkeys((*JOINTS, "arms"), 0.0)
        for joint, power in mechanical.items():
            group = next((k for k in JOINTS if joint[1:].startswith(k)), "arms")
            shares[group] += 100 * (power + heat[joint]) / (sum(mechanical.values()) + sum(heat.values()))
        leads.append(shares.pop(kind) - max(shares.values()))
    return leads


def list_swing_shares(result: NaoResults) -> list[float]:
    """Return the share of the swing leg in the power of the hips, with heat, and of its mechanical part [%]."""
    mechanical, heat = compute_powers(result)
    both = {joint: power + heat[joint] for joint, power in mechanical.items()}
    shares = []
    for drawn in (both, mechanical):
        swing, support = (sum(drawn[f"{side}Hip{axis}"] for axis in ("Roll", "Pitch")) for side in "RL")
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


def compute_lateral_gain(result: NaoResults) -> float:
    """Return the change of the mean margin in y with half the lateral velocities [mm]."""
    x6, x7 = PRINTED_X["ssp", "PSO"][5:7]
    halved = result.measure("ssp", hip_vy_start_m_s=x6 / 2, hip_vy_end_m_s=x7 / 2)
    return 1000 * (result.measure("ssp")["dbm_y_mean_m"] - halved["dbm_y_mean_m"])


def list_arm_gains(result: NaoResults) -> list[float]:
    """Return the margin that gains most against arms at rest, in both phases [mm]."""
    held = {p: evaluate_point(make_spec(p, result.reading, arms="held"), PRINTED_X[p, "PSO"]) for p in PHASES}
    return [max(1000 * (result.measure(phase)[index] - held[phase][index]) for index in MARGINS) for phase in PHASES]


def compute_test(rank_sum: int, runs: int = TEST_RUNS) -> list[float]:
    """Return z, the two-sided and the one-sided p-value of a rank sum of as many runs each."""
    z = (rank_sum - runs * (2 * runs + 1) / 2 + 0.5) / math.sqrt(runs**2 * (2 * runs + 1) / 12)
    p = math.erfc(abs(z) / math.sqrt(2))
    return [z, p, p / 2]


def compare_searches(result: NaoResults, phase: str) -> Found:
    """Return the lead of PSO's median [mW], and the p-values of the paper's test, repeated with other runs."""
    pso, ga = (result.final_powers(phase, search) for search in SEARCHES)
    firsts = range(0, len(pso) - TEST_RUNS + 1, TEST_RUNS) or range(1)
    tests = [approximate_rank_sum(pso[k : k + TEST_RUNS], ga[k : k + TEST_RUNS]) for k in firsts]
    return Found(1000 * float(np.median(ga) - np.median(pso)), p=tests)


def list_run_excesses(result: NaoResults, phase: str) -> list[float]:
    """Return the power at the end of PSO's runs above the optimum, sorted [%]."""
    best = result.best(make_spec(phase, result.reading)).objective
    return sorted(100 * (power / best - 1) for power in result.final_powers(phase, "PSO"))


for _phase in PHASES:
    BOOK.bind(
        {
            f"margins-{_phase}": partial(list_margins, phase=_phase),
            f"pso-optimal-{_phase}": partial(NaoResults.excess, phase=_phase),
            f"higher-hip-{_phase}": partial(list_powers, what="hip", phase=_phase),
            f"slower-{_phase}": partial(list_powers, what="time", phase=_phase),
            f"too-fast-{_phase}": partial(compute_pace_loss, phase=_phase, end=0),
            f"too-slow-{_phase}": partial(compute_pace_loss, phase=_phase, end=-1),
            **{f"{kind}-level-{_phase}": partial(list_levels, phase=_phase, kind=kind) for kind in KINDS},
            **{f"{kind}-lead-{_phase}": partial(compute_lead, phase=_phase, kind=kind) for kind in KINDS},
        }
    )
    BOOK.bind({f"better-{_phase}": partial(compare_searches, phase=_phase)}, runs=True)
    BOOK.bind({f"same-optimum-{_phase}": partial(list_run_excesses, phase=_phase)}, runs=True)
BOOK.bind(
    {
        "least-margins-dsp": lambda r: list_margins(r, "dsp", MARGINS[:2]),
        "mean-x-lead-ssp": lambda r: list_leads(r, "ssp", MARGINS[2:3]),
        "least-leads-ssp": lambda r: list_leads(r, "ssp", MARGINS[:2]),
        "margin-leads-dsp": lambda r: list_leads(r, "dsp", MARGINS),
        "more-stable": lambda r: [1000 * (r.measure("dsp")[index] - r.measure("ssp")[index]) for index in MARGINS],
        "swing-beyond": lambda r: list_powers(r, "swing", "ssp"),
        "lower-hip-x": lambda r: list_pairs(r, keep, choose_lowest_hip, MARGINS[:1]),
        "lower-hip-y": lambda r: list_pairs(r, keep, choose_lowest_hip, MARGINS[1:2]),
        "straight": lambda r: list_pairs(r, keep, remove_oscillation, MARGINS[:2]),
        "oscillation": lambda r: list_pairs(r, remove_oscillation, keep, ["power_W"]),
        "oscillation-torque": list_oscillation_torques,
        "relief": list_relief,
        "few-mm": lambda r: list_hip_ranges(r, SEARCHES),
        "hip-variation": lambda r: list_hip_ranges(r, SEARCHES[::-1]),
        "knees": lambda r: list_joint_leads(r, "Knee"),
        "hips": lambda r: list_joint_leads(r, "Hip"),
        "swing-hip": list_swing_shares,
        "swing-joints": list_swing_joints,
        "lateral-margin": compute_lateral_gain,
        "arms": list_arm_gains,
        "statistic-ssp": lambda r: compute_test(70),
        "statistic-dsp": lambda r: compute_test(90),
    }
)
BOOK.bind({"torque-rank": lambda r: [run.metrics["torque_change_Nm"] for run in r.list_runs("ssp", "PSO")]}, runs=True)


def measure_choice(results: Mapping[str, NaoResults], id: str) -> dict[str, float]:
    """Return the largest error of the printed margins with one choice of the printed reading alone [mm]."""
    options, effects = parse_settings(BOOK.differences[id].option)[0], dict[str, float]()
    kinds = {"ssp": ("margins of single support", MARGINS), "dsp": ("least margins of double support", MARGINS[:2])}
    for phase in ("dsp",) if id == "masses" else PHASES:
        (words, indexes), errors = kinds[phase], list[float]()
        for search in SEARCHES:
            figures = evaluate_point(make_spec(phase, "physical", **options), PRINTED_X[phase, search])
            errors += [1000 * abs(figures[index] - PRINTED[phase, search][index]) for index in indexes]
        effects[f"largest error of {words}, with this choice alone [mm]"] = max(errors)
        for reading, what in (("physical", "none"), ("printed", "all")):
            errors = list_errors(results[reading], phase, indexes)
            effects[f"largest error of {words}, with {what} of the printed reading [mm]"] = max(map(abs, errors))
    return effects


def measure_option(results: Mapping[str, NaoResults], id: str) -> dict[str, float]:
    """Return the changes of PSO's printed solutions with the option of a difference."""
    options, effects = parse_settings(BOOK.differences[id].option)[0], dict[str, float]()
    for phase in ("dsp",) if id in ("lever", "arms-shared") else PHASES:  # of double support alone
        after = evaluate_point(make_spec(phase, "printed", **options), PRINTED_X[phase, "PSO"])
        before = results["printed"].measure(phase)
        for name, index in zip(("power", "torque change"), KINDS.values(), strict=True):
            effects[f"{name} of {PHASES[phase]} [%]"] = 100 * (after[index] / before[index] - 1)
        largest = max(1000 * abs(after[index] - before[index]) for index in MARGINS)
        effects[f"margins of {PHASES[phase]} by up to [mm]"] = largest
    return effects


BOOK.bind({id: partial(measure_choice, id=id) for id in ("zmp", "samples", "masses")})
OPTIONAL = ("lever", "arms-shared", "finite", "robot", "separate", "held")
BOOK.bind({id: partial(measure_option, id=id) for id in OPTIONAL})


REPRODUCTION: Paper[NaoEffort, NaoResults] = Paper(
    book=BOOK,
    title="The gait cycle of NAO: Gupta, Pratihar, Deb (2023)",
    full=NaoEffort(runs=10 * TEST_RUNS),
    quick=NaoEffort(),
    readings=READINGS,
    run_readings={
        f"{reading}, {label}": f"{reading} reading; PSO with {word}"
        for reading in READINGS
        for label, word in (("constant", "the inertia weight of 1"), ("damped", "the damping of the cited code"))
    },
    compute=compute,
    headlines=(
        *("margins-ssp", "pso-optimal-ssp", "better-ssp", "better-dsp", "mean-x-lead-ssp"),
        *("torque-level-ssp", "least-margins-dsp", "power-level-ssp", "torque-level-dsp", "slower-ssp"),
    ),
    show=show,
)
