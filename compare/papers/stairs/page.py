"""What the page of the stairs paper shows: Figures 8 to 29, and Tables III and IV next to ours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compare.drawing.charts import Chart, Series
from compare.papers.paper import make_gait_figure
from compare.papers.paper_runs import tabulate
from compare.papers.stairs.printed import TABLE_3, TABLE_4
from compare.papers.stairs.results import (
    DRAWN_CASE,
    LITERAL,
    NETWORK_RATES,
    PLANS,
    TRACKINGS,
    StairsResults,
    make_plan_spec,
    make_title,
    make_track_spec,
)
from compare.report.document import Figure, Part, Prose, Section, Table, Value
from compare.report.study_sections import make_chart_figure
from nlp_gait.formulation import Array, Signals
from nlp_gait.gaits.stairs.planar_biped import GRAVITY, load_toe_foot_biped

SHOWN = 7  # joints of Figs. 14 to 27
EVERY = 5  # quanta between drawn points
JOINT_PEAKS = ("acceleration", "jerk")
TRACKED = ("torso_pitch_rad", "kp", "kd", "cost", "energy", "peak_torque_Nm")
INDEX_NAMES = {"cost": "controller_cost", "energy": "energy_J"}


def show(results: Mapping[str, StairsResults]) -> list[Part]:
    """Return gaits, figures, Tables III and IV next to ours, and what carries the robot; then other readings, folded."""
    others = [tabulate_fourth(results, name) for name in TRACKINGS if name in results and name != LITERAL]
    return [
        draw_gait(results),
        Prose(explain(results)),
        Section(title="Figures of the paper, from our computation", parts=draw_figures(results)),
        Section(
            title="Tables III and IV", parts=[tabulate_plans(results["least jerk"]), tabulate_fourth(results, LITERAL)]
        ),
        *([Section(title="Table IV in other readings", parts=others, folded=True)] if others else []),
    ]


def draw_gait(results: Mapping[str, StairsResults]) -> Figure:
    """Return the plans of least jerk and of least energy."""
    plans = {
        reading: (make_plan_spec(plan, DRAWN_CASE).load(), [*results[reading].best(DRAWN_CASE).x.values()])
        for reading, plan in PLANS.items()
    }
    caption = f"Figs. 8 and 9: our plans of least jerk, the paper's objective, and of least energy, case {DRAWN_CASE}"
    return make_gait_figure(caption, plans)


def draw_figures(results: Mapping[str, StairsResults]) -> list[Figure]:
    """Return all figures in the paper's order; without runs of the colony, tracked steps have the printed gains."""
    jerk = results["least jerk"]
    tracked, gains = track_steps(results)
    return [
        *draw_ankle(jerk),
        draw_network(jerk),
        draw_tracking("14-20", tracked, "q", f"joint angles, {gains}"),
        draw_tracking("21-27", tracked, "qd", f"joint velocities, {gains}"),
        draw_cases(
            "28",
            f"ZMP, {gains}; it is to stay from 0 to 170 mm after t2",
            "ZMP ahead of the ankle [mm]",
            {f"case {case}": (signals.arrays["t"], 1e3 * signals.arrays["zmp"]) for case, signals in tracked.items()},
        ),
        draw_torques(tracked, gains),
    ]


def track_steps(results: Mapping[str, StairsResults]) -> tuple[dict[int, Signals], str]:
    """Return tracked steps by case as printed, and whose gains they have."""
    result = results.get(LITERAL, results["least jerk"])
    steps = {}
    for k, (case, row) in enumerate(TABLE_4.items()):
        problem = make_track_spec(case, result.best(case).x).load()
        x = [*result.tracked[k].x.values()] if result.tracking else [row.kp, row.kd, row.torso_pitch_rad]
        steps[case] = problem.signals(problem.check_x(x))
    return steps, "the colony's gains" if result.tracking else "the printed gains"


def draw_cases(number: str, words: str, label: str, curves: Mapping[str, tuple[Array, Array]]) -> Figure:
    """Return curves over time."""
    series = [Series(name=name, x=t, y=y) for name, (t, y) in curves.items()]
    chart = Chart(x="time [s]", y=label, series=series)
    return make_chart_figure(f"figure-{number}", f"Fig. {number}: {words}", [chart])


