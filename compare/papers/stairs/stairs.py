"""Bhardwaj, Mishra, Sukavanam, Balasubramanian: a planned step on stairs, and its tracking by gains that an ant colony tunes.

Plans are IPOPT's, of least jerk as the paper's and of least energy. The tracked step is read in five ways: nearest the print the
hip is the base, so that something else carries the robot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from compare.drawing.figures import make_figure
from compare.papers.paper import Paper, read_book
from compare.papers.paper_runs import choose_best, evaluate_point, tabulate
from compare.papers.stairs import printed
from compare.papers.stairs.printed import TABLE_3, TABLE_4, describe_climb, measure_equations
from compare.papers.stairs.results import (
    CHOICES,
    DRAWN_CASE,
    INDEXES,
    LITERAL,
    NETWORK_RATES,
    PLANS,
    TRACKINGS,
    StairsEffort,
    StairsResults,
    compute,
    make_plan_spec,
    make_title,
    make_track_spec,
)
from compare.report.document import Figure, Part, Table, Value
from compare.study.run import IPOPT
from nlp_gait.formulation.display import LEFT, RIGHT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.stair import SETBACK

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


def list_climbs(results: StairsResults, key: str) -> list[float] | None:
    """Return a number of the simulated plans by case; None without MuJoCo."""
    climbs = results.list_computed("climb")
    return [climb[key] for climb in climbs] if all(climbs) else None


def get_network(results: StairsResults) -> dict[str, float]:
    """Return how the network learns at the printed rate."""
    network: dict[str, float] = results.computed[f"network-{results.plan}"][0]
    return network


def list_printed_errors(results: StairsResults) -> list[float]:
    """Return the largest errors of tracked steps with the gains and the torso pitch of Table IV [rad]."""
    return [
        evaluate_point(make_track_spec(n, results.best(n).x), [c.kp, c.kd, c.torso_pitch_rad])["largest_error_rad"]
        for n, c in TABLE_4.items()
    ]


def compute_saving(results: StairsResults, key: str) -> float:
    """Return the energy that the colony's gains save against another choice, over all cases [%]."""
    return 100 * (1 - sum(results.list_tracked("energy_J")) / sum(results.list_computed("power", key)))


def compare_choice(results: Mapping[str, StairsResults], name: str) -> dict[str, float | str]:
    """Return the optima of case 2 with a choice of the planner undone, next to ours."""
    effects: dict[str, float | str] = {}
    for reading, plan in PLANS.items():
        result, (index, unit) = results[reading], INDEXES[plan]
        (run,), ours = result.runs[f"{plan}-{name}", IPOPT], result.best(DRAWN_CASE).metrics[index]
        value = run.metrics[index] if run.feasible else f"no plan ({', '.join(run.violated[:1])})"
        label = f"case {DRAWN_CASE}, {reading}"
        effects |= {f"{label} [{unit}]": value, f"{label}, ours [{unit}]": ours}
    return effects


def compare_hip_height(results: Mapping[str, StairsResults]) -> dict[str, float | str]:
    """Return how many starts find a plan with the printed hip, without our limits, and what is violated between samples."""
    effects: dict[str, float | str] = {}
    for case in TABLE_4:
        runs = results["least energy"].runs[f"hip-{case}", IPOPT]
        effects[f"starts that are feasible at their samples, of {len(runs)}, case {case}"] = sum(
            run.feasible for run in runs
        )
        worst = [*choose_best(runs).violated, "nothing"][0]
        effects[f"violated between samples, case {case}"] = worst
    return effects


def compare_colony(results: Mapping[str, StairsResults]) -> dict[str, float | str]:
    """Return how far IPOPT from one start ends above the colony's best run [%], or which row it violates."""
    result, effects = results[LITERAL], dict[str, float | str]()
    for case, colony in zip(TABLE_4, result.tracked, strict=True):
        (run,) = result.runs[make_title(LITERAL, case), IPOPT]
        excess = 100 * (run.objective / colony.objective - 1)
        violated = f"no feasible point ({', '.join(run.violated[:1])})"
        effects[f"IPOPT above the colony's best, case {case} [%]"] = excess if run.feasible else violated
    return effects


