"""Bhardwaj, Mishra, Sukavanam, Balasubramanian: a planned step on stairs, and its tracking by gains that an ant colony tunes.

Plans are IPOPT's, of least jerk as the paper's and of least energy. The tracked step is read in six ways: nearest the print the
hip is the base, so that something else carries the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from compare.papers.paper import DifferenceRow, Paper
from compare.papers.paper_runs import evaluate_point
from compare.papers.stairs import printed
from compare.papers.stairs.page import show
from compare.papers.stairs.printed import TABLE_3, TABLE_4, measure_equations
from compare.papers.stairs.results import (
    CHOICES,
    DRAWN_CASE,
    TRACKINGS,
    StairsEffort,
    StairsResults,
    compute,
    make_plan_spec,
    make_track_spec,
)
from compare.study.run import IPOPT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM


def list_ratios(values: Sequence[float]) -> list[float]:
    """Return the values of cases 1 and 3 by that of case 2."""
    return [values[k] / values[1] for k in (0, 2)]


def list_leads(values: Sequence[float]) -> list[float]:
    """Return by how much the values of cases 1 and 3 are above that of case 2 [%]."""
    return [100 * (ratio - 1) for ratio in list_ratios(values)]


def list_jerk_terms() -> list[float]:
    """Return the share of the jerk's term over a quantum in that of the acceleration, in (31) and (32) [%]."""
    shares = [100 * case.jerk * QUANTUM / case.acceleration for case in TABLE_4.values()]
    return [share / divisor for share in shares for divisor in (2, 3)]


def list_reaches(results: StairsResults) -> list[float]:
    """Return the largest cosine of a knee with the hip at the printed height and half a tread farther ahead, by case."""
    reaches = []
    for case, row in TABLE_4.items():
        x = dict(results.best(case).x)
        x |= {"hip_start_m": x["hip_start_m"] + row.step_m[0] / 2, "hip_height_m": TABLE_3["hip_height_m"]}
        problem = make_plan_spec(results.plan, case).load()
        reaches.append(float(problem.signals(problem.check_x(x)).arrays["reach"].max()))
    return reaches


def list_depths(results: StairsResults) -> list[float]:
    """Return how deep the swing foot, then the shanks are inside the steps, by case [mm]."""
    depths = []
    for case, (signals, legs) in results.motions.items():
        lifted = signals.arrays["t"] > results.best(case).x["t2_s"]
        depths.append(printed.measure_depths(TABLE_4[case], legs, lifted))
    return [depth for of_all_cases in zip(*depths, strict=True) for depth in of_all_cases]


def list_climbs(results: StairsResults, key: str, side: int) -> list[float] | None:
    """Return a length in the simulated plans as share of the tread (0) or rise (1), by case [%]; None without MuJoCo."""
    climbs = results.list_computed("climb")
    pairs = zip(TABLE_4.values(), climbs, strict=True)
    return [100 * climb[key] / case.step_m[side] for case, climb in pairs] if all(climbs) else None


def require_feasible(function: Callable[[StairsResults], Any]) -> Callable[[StairsResults], Any]:
    """Return a function that gives None where the colony found no feasible step in a case."""
    return lambda results: function(results) if all(run.feasible for run in results.tracked) else None


def list_run_leads(results: StairsResults, *names: str) -> list[list[float]] | None:
    """Return leads of case 2 over cases 1 and 3, for all pairs of feasible runs [%]; None if there are none."""
    leads = []
    for name in names:
        ends = results.list_ends(name)
        leads += [[100 * (a / b - 1) if b else 0.0 for a in ends[k] for b in ends[1]] for k in (0, 2)]
    fewest = min(map(len, leads))
    return [row[:fewest] for row in leads] if fewest else None


def evaluate_printed(results: StairsResults) -> list[Mapping[str, float]]:
    """Return what tracked steps with the gains and the torso pitch of Table IV are like, by case."""
    return [
        evaluate_point(make_track_spec(n, results.best(n).x), [c.kp, c.kd, c.torso_pitch_rad])
        for n, c in TABLE_4.items()
    ]


def list_steadier(results: StairsResults) -> list[float]:
    """Return by how much the tuned torso pitch makes the least ZMP margin larger than an upright torso, by case [mm]."""
    tuned, upright = results.list_tracked("zmp_margin_min_m"), results.list_computed("power", "upright_margin_m")
    return [1000 * (a - b) for a, b in zip(tuned, upright, strict=True)]


def get_network(results: StairsResults) -> Any:
    """Return how the network learns at the printed rate."""
    return results.computed[f"network-{results.plan}"][0]


def compute_saving(results: StairsResults, key: str) -> float:
    """Return the energy that the colony's gains save against another choice, over all cases [%]."""
    return 100 * (1 - sum(results.list_tracked("energy_J")) / sum(results.list_computed("power", key)))