def draw_ankle(result: StairsResults) -> list[Figure]:
    """Return velocity and acceleration of the swing ankle (Figs. 10, 11), and its path in all cases (Fig. 12)."""
    signals, _ = result.motions[DRAWN_CASE]
    t, once = np.unique(signals.arrays["t"], return_index=True)  # phases share their ends
    ankle = signals.arrays["ankle"][once]
    velocity = np.gradient(ankle, t, axis=0)
    acceleration = np.gradient(velocity, t, axis=0)
    where = f"of the swing ankle, plan of least jerk, case {DRAWN_CASE}"
    drawn = [
        draw_cases(number, f"{words} {where}", f"{words} [{unit}]", {axis: (t, v[:, k]) for k, axis in enumerate("xz")})
        for number, words, unit, v in (
            ("10", "velocity", "m/s", velocity),
            ("11", "acceleration", "m/s²", acceleration),
        )
    ]
    paths = []
    for case, (motion, _) in result.motions.items():
        x, z = motion.arrays["ankle"].T
        paths.append(Series(name=f"case {case}", x=x, y=z))
    chart = Chart(x="x from the stance ankle [m]", y="z [m]", series=paths)
    caption = "Fig. 12: paths of the swing ankle, plans of least jerk"
    return [*drawn, make_chart_figure("figure-12", caption, [chart])]


def draw_network(result: StairsResults) -> Figure:
    """Return the steps that the network takes for each pose of case 1 at all rates."""
    rows = zip(NETWORK_RATES, result.computed[f"network-{result.plan}"], strict=True)
    series = [
        Series(name=label, x=np.arange(1.0, len(row["steps"]) + 1), y=np.array(row["steps"])) for label, row in rows
    ]
    chart = Chart(x="pose", y="steps", series=series)
    caption = "Fig. 13, which has computing times: gradient steps per pose, at most 5000; case 1"
    return make_chart_figure("figure-13", caption, [chart])


def draw_tracking(numbers: str, steps: Mapping[int, Signals], kind: str, words: str) -> Figure:
    """Return desired and actual angles or rates of the first seven joints in all cases."""
    charts, unit = [], "rad" if kind == "q" else "rad/s"
    for k in range(SHOWN):
        series = []
        for case, signals in steps.items():
            t, actual, desired = (signals.arrays[name][::EVERY] for name in ("t", kind, f"{kind}_desired"))
            series += [Series(name=f"case {case}", x=t, y=actual[:, k])]
            series += [Series(name=f"case {case}, desired", x=t, y=desired[:, k])]
        charts.append(Chart(x="time [s]", y=f"joint {k + 1} [{unit}]", series=series))
    return make_chart_figure(f"figures-{numbers}", f"Figs. {numbers.replace('-', ' to ')}: {words}", charts)


def draw_torques(steps: Mapping[int, Signals], gains: str) -> Figure:
    """Return the torques of all joints in each case."""
    charts = []
    for case, signals in steps.items():
        t, torques = signals.arrays["t"][::EVERY], signals.arrays["tau"][::EVERY].T
        series = [Series(name=name, x=t, y=torque) for name, torque in zip(signals.joints, torques, strict=True)]
        charts.append(Chart(x="time [s]", y=f"torque, case {case} [Nm]", series=series))
    return make_chart_figure("figure-29", f"Fig. 29: torques, {gains}", charts)


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
    energies, rises = results[LITERAL].list_tracked("energy_J"), [case.step_m[1] for case in TABLE_4.values()]
    shown = " / ".join(f"{energy:.1f}" for energy in energies)
    carried = ""
    if max(energies) < weight * min(rises):
        carried = ", less than that: as the hip is the base, something else carries the robot"
    metres = " / ".join(f"{energy / rise:.0f}" for energy, rise in zip(energies, rises, strict=True))
    return f"{words} The colony's steps as printed need {shown} J{carried}; by metre of rise {metres} J."


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


def tabulate_fourth(results: Mapping[str, StairsResults], reading: str) -> Table:
    """Return Table IV next to the plans and the colony's best tracked steps in a reading, where it was run."""
    result = results.get(reading, results["least jerk"])
    ours = {name: result.list_peaks(k) for k, name in enumerate(JOINT_PEAKS)}
    if result.tracking:
        ours |= {name: result.list_tracked(INDEX_NAMES.get(name, name)) for name in TRACKED}
    rows = list[Mapping[str, Value]]()
    for name in (*JOINT_PEAKS, *TRACKED):
        row: dict[str, Value] = {f"print {n}": getattr(case, name) for n, case in TABLE_4.items()}
        row |= {f"here {n}": value for n, value in zip(TABLE_4, ours.get(name, [None] * 3), strict=True)}
        rows.append({"": name, **row})
    words = "cost: mean of (53), energy here in J; where no run is feasible, of the least infeasible"
    return tabulate(f"table4-{make_title(reading)}", f"Table IV, cases 1, 2, 3, {reading}; {words}", rows)