BOOK.bind(
    {
        "jerk-t1": lambda r: r.list_plans("t1_s"),
        "jerk-t2": lambda r: r.list_plans("t2_s"),
        "jerk-t_bc": lambda r: r.list_plans("t_bc_s"),
        "jerk-terms": lambda r: list_jerk_terms(),
        "peak-acceleration": lambda r: list_peaks(r, 0),
        "peak-jerk": lambda r: list_peaks(r, 1),
        "least-peaks": lambda r: [lead for column in (0, 1) for lead in list_leads(list_peaks(r, column))],
        "reach": list_reaches,
        "collisions": list_depths,
        "climb-landing": lambda r: list_climbs(r, "landing_%"),
        "climb-rise": lambda r: list_climbs(r, "risen_%"),
        "network": lambda r: get_network(r)["converged_%"],
        "real-time": lambda r: get_network(r)["later_converged_%"],
        "warm-network": lambda r: 100 * get_network(r)["later_steps"] / get_network(r)["first_steps"],
        "printed-gains": list_printed_errors,
    }
)
BOOK.bind(
    {
        "best-cost": lambda r: list_leads(r.list_tracked("controller_cost")),
        "best-energy": lambda r: list_leads(r.list_tracked("energy_J")),
        "best-torque": lambda r: list_leads(r.list_tracked("peak_torque_Nm")),
        "least-gains": lambda r: [lead for gain in ("kp", "kd") for lead in list_leads(r.list_tracked(gain))],
        "ratios-cost": lambda r: [1 + lead / 100 for lead in list_leads(r.list_tracked("controller_cost"))],
        "ratios-torque": lambda r: [1 + lead / 100 for lead in list_leads(r.list_tracked("peak_torque_Nm"))],
        "track-energy": lambda r: r.list_tracked("energy_J"),
        "follow": lambda r: r.list_tracked("largest_error_rad"),
        "torso-energy": lambda r: compute_saving(r, "upright_J"),
        "power-term": lambda r: compute_saving(r, "without_power_J"),
        **{name: partial(compare_choice, name=name) for name in CHOICES},
        "hip-height": compare_hip_height,
        "colony": compare_colony,
    },
    runs=True,
)
MISSES = ("foot-angles", "bezier", "arc", "flat-stairs")
BOOK.bind({id: lambda results, id=id: measure_equations(TABLE_4[DRAWN_CASE])[id] for id in MISSES})


def show(results: Mapping[str, StairsResults]) -> list[Part]:
    """Return Tables III and IV next to ours, the plans in the engine, the network, and the legs."""
    return [
        tabulate_plans(results),
        tabulate_fourth(results),
        tabulate_climbs(results),
        tabulate_network(results),
        draw(results),
    ]


def tabulate_plans(results: Mapping[str, StairsResults]) -> Table:
    """Return Table III next to the plans."""
    rows = list[Mapping[str, Value]]()
    for name in results["least jerk"].best(DRAWN_CASE).x:
        row: dict[str, Value] = {"parameter": name, "paper": TABLE_3.get(name)}
        for reading in PLANS:
            values = zip(TABLE_4, results[reading].list_plans(name), strict=True)
            row |= {f"{reading}, case {case}": value for case, value in values}
        rows.append(row)
    return tabulate("table3", "Table III and our plans; its torso pitch is in Table IV", rows)


def tabulate_fourth(results: Mapping[str, StairsResults]) -> Table:
    """Return Table IV next to the plans and the colony's tracked steps in all readings."""
    rows = [_compare(name, "least jerk", list_peaks(results["least jerk"], k)) for k, name in enumerate(PEAKS)]
    indexes = {"cost": "controller_cost", "energy": "energy_J"}
    for quantity in ("torso_pitch_rad", "kp", "kd", "cost", "energy", "peak_torque_Nm"):
        for name in (name for name in TRACKINGS if name in results):
            rows.append(_compare(quantity, name, results[name].list_tracked(indexes.get(quantity, quantity))))
    return tabulate("table4", "Table IV; cost: the mean of (53), energy here in J", rows)