def compare_choice(row: DifferenceRow, results: Mapping[str, StairsResults]) -> dict[str, float | str] | None:
    """Return the least peak jerk of case 2 with a choice of the planner undone, next to ours [rad/s^3]."""
    result = results["least jerk"]
    if (f"jerk-{row.id}", IPOPT) not in result.runs:
        return None
    (run,), ours = result.runs[f"jerk-{row.id}", IPOPT], result.best(DRAWN_CASE)
    value = run.objective if run.feasible else f"no plan ({', '.join(run.violated[:1])})"
    return {f"peak jerk of case {DRAWN_CASE} [rad/s³]": value, "ours [rad/s³]": ours.objective}


NUMBERS: dict[str, Callable[[StairsResults], Any]] = {
    "jerk-times": lambda r: [t for name in ("t1_s", "t2_s", "t_bc_s") for t in r.list_plans(name)],
    "jerk-terms": lambda r: list_jerk_terms(),
    "peak-acceleration": lambda r: r.list_peaks(0),
    "peak-jerk": lambda r: r.list_peaks(1),
    "least-peaks": lambda r: [lead for column in (0, 1) for lead in list_leads(r.list_peaks(column))],
    "reach": list_reaches,
    "collisions": list_depths,
    "jerk-hip": lambda r: r.list_plans("hip_height_m"),
    "climb-landing": lambda r: list_climbs(r, "landing_m", 0),
    "climb-rise": lambda r: list_climbs(r, "rise_m", 1),
    "seams": lambda r: measure_equations(TABLE_4[DRAWN_CASE])["bezier"]["jump of the ankle's speed at t2 [m/s]"],
    "mass-matrix": lambda r: printed.measure_dynamics()[0],
    "skew": lambda r: printed.measure_dynamics()[1],
    "zmp-printed": lambda r: [1000 * metrics["zmp_margin_min_m"] for metrics in evaluate_printed(r)],
    "network": lambda r: get_network(r)["converged_%"],
    "real-time": lambda r: get_network(r)["later_converged_%"],
    "warm-network": lambda r: 100 * get_network(r)["later_steps"] / get_network(r)["first_steps"],
    "printed-gains": lambda r: [metrics["largest_error_rad"] for metrics in evaluate_printed(r)],
}
NUMBERS_OF_RUNS: dict[str, Callable[[StairsResults], Any]] = {
    "best-cost": lambda r: list_run_leads(r, "controller_cost"),
    "best-energy": lambda r: list_run_leads(r, "energy_J"),
    "best-torque": lambda r: list_run_leads(r, "peak_torque_Nm"),
    "least-gains": lambda r: list_run_leads(r, "kp", "kd"),
    "zmp": lambda r: [1000 * margin for margin in r.list_tracked("zmp_margin_min_m")],
    "torso-stability": require_feasible(list_steadier),
    "pitch": require_feasible(lambda r: r.list_tracked("torso_pitch_rad")),
    "ratios-cost": require_feasible(lambda r: list_ratios(r.list_tracked("controller_cost"))),
    "ratios-torque": require_feasible(lambda r: list_ratios(r.list_tracked("peak_torque_Nm"))),
    "track-energy": require_feasible(lambda r: r.list_tracked("energy_J")),
    "follow": require_feasible(lambda r: r.list_tracked("largest_error_rad")),
    "torso-energy": require_feasible(lambda r: compute_saving(r, "upright_J")),
    "power-term": require_feasible(lambda r: compute_saving(r, "without_power_J")),
}
EFFECTS: dict[str, Callable[[DifferenceRow, Mapping[str, StairsResults]], Any]] = {
    **dict.fromkeys(CHOICES, compare_choice),
    **dict.fromkeys(
        ("foot-angles", "bezier", "arc", "cubic"), lambda row, results: measure_equations(TABLE_4[DRAWN_CASE])[row.id]
    ),
}

REPRODUCTION: Paper[StairsEffort, StairsResults] = Paper(
    module=__file__,
    title="Climbing stairs with a toe-foot biped: Bhardwaj, Mishra, Sukavanam, Balasubramanian",
    citation=(
        "G. Bhardwaj, U. A. Mishra, N. Sukavanam, R. Balasubramanian: *Cycloidal trajectory realization on staircase based on "
        "neural network temporal quantized Lagrange dynamics (NNTQLD) with ant colony optimization for a 9-link bipedal robot*."
    ),
    full=StairsEffort(),
    quick=StairsEffort(runs=0, poses=50),
    readings={
        "least jerk": "IPOPT's plan of least peak jerk, as the paper's knot shifting, within our limits",
        "least energy": "IPOPT's plan of least energy",
    },
    run_readings={name: row["text"] for name, row in TRACKINGS.items()},
    choices={name: row["choice"] for name, row in TRACKINGS.items() if row["choice"]},
    compute=compute,
    numbers=NUMBERS,
    numbers_of_runs=NUMBERS_OF_RUNS,
    effects=EFFECTS,
    headlines=(
        *("best-cost", "best-energy", "best-torque", "least-gains", "zmp"),
        *("torso-energy", "peak-jerk", "climb-landing", "network", "warm-network"),
    ),
    show=show,
)
