"""Figures 8 to 17 of Goswami, Vadakkepat, Phung (2008), from our computation, and the trade-off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compare.drawing.charts import Chart, Series
from compare.papers.paper import make_gait_figure
from compare.papers.paper_runs import get_history, get_point, read_index
from compare.papers.walk12.results import (
    GA,
    GA_EVALUATIONS,
    LAST,
    LITERAL,
    RAISED,
    SECOND_ROW,
    SMALL,
    TABLE_3,
    PaperRow,
    Results,
    follow,
    make_spec,
)
from compare.report.document import Figure
from compare.report.study_sections import make_chart_figure
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_steps import JOINTS

STEPS = 10  # of Figs. 9 and 10
ANGLES = {"9": ((1, 12), (2, 11), (3, 10)), "10": ((4, 9), (5, 8), (6, 7))}
ZMPS = {"12, 13": SECOND_ROW, "14, 15": LAST, "16, 17": SMALL}


def draw_figures(results: Mapping[str, Results]) -> list[Figure]:
    """Return all figures in the paper's order, that of epochs with runs, and then the trade-off."""
    result = results[LITERAL]
    drawn = [draw_angles(number) for number in ANGLES]
    drawn += [draw_zmp(result, numbers, row) for numbers, row in ZMPS.items()]
    has_runs = any(solver == "ga" for _, solver in result.runs)
    return [*([draw_epochs(result)] if has_runs else []), *drawn, draw_trade_off(results)]


def draw_gait(result: Results) -> Figure:
    """Return the printed gait of lambda = 0.15 and the optimum."""
    problem = make_spec(LITERAL, "0.15", SECOND_ROW.weight).load()
    best = get_point(result.best("0.15"))
    return make_gait_figure(
        "λ = 0.15 (Fig. 11): the printed gait, and IPOPT's optimum",
        {"printed": (problem, SECOND_ROW.x), "ipopt": (problem, best)},
    )


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
    robot = load_point_mass_biped()
    half, back, front = 1e3 * robot.foot_width_m / 2, -1e3 * robot.foot_back_m, 1e3 * robot.foot_front_m
    gaits = {"printed": row.x, "optimum": get_point(result.best(f"{row.weight:g}"))}
    paths: dict[str, tuple[Array, Array]] = {}
    for name, x in gaits.items():
        step = follow(x)
        paths[name] = step["t"], 1e3 * step["zmp_foot"]
    sole = np.array([[back, half], [front, half], [front, -half], [back, -half], [back, half]]).T
    over_sole = [Series(name=name, x=path[:, 0], y=path[:, 1]) for name, (_, path) in paths.items()]
    over_sole.append(Series(name="sole", x=sole[0], y=sole[1]))
    over_time = [
        Series(name=f"{axis}, {name}", x=t, y=path[:, k])
        for name, (t, path) in paths.items()
        for k, axis in enumerate("xy")
    ]
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
        front = [(1e3 * get_point(run)[0], 1e3 * read_index(run, "Q_m2s")) for run in results[name].front]
        series.append(Series(name=f"least Q, {name}", x=np.array(front)[:, 0], y=np.array(front)[:, 1]))
    printed = np.array([(1e3 * row.s, 1e3 / f1) for row, f1 in zip(TABLE_3, results[LITERAL].f1, strict=True)])
    series.append(Series(name="printed gaits, as printed", x=printed[:, 0], y=printed[:, 1], shape="points"))
    chart = Chart(x="step length s [mm]", y="Q [0.001 m² s]", series=series)
    return make_chart_figure("trade-off", "The trade-off between stability and speed", [chart])
