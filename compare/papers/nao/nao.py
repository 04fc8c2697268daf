"""Gupta, Pratihar, Deb (2023): NAO's single and double support at least power, in two readings of the margins.

The reconstructed reading takes ten samples, (19) and (20) with g = 9.8 as a number, and 23 masses in double support, which gives
the printed margins; the physical one takes ten intervals and physical gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from compare.analysis.record_statistics import approximate_rank_sum
from compare.papers.nao.results import (
    COMPARED,
    HIPS_M,
    KINDS,
    MARGINS,
    OPEN_GA,
    PHASES,
    PHYSICAL,
    PRINTED,
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
from compare.papers.nao.tables import compute_powers, list_errors, list_levels, list_margins, show
from compare.papers.paper import Paper, parse_settings, read_book
from compare.papers.paper_runs import evaluate_point
from compare.papers.rules import Found
from nlp_gait.formulation.signals import Signals
from nlp_gait.gaits.nao.joints import measure_leg
from nlp_gait.robots import load_robot

BOOK = read_book(__file__)
TEST_RUNS = 11  # of each search in the paper's tests
PACES = 9  # durations at which a printed gait is evaluated
FORWARD_M_S, LATERAL = (
    (0.008, 0.02, 0.05),
    (1.0, 1.5, 2.0),
)  # forward velocities; lateral ones as multiples of the printed
MISFIT_MM = 1.0  # of a margin, ten printed digits: a reading that misses by more is excluded
FALLEN_DEG = 90.0
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
    firsts = range(0, min(len(pso), len(ga)) - TEST_RUNS + 1, TEST_RUNS) or range(1)
    tests = [approximate_rank_sum(pso[k : k + TEST_RUNS], ga[k : k + TEST_RUNS]) for k in firsts]
    return Found(1000 * float(np.median(ga) - np.median(pso)), p=tests)


def count_found_optima(result: NaoResults, phase: str) -> list[list[int]]:
    """Return how many of 11 runs of PSO end within 1 % of the optimum, for all sets of 11."""
    best = result.best(make_spec(phase, result.reading)).objective
    found = [power <= 1.01 * best for power in result.final_powers(phase, "PSO")]
    return [[sum(found[k : k + TEST_RUNS]) for k in range(0, len(found) - TEST_RUNS + 1, TEST_RUNS)] or [sum(found)]]


def compute_swing_price(result: NaoResults, search: str, height_m: float, other_m: float) -> float:
    """Return the power of a search's printed solution at a swing height above that of PSO's at another one [%]."""
    power, reference = (
        result.measure("ssp", name, swing_height_m=h)["power_W"] for name, h in ((search, height_m), ("PSO", other_m))
    )
    return 100 * (power / reference - 1)


def list_simulated(result: NaoResults, key: str) -> list[float] | None:
    """Return a number of the simulated printed solutions; None without MuJoCo."""
    runs = [result.computed[f"simulation-{phase}-{search}"] for phase in PHASES for search in SEARCHES]
    return [run[key] for run in runs] if all(runs) else None


def list_tilts(result: NaoResults) -> list[float] | None:
    """Return the largest tilt of the printed solutions in the engine [deg]; 90 after a fall."""
    falls, tilts = (list_simulated(result, key) for key in ("fell_at_s", "tilt_deg"))
    return tilts and [t if fall is None else FALLEN_DEG for fall, t in zip(falls or [], tilts, strict=True)]


def list_faster(result: NaoResults) -> list[list[float]]:
    """Return the power of PSO's printed single support at larger forward velocities at its start, and at its end [W]."""
    names = ("hip_vx_start_m_s", "hip_vx_end_m_s")
    return [[result.measure("ssp", **{name: v})["power_W"] for v in FORWARD_M_S] for name in names]


def list_wider(result: NaoResults) -> list[float]:
    """Return the power of PSO's printed single support at larger lateral velocities [W]."""
    x6, x7 = PRINTED_X["ssp", "PSO"][5:7]
    return [result.measure("ssp", hip_vy_start_m_s=k * x6, hip_vy_end_m_s=k * x7)["power_W"] for k in LATERAL]


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
    reasons, errors = {}, {name: max(map(abs, list_errors(results[name], "ssp"))) for name in READINGS}
    if errors[PHYSICAL] > MISFIT_MM:
        reasons[PHYSICAL] = (
            f"its margins of single support miss the printed ones by up to {errors[PHYSICAL]:.1f} mm, those of the "
            f"reconstructed reading by {errors[RECONSTRUCTED]:.2f} mm"
        )
    if "constant" in results:
        powers, printed = results["constant"].final_powers("ssp", "PSO"), results["constant"].measure("ssp")["power_W"]
        if min(powers) > printed:
            reasons["constant"] = (
                f"the best of {len(powers)} runs needs {100 * (min(powers) / printed - 1):.1f} % more power in single support "
                "than the printed median run"
            )
    return reasons


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
    BOOK.bind({f"same-optimum-{_phase}": partial(count_found_optima, phase=_phase)}, runs=True)
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
        "swing-24": lambda r: [compute_swing_price(r, "PSO", 0.024, 0.015)],
        "swing-28": lambda r: [compute_swing_price(r, "PSO", 0.028, 0.015)],
        "swing-ga": lambda r: [compute_swing_price(r, "GA", 0.024, 0.024)],
        "simulator": list_tilts,
        "simulator-limits": lambda r: list_simulated(r, "outside"),
        "forward-range": list_faster,
        "lateral-range": list_wider,
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
)
BOOK.bind({"torque-rank": lambda r: [run.metrics["torque_change_Nm"] for run in r.list_runs("ssp", "PSO")]}, runs=True)


def measure_choice(results: Mapping[str, NaoResults], id: str) -> dict[str, float]:
    """Return the largest error of the printed margins with one choice of the reconstructed reading alone [mm]."""
    options, effects = parse_settings(BOOK.differences[id].option)[0], dict[str, float]()
    kinds = {"ssp": ("margins of single support", MARGINS), "dsp": ("least margins of double support", MARGINS[:2])}
    for phase in ("dsp",) if id == "masses" else PHASES:
        (words, indexes), errors = kinds[phase], list[float]()
        for search in SEARCHES:
            figures = evaluate_point(make_spec(phase, PHYSICAL, **options), PRINTED_X[phase, search])
            errors += [1000 * abs(figures[index] - PRINTED[phase, search][index]) for index in indexes]
        effects[f"largest error of {words}, with this choice alone [mm]"] = max(errors)
        for reading, what in ((PHYSICAL, "none"), (RECONSTRUCTED, "all")):
            errors = list_errors(results[reading], phase, indexes)
            effects[f"largest error of {words}, with {what} of the reconstructed reading [mm]"] = max(map(abs, errors))
    return effects


def measure_option(results: Mapping[str, NaoResults], id: str) -> dict[str, float]:
    """Return the changes of PSO's printed solutions with the option of a difference."""
    options, effects = parse_settings(BOOK.differences[id].option)[0], dict[str, float]()
    for phase in ("dsp",) if id in ("lever", "arms-shared") else PHASES:  # of double support alone
        after = evaluate_point(make_spec(phase, RECONSTRUCTED, **options), PRINTED_X[phase, "PSO"])
        before = results[RECONSTRUCTED].measure(phase)
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
    headlines=(
        *("margins-ssp", "pso-optimal-ssp", "better-ssp", "better-dsp", "same-optimum-ssp"),
        *("swing-24", "swing-ga", "simulator", "power-level-ssp"),
    ),
    show=show,
)
