"""Bhardwaj, Mishra, Sukavanam, Balasubramanian: a planned step on stairs, and its tracking by gains that an ant colony tunes.

Plans are IPOPT's, of least jerk as the paper's and of least energy. The tracked step is read in five ways: nearest the print the
hip is the base, so that something else carries the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from compare.papers.paper import Paper, read_book
from compare.papers.paper_runs import evaluate_point, read_objective, tabulate
from compare.papers.stairs import printed
from compare.papers.stairs.figures import draw_figures, draw_gait
from compare.papers.stairs.printed import TABLE_3, TABLE_4, describe_climb, measure_equations
from compare.papers.stairs.results import (
    CHOICES,
    DRAWN_CASE,
    LITERAL,
    PLANS,
    TRACKINGS,
    StairsEffort,
    StairsResults,
    compute,
    make_plan_spec,
    make_title,
    make_track_spec,
)
from compare.report.document import Part, Prose, Section, Table, Value
from compare.study.run import IPOPT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.planar_biped import GRAVITY, load_toe_foot_biped

BOOK = read_book(__file__)


def list_leads(values: Sequence[float]) -> list[float]:
    """Return by how much the values of cases 1 and 3 are above that of case 2 [%]."""
    return [100 * (values[k] / values[1] - 1) for k in (0, 2)]


def list_peaks(results: StairsResults, column: int) -> list[float]:
    """Return the largest accelerations [rad/s^2] (0) or jerks [rad/s^3] (1) by case."""
    return [peak[column] for peak in results.peaks]


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


def list_climbs(results: StairsResults, which: int) -> list[float] | None:
    """Return landing errors (0) or rises of the hip (1) of the simulated plans by case [%]; None without MuJoCo."""
    climbs = results.list_computed("climb")
    pairs = zip(TABLE_4.values(), climbs, strict=True)
    return [printed.measure_climb(case, climb)[which] for case, climb in pairs] if all(climbs) else None


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


def list_margins(results: StairsResults) -> list[float]:
    """Return the least ZMP margins of tracked steps with the gains and the torso pitch of Table IV [mm]."""
    return [1000 * indexes["zmp_margin_min_m"] for indexes in evaluate_printed(results)]


def evaluate_printed(results: StairsResults) -> list[Mapping[str, float]]:
    """Return what tracked steps with the gains and the torso pitch of Table IV are like, by case."""
    return [
        evaluate_point(make_track_spec(n, results.best(n).x), [c.kp, c.kd, c.torso_pitch_rad])
        for n, c in TABLE_4.items()
    ]


def list_steadier(results: StairsResults) -> list[float]:
    """Return by how much the tuned torso pitch makes the least ZMP margin larger than an upright torso, by case [mm]."""
    pairs = zip(
        results.list_tracked("zmp_margin_min_m"), results.list_computed("power", "upright_margin_m"), strict=True
    )
    return [1000 * (tuned - upright) for tuned, upright in pairs]


def get_network(results: StairsResults) -> dict[str, float]:
    """Return how the network learns at the printed rate."""
    network: dict[str, float] = results.computed[f"network-{results.plan}"][0]
    return network


def compute_saving(results: StairsResults, key: str) -> float:
    """Return the energy that the colony's gains save against another choice, over all cases [%]."""
    return 100 * (1 - sum(results.list_tracked("energy_J")) / sum(results.list_computed("power", key)))


def compare_choice(results: Mapping[str, StairsResults], name: str) -> dict[str, float | str]:
    """Return the least peak jerk of case 2 with a choice of the planner undone, next to ours [rad/s^3]."""
    result = results["least jerk"]
    (run,), ours = result.runs[f"jerk-{name}", IPOPT], result.best(DRAWN_CASE)
    value = read_objective(run) if run.feasible else f"no plan ({', '.join(run.violated[:1])})"
    return {f"peak jerk of case {DRAWN_CASE} [rad/s³]": value, "ours [rad/s³]": read_objective(ours)}


