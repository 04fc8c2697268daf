"""What the page of Goswami, Vadakkepat, Phung (2008) shows: Figures 8 to 17, the trade-off, Tables III and IV next to ours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compare.drawing.charts import Chart, Series
from compare.papers.paper import make_gait_figure
from compare.papers.paper_runs import get_history, tabulate
from compare.papers.walk12.results import (
    F1MAX,
    GA,
    GA_EVALUATIONS,
    LAST,
    LITERAL,
    NAMES,
    OPTIONS,
    RAISED,
    READINGS,
    SECOND,
    SECOND_ROW,
    SMALL,
    TABLE_3,
    TABLE_4,
    PaperRow,
    Results,
    compute_f,
    follow,
    make_spec,
)
from compare.report.document import Figure, Part, Prose, Section, Table, Value
from compare.report.study_sections import make_chart_figure
from nlp_gait.gaits.walk12 import walk12_model
from nlp_gait.gaits.walk12.walk12_problem import PRINTED_STEPS
from nlp_gait.gaits.walk12.walk12_steps import JOINTS

STEPS = 10  # of Figs. 9 and 10
ANGLES = {"9": ((1, 12), (2, 11), (3, 10)), "10": ((4, 9), (5, 8), (6, 7))}
ZMPS = {"12, 13": SECOND_ROW, "14, 15": LAST, "16, 17": SMALL}


def show(results: Mapping[str, Results]) -> list[Part]:
    """Return gaits, figures, Tables III and IV next to ours, and what explains the print."""
    return [
        draw_gait(results[LITERAL]),
        Section(title="Figures of the paper, from our computation", parts=draw_figures(results)),
        Section(title="Tables III and IV", parts=[*tabulate_third(results), tabulate_fourth(results)]),
        Section(title="What explains the print", parts=[Prose(explain(results))]),
    ]


def draw_figures(results: Mapping[str, Results]) -> list[Figure]:
    """Return all figures in the paper's order, that of epochs with runs, and then the trade-off."""
    result = results[LITERAL]
    drawn = [draw_angles(number) for number in ANGLES]
    drawn += [draw_zmp(result, numbers, row) for numbers, row in ZMPS.items()]
    return [*([draw_epochs(result)] if result.is_searched else []), *drawn, draw_trade_off(results)]


def draw_gait(result: Results) -> Figure:
    """Return the printed gait of lambda = 0.15 and the optimum."""
    problem = make_spec(LITERAL, "0.15", SECOND_ROW.weight).load()
    gaits = {"printed": (problem, SECOND_ROW.x), "ipopt": (problem, [*result.best("0.15").x.values()])}
    return make_gait_figure("λ = 0.15 (Fig. 11): the printed gait, and IPOPT's optimum", gaits)