PEAKS = ("acceleration", "jerk")


def _compare(quantity: str, reading: str, values: Sequence[float]) -> dict[str, Value]:
    paper = {f"paper, case {number}": getattr(case, quantity) for number, case in TABLE_4.items()}
    here = {f"here, case {number}": value for number, value in zip(TABLE_4, values, strict=True)}
    return {"quantity": quantity, **paper, "reading": reading, **here}


def tabulate_climbs(results: Mapping[str, StairsResults]) -> Table:
    """Return what MuJoCo makes of the plans."""
    rows = list[Mapping[str, Value]]()
    for reading in PLANS:
        for case, climb in zip(TABLE_4, results[reading].list_computed("climb"), strict=True):
            numbers = {"slip of the stance foot [m]": climb.get("slip_m"), "energy [J]": climb.get("energy_J")}
            rows.append({"plan": reading, "case": case, **numbers, "result": describe_climb(climb)})
    caption = "The plans in MuJoCo, their angles followed by drives; feet and shanks are solid"
    return tabulate("climbs", caption, rows)


def tabulate_network(results: Mapping[str, StairsResults]) -> Table:
    """Return how the network learns at three rates."""
    rows = list[Mapping[str, Value]]()
    for reading, plan in PLANS.items():
        for label, row in zip(NETWORK_RATES, results[reading].computed[f"network-{plan}"], strict=True):
            rows.append({"plan of case 1": reading, "rate": label, **dict(zip(NETWORK, row.values(), strict=True))})
    caption = "Inverse kinematics by the network: poses within 1e-6 m² (cm²) after at most 5000 steps"
    return tabulate("network", caption, rows)


NETWORK = (
    *("converged [%]", "after the first pose [%]", "steps of the first pose", "median steps of later poses"),
    "largest error [rad]",
)


def draw(results: Mapping[str, StairsResults]) -> Figure:
    """Return both legs in the plan of least jerk of case 2, on the stairs."""
    signals, legs = results["least jerk"].motions[DRAWN_CASE]
    tread, rise = TABLE_4[DRAWN_CASE].step_m
    figure = make_figure(height_in=3.2)
    edges = np.array([-1.6 * tread, *np.repeat([-SETBACK, tread - SETBACK], 2), 1.8 * tread])
    heights = np.repeat([-rise, 0.0, rise], 2)
    poses = np.linspace(0, len(signals.arrays["t"]) - 1, 25).astype(int)
    for axes, side, name in zip(figure.subplots(1, 2, sharey=True), (RIGHT, LEFT), ("swing", "stance"), strict=True):
        axes.fill_between(edges, heights, -1.3 * rise, color="0.9", linewidth=0)
        for k, pose in enumerate(poses):
            axes.plot(*legs[side][pose].T, color=(0.0, 0.45, 0.7, 0.25 + 0.75 * k / len(poses)), linewidth=0.8)
        axes.set(aspect="equal", xlabel="x [m]", title=f"{name} leg")
    figure.axes[0].set_ylabel("z [m]")
    caption = f"The plan of least jerk, case {DRAWN_CASE} (Figs. 8, 9): its shanks pass through the next step"
    return Figure(name="legs", caption=caption, drawing=figure)


REPRODUCTION: Paper[StairsEffort, StairsResults] = Paper(
    book=BOOK,
    title="Climbing stairs with a toe-foot biped: Bhardwaj, Mishra, Sukavanam, Balasubramanian",
    full=StairsEffort(),
    quick=StairsEffort(runs=0, starts=1, poses=50, track_s=0.3, track_cases=(DRAWN_CASE,)),
    readings={
        "least jerk": "IPOPT's plan of least peak jerk, as the paper's knot shifting, within our limits",
        "least energy": "IPOPT's plan of least energy",
    },
    run_readings={name: row["text"] for name, row in TRACKINGS.items()},
    compute=compute,
    headlines=(
        *("best-cost", "best-energy", "best-torque", "least-gains", "track-energy"),
        *("jerk-t1", "jerk-t2", "climb-landing", "network", "printed-gains"),
    ),
    show=show,
)