BOOK.bind(
    {
        "jerk-times": lambda r: [t for name in ("t1_s", "t2_s", "t_bc_s") for t in r.list_plans(name)],
        "jerk-terms": lambda r: list_jerk_terms(),
        "peak-acceleration": lambda r: list_peaks(r, 0),
        "peak-jerk": lambda r: list_peaks(r, 1),
        "least-peaks": lambda r: [lead for column in (0, 1) for lead in list_leads(list_peaks(r, column))],
        "reach": list_reaches,
        "collisions": list_depths,
        "jerk-hip": lambda r: r.list_plans("hip_height_m"),
        "climb-landing": lambda r: list_climbs(r, 0),
        "climb-rise": lambda r: list_climbs(r, 1),
        "seams": lambda r: measure_equations(TABLE_4[DRAWN_CASE])["bezier"]["jump of the ankle's speed at t2 [m/s]"],
        "mass-matrix": lambda r: printed.measure_dynamics()[0],
        "skew": lambda r: printed.measure_dynamics()[1],
        "zmp-printed": list_margins,
        "network": lambda r: get_network(r)["converged_%"],
        "real-time": lambda r: get_network(r)["later_converged_%"],
        "warm-network": lambda r: 100 * get_network(r)["later_steps"] / get_network(r)["first_steps"],
        "printed-gains": lambda r: [indexes["largest_error_rad"] for indexes in evaluate_printed(r)],
    }
)
BOOK.bind(
    {
        "best-cost": lambda r: list_run_leads(r, "controller_cost"),
        "best-energy": lambda r: list_run_leads(r, "energy_J"),
        "best-torque": lambda r: list_run_leads(r, "peak_torque_Nm"),
        "least-gains": lambda r: list_run_leads(r, "kp", "kd"),
        "zmp": lambda r: [1000 * margin for margin in r.list_tracked("zmp_margin_min_m")],
        "torso-stability": require_feasible(list_steadier),
        "pitch": require_feasible(lambda r: r.list_tracked("torso_pitch_rad")),
        "ratios-cost": require_feasible(
            lambda r: [1 + lead / 100 for lead in list_leads(r.list_tracked("controller_cost"))]
        ),
        "ratios-torque": require_feasible(
            lambda r: [1 + lead / 100 for lead in list_leads(r.list_tracked("peak_torque_Nm"))]
        ),
        "track-energy": require_feasible(lambda r: r.list_tracked("energy_J")),
        "follow": require_feasible(lambda r: r.list_tracked("largest_error_rad")),
        "torso-energy": require_feasible(lambda r: compute_saving(r, "upright_J")),
        "power-term": require_feasible(lambda r: compute_saving(r, "without_power_J")),
        **{name: partial(compare_choice, name=name) for name in CHOICES},
    },
    runs=True,
)
MISSES = ("foot-angles", "bezier", "arc", "cubic")
BOOK.bind({id: lambda results, id=id: measure_equations(TABLE_4[DRAWN_CASE])[id] for id in MISSES})


def show(results: Mapping[str, StairsResults]) -> list[Part]:
    """Return gaits, figures, Tables III and IV next to ours, and what carries the robot; then other readings, folded."""
    others = (*(tabulate_tracked(results, name) for name in TRACKINGS if name in results and name != LITERAL),)
    return [
        draw_gait(results),
        Prose(explain(results)),
        Section(title="Figures of the paper, from our computation", parts=draw_figures(results)),
        Section(title="Tables III and IV", parts=[tabulate_plans(results["least jerk"]), tabulate_fourth(results)]),
        tabulate_climbs(results),
        *([Section(title="Table IV in other readings", parts=others, folded=True)] if others else []),
    ]


def explain(results: Mapping[str, StairsResults]) -> str:
    """Return what has to be known to read Table IV."""
    weight = load_toe_foot_biped().mass_kg * GRAVITY
    lifts = " / ".join(f"{weight * case.step_m[1]:.1f}" for case in TABLE_4.values())
    words = (
        f"The three stairs differ in tread and rise, and that of case 2 is the smallest: raising the weight by a step takes "
        f"{lifts} J, so that the least energy a step says nothing on the ratio of rise and run."
    )
    if LITERAL not in results:
        return words
    energies = results[LITERAL].list_tracked("energy_J")
    shown = " / ".join(f"{energy:.1f}" for energy in energies)
    carried = (
        "less than that: as the hip is the base, something else carries the robot"
        if max(energies) < weight * min(case.step_m[1] for case in TABLE_4.values())
        else "as printed"
    )
    metres = " / ".join(
        f"{energy / case.step_m[1]:.0f}" for energy, case in zip(energies, TABLE_4.values(), strict=True)
    )
    return f"{words} The colony's steps as printed need {shown} J, {carried}; by metre of rise {metres} J."