def draw_epochs(result: Results) -> Figure:
    """Return the best f of the GA's runs over the epochs."""
    best = np.array([get_history(run, GA_EVALUATIONS // GA.population) for run in result.find_runs("0.15", "ga")])
    epochs = np.arange(float(best.shape[1]))
    series = [
        Series(name="ga", x=epochs, y=best.min(axis=0), upper=best.max(axis=0), shape="band"),
        Series(name="ga", x=epochs, y=np.median(best, axis=0)),
        Series(name="printed", x=epochs[[-1]], y=np.array([SECOND_ROW.f]), shape="points"),
    ]
    caption = f"Fig. 8: best f at λ = 0.15, median and range of {len(best)} runs of the GA, and the printed f"
    return make_chart_figure("figure-8", caption, [Chart(x="epoch", y="f", series=series)])


def draw_angles(number: str) -> Figure:
    """Return joint angles of the printed gait of lambda = 0.15 over ten steps."""
    walked = follow(SECOND_ROW.x, steps=STEPS, intervals=40)
    degrees = np.degrees(walked["q"])
    charts = []
    for pair in ANGLES[number]:
        series = [Series(name=JOINTS[k - 1], x=walked["t"], y=degrees[:, k - 1]) for k in pair]
        charts.append(Chart(x="time [s]", y=f"angles {pair[0]}, {pair[1]} [deg]", series=series))
    caption = f"Fig. {number}: joint angles of the printed gait of λ = 0.15, pairs of left and right leg"
    return make_chart_figure(f"figure-{number}", caption, charts)


def draw_zmp(result: Results, numbers: str, row: PaperRow) -> Figure:
    """Return the ZMP of the printed gait and of the optimum in a step, as a path over the sole and over time."""
    robot = walk12_model.load_point_mass_biped()
    half, back, front = 1e3 * robot.foot_width_m / 2, -1e3 * robot.foot_back_m, 1e3 * robot.foot_front_m
    over_sole, over_time = list[Series](), list[Series]()
    for name, x in {"printed": row.x, "optimum": result.best(f"{row.weight:g}").x.values()}.items():
        step = follow([*x])
        path = 1e3 * step["zmp_foot"].T
        over_sole.append(Series(name=name, x=path[0], y=path[1]))
        over_time += [Series(name=f"{axis}, {name}", x=step["t"], y=path[k]) for k, axis in enumerate("xy")]
    sole = np.array([[back, half], [front, half], [front, -half], [back, -half], [back, half]]).T
    over_sole.append(Series(name="sole", x=sole[0], y=sole[1]))
    charts = [
        Chart(x="x from the ankle [mm]", y="y [mm]", series=over_sole),
        Chart(x="time [s]", y="ZMP from the ankle [mm]", series=over_time),
    ]
    first, second = numbers.split(", ")
    caption = f"Figs. {first} and {second}: ZMP in one step, λ = {row.weight:g}; by (8) it is to stay over the sole"
    return make_chart_figure(f"figures-{first}-{second}", caption, charts)


def draw_trade_off(results: Mapping[str, Results]) -> Figure:
    """Return the trade-off between Q and s."""
    series = []
    for name in (LITERAL, RAISED):
        front = 1e3 * np.array([(run.x["step_length_m"], run.metrics["Q_m2s"]) for run in results[name].front]).T
        series.append(Series(name=f"least Q, {name}", x=front[0], y=front[1]))
    s, f1 = np.array([row.s for row in TABLE_3]), np.array(results[LITERAL].f1)
    series.append(Series(name="printed gaits, as printed", x=1e3 * s, y=1e3 / f1, shape="points"))
    chart = Chart(x="step length s [mm]", y="Q [0.001 m² s]", series=series)
    return make_chart_figure("trade-off", "The trade-off between stability and speed", [chart])


def tabulate_third(results: Mapping[str, Results]) -> list[Table]:
    """Return f of Table III, and its variables, next to ours, and the median of the GA's runs where there are any."""
    ours, values, variables = results[LITERAL], list[Mapping[str, Value]](), list[Mapping[str, Value]]()
    for row, best in zip(TABLE_3, ours.optima, strict=True):
        gaits = {f"gait, {name}": compute_f(row, F1MAX, **OPTIONS[name]) for name in (LITERAL, RAISED)}
        ends = ours.list_ends(f"{row.weight:g}") if ours.is_searched else []
        median = float(np.median(ends)) if ends else None
        values.append({"λ": row.weight, "print": row.f, **gaits, "GA, median": median, "optimum": best.objective})
        pairs: dict[str, Value] = {"λ": row.weight}
        for name, printed, here in zip(NAMES, row.x, best.x.values(), strict=True):
            pairs |= {f"{name} print": 1e3 * printed, f"{name} here": 1e3 * here}
        variables.append(pairs)
    caption = "Table III: f in print, of the printed gaits here, of our runs, all under the paper's f1max"
    words = "Table III: variables in print, and IPOPT's [mm]"
    return [tabulate("table3", caption, values), tabulate("table3-variables", words, variables)]


def tabulate_fourth(results: Mapping[str, Results]) -> Table:
    """Return Table IV next to ours in two readings."""
    rows = list[Mapping[str, Value]]()
    for name in (LITERAL, SECOND):
        result = results[name]
        for row, most, best in zip(TABLE_4, result.f1max_over_time, result.optima_over_time, strict=True):
            largest = {"f1max print": row.f1max, "f1max here": most}
            f = {"f print": row.f, "f of the gait": compute_f(row, row.f1max, **OPTIONS[name])}
            steps = {"s print [mm]": 1e3 * row.s, "s here [mm]": 1e3 * best.x["step_length_m"]}
            rows.append({"reading": name, "T [s]": row.step_time_s, **largest, **f, **steps})
    return tabulate("table4", "Table IV, λ = 0.15; f under the printed f1max, optima under the model's", rows)


def count_met(result: Results) -> int:
    """Return how many printed f of Table III our model meets within 1 %."""
    return sum(abs(f / row.f - 1) <= 0.01 for f, row in zip(result.list_f(TABLE_3), TABLE_3, strict=True))


def explain(results: Mapping[str, Results]) -> str:
    """Return what explains the print."""
    met = {name: count_met(results[name]) for name in READINGS}
    f1 = {name: results[name].f1[-1] for name in (LITERAL, RAISED)}
    pairs = zip(TABLE_4, results[SECOND].f1max_over_time, strict=True)
    misses = " / ".join(f"{100 * (most / row.f1max - 1):+.0f}" for row, most in pairs)
    return (
        f"With the ankle {1e3 * walk12_model.ANKLE_HEIGHT_M:g} mm above the ground, a number that "
        f"the paper does not give, {met[RAISED]} of 7 f of Table III are within 1 % ({met[LITERAL]} with the ankle on it), "
        f"and the gait of λ = 1 has f1 = {f1[RAISED]:.1f} instead of {f1[LITERAL]:.1f} 1/(m² s) (printed {F1MAX}). "
        f"The printed {GA.population * PRINTED_STEPS:,} time steps a generation are {GA.population} gaits times "
        f"{PRINTED_STEPS:,} steps of 0.0001 s. That is consistent with an integral over one second for every T, which gives "
        "Table IV its trend, while (9) as printed reverses it. Our largest f1 over one second still differ from the printed ones "
        f"by {misses} % at T = 2 / 1.5 / 0.8 / 0.5 s."
    )