def tabulate_plans(result: StairsResults) -> Table:
    """Return Table III next to the plans of least jerk."""
    names = dict.fromkeys([*TABLE_3, *result.best(DRAWN_CASE).x])
    rows = list[Mapping[str, Value]]()
    for name in names:
        planned = name in result.best(DRAWN_CASE).x
        values = {f"here, case {case}": result.best(case).x[name] if planned else None for case in TABLE_4}
        rows.append({"parameter": name, "print": TABLE_3.get(name), **values})
    caption = (
        "Table III and our plans of least jerk; torso pitch is in Table IV, t3 and the angles are as printed, and no equation "
        "has t1_passive and t2_passive (t1^p, t2^p)"
    )
    return tabulate("table3", caption, rows)


def tabulate_fourth(results: Mapping[str, StairsResults]) -> Table:
    """Return Table IV next to the plans and the colony's tracked steps as printed."""
    ours = {name: list_peaks(results["least jerk"], k) for k, name in enumerate(PEAKS)}
    if LITERAL in results:
        ours |= {name: results[LITERAL].list_tracked(INDEX_NAMES.get(name, name)) for name in TRACKED}
    rows = list[Mapping[str, Value]]()
    for name in (*PEAKS, *TRACKED):
        row: dict[str, Value] = {f"print {n}": getattr(case, name) for n, case in TABLE_4.items()}
        rows.append(
            {
                "": name,
                **row,
                **{f"here {n}": value for n, value in zip(TABLE_4, ours.get(name, [None] * 3), strict=True)},
            }
        )
    return tabulate(
        "table4",
        "Table IV, cases 1, 2, 3; cost: mean of (53), energy here in J; where no run is feasible, of the least infeasible",
        rows,
    )


def tabulate_tracked(results: Mapping[str, StairsResults], reading: str) -> Table:
    """Return the colony's best steps in a reading."""
    result = results[reading]
    values = {name: result.list_tracked(INDEX_NAMES.get(name, name)) for name in (*TRACKED, "zmp_margin_min_m")}
    rows: list[Mapping[str, Value]] = [
        {"": name, **{f"case {n}": value for n, value in zip(TABLE_4, row, strict=True)}}
        for name, row in values.items()
    ]
    return tabulate(
        make_title(reading), f"The colony's best steps: {reading}; where none is feasible, the least infeasible", rows
    )


PEAKS = ("acceleration", "jerk")
TRACKED = ("torso_pitch_rad", "kp", "kd", "cost", "energy", "peak_torque_Nm")
INDEX_NAMES = {"cost": "controller_cost", "energy": "energy_J"}


def tabulate_climbs(results: Mapping[str, StairsResults]) -> Table:
    """Return what MuJoCo makes of the plans."""
    rows = list[Mapping[str, Value]]()
    for reading in PLANS:
        for case, climb in zip(TABLE_4, results[reading].list_computed("climb"), strict=True):
            numbers = {"slip of the stance foot [m]": climb.get("slip_m"), "energy [J]": climb.get("energy_J")}
            rows.append({"plan": reading, "case": case, **numbers, "result": describe_climb(TABLE_4[case], climb)})
    caption = "The plans in MuJoCo, their angles followed by drives; feet and shanks are solid"
    return tabulate("climbs", caption, rows)


REPRODUCTION: Paper[StairsEffort, StairsResults] = Paper(
    book=BOOK,
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
    headlines=(
        *("best-cost", "best-energy", "best-torque", "least-gains", "zmp"),
        *("torso-energy", "peak-jerk", "climb-landing", "network", "warm-network"),
    ),
    show=show,
)
