"""What the page of Gupta, Pratihar, Deb (2023) shows: Figures 9 to 19 and Tables 6 to 9 next to ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.analysis.units import name_in_words
from compare.drawing.charts import Chart, Series
from compare.papers.nao.results import (
    FOLDER,
    INDEXES,
    MARGINS,
    PHASES,
    PHYSICAL,
    PRINTED,
    PRINTED_OPTIONS,
    PRINTED_X,
    RECONSTRUCTED,
    SEARCHES,
    NaoResults,
    make_spec,
)
from compare.papers.paper import make_gait_figure, read_rows
from compare.papers.paper_runs import evaluate_point, get_history, tabulate
from compare.report.document import Figure, Part, Prose, Section, Table, Value
from compare.report.study_sections import make_chart_figure
from nlp_gait.formulation import Variable

# Variables of the clouds of each figure, from the first one to before the last one
CLOUDS = {
    "ssp": {10: (0, 3), 11: (3, 5), 12: (5, 7), 13: (7, 8), 14: (8, 9)},
    "dsp": {16: (0, 3), 17: (3, 5), 18: (5, 7), 19: (7, 8)},
}
CONVERGENCE = {"ssp": 9, "dsp": 15}
GENERATIONS = 200


def show(results: Mapping[str, NaoResults]) -> list[Part]:
    """Return gaits, figures and Tables 6 to 9 next to ours, and what stays unexplained."""
    result = results[RECONSTRUCTED]
    return [
        draw_gait(result),
        Section(title="Figures of the paper, from our computation", parts=draw_figures(results)),
        Section(
            title="Tables 6 to 9", parts=[*(tabulate_phase(result, phase) for phase in PHASES), tabulate_swings(result)]
        ),
        Section(title="How the reading was found, and what stays unexplained", parts=[Prose(explain(result))]),
    ]


def draw_figures(results: Mapping[str, NaoResults]) -> list[Figure]:
    """Return all figures in the paper's order; those of convergence need runs."""
    drawn = {
        number: draw_cloud(results[RECONSTRUCTED], number, phase, *variables)
        for phase, figures in CLOUDS.items()
        for number, variables in figures.items()
    }
    if "damped" in results:
        drawn |= {n: draw_convergence(results["damped"], n, phase) for phase, n in CONVERGENCE.items()}
    return [drawn[number] for number in sorted(drawn)]


def draw_gait(result: NaoResults) -> Figure:
    """Return PSO's printed single support and the optimum."""
    spec = make_spec("ssp", result.reading)
    problem, best = spec.load(), [*result.best(spec).x.values()]
    caption = "Single support (Fig. 20): PSO's printed solution, and IPOPT's optimum"
    return make_gait_figure(caption, {"PSO, printed": (problem, PRINTED_X["ssp", "PSO"]), "ipopt": (problem, best)})


def draw_convergence(result: NaoResults, number: int, phase: str) -> Figure:
    """Return the least, the mean and the largest best power of all runs over the generations."""
    series = list[Series]()
    for search, solver in SEARCHES.items():
        best = np.array([get_history(run, GENERATIONS) for run in result.list_runs(phase, search)])
        known = np.isfinite(best).all(axis=0)
        x, y = np.arange(1, GENERATIONS + 1)[known], best[:, known]
        series.append(Series(name=solver, x=x, y=y.min(axis=0), upper=y.max(axis=0), shape="band"))
        series.append(Series(name=solver, x=x, y=y.mean(axis=0)))
        printed = np.array([PRINTED[phase, search]["power_W"]])
        series.append(Series(name=f"{search} printed", x=np.array([GENERATIONS]), y=printed, shape="points"))
    chart = Chart(x="generation", y="best power [W]", series=series)
    caption = f"Fig. {number}, {PHASES[phase]}: mean and range of the best power, once all runs are feasible"
    return make_chart_figure(f"figure-{number}", caption, [chart])


def draw_cloud(result: NaoResults, number: int, phase: str, first: int, last: int) -> Figure:
    """Return the power of feasible gaits of one run of each search over some variables."""
    variables = make_spec(phase, result.reading).load().variables[first:last]
    charts = [_make_cloud(result, phase, k, variable) for k, variable in enumerate(variables, start=first)]
    names = ", ".join(name_in_words(variable.name, variable.unit) for variable in variables)
    caption = (
        f"Fig. {number}, {PHASES[phase]}: power over {names}; feasible gaits of one run of PSO and GA, printed solutions and "
        "powers as points"
    )
    return make_chart_figure(f"figure-{number}", caption, charts)


def _make_cloud(result: NaoResults, phase: str, k: int, variable: Variable) -> Chart:
    series = list[Series]()
    for search, solver in SEARCHES.items():
        cloud = np.array(result.computed[f"cloud-{phase}-{search}"])
        if len(cloud):
            series.append(Series(name=solver, x=cloud[:, k], y=cloud[:, -1], shape="points"))
    for search in SEARCHES:
        printed: Sequence[tuple[float, float]] = [(PRINTED_X[phase, search][k], PRINTED[phase, search]["power_W"])]
        if variable.name == "swing_height_m":
            rows = read_rows(FOLDER / "swing_heights.csv")
            printed = [(float(row["swing_height_m"]), float(row[f"{search}_W"])) for row in rows]
        x, y = np.array(printed).T
        series.append(Series(name=f"{search} printed", x=x, y=y, shape="points"))
    return Chart(x=f"{variable.name} [{variable.unit}]", y="power [W]", series=series)


def compute_misfit(phase: str, **options: Any) -> float:
    """Return the largest error of the printed margins with options [mm]; of the least ones alone in double support."""
    points = {
        search: evaluate_point(make_spec(phase, PHYSICAL, **options), PRINTED_X[phase, search]) for search in SEARCHES
    }
    margins = MARGINS if phase == "ssp" else MARGINS[:2]
    return max(1000 * abs(point[index] - PRINTED[phase, s][index]) for s, point in points.items() for index in margins)


def explain(result: NaoResults) -> str:
    """Return how the reading was found, and what stays unexplained."""
    readings: dict[str, Mapping[str, Any]] = {
        "physical gravity and ten intervals": {},
        "ten samples alone": {"intervals": 9},
        "the sign of g alone": {"zmp_gravity": "printed"},
        "both": PRINTED_OPTIONS,
    }
    found = ", ".join(f"{compute_misfit('ssp', **options):.2f} mm ({words})" for words, options in readings.items())
    missing = [PRINTED["ssp", s]["power_W"] - result.measure("ssp", s)["power_W"] for s in SEARCHES]
    double = {search: result.measure("dsp", search) for search in SEARCHES}
    here, printed = (
        " / ".join(f"{figures['torque_change_Nm']:.3f}" for figures in values)
        for values in (double.values(), [PRINTED["dsp", s] for s in SEARCHES])
    )
    means = [1000 * (double["PSO"][index] - PRINTED["dsp", "PSO"][index]) for index in MARGINS[2:]]
    return (
        "**The reading.** (27) makes g a vector that points down; (19) and (20) subtract a number g, and a cycle is divided into "
        "ten parts, whose samples may be ten or eleven. All four combinations were evaluated at the print; the largest "
        f"error of the eight printed margins of single support is {found}. So the authors computed with ten samples and with "
        "g = +9.8 in the ZMP alone, which turns the sign of its inertial term; their torques have physical gravity. This is a "
        "reconstruction: no reading of the print alone gives it. Its formula is in `docs/model/balance.md`.\n\n"
        f"**Unexplained.** Power of single support is {missing[0]:.3f} W (PSO) and {missing[1]:.3f} W (GA) below the print, "
        "nearly a constant, which touches no optimum or ranking. Torque change of double support is "
        f"{here} Nm (PSO / GA) for {printed} Nm in print; its mean margins differ by {means[0]:+.1f} and {means[1]:+.1f} mm (x, "
        "y). Its level of power depends on who carries the arms, which is not printed."
    )


def tabulate_phase(result: NaoResults, phase: str) -> Table:
    """Return variables and figures of the printed solutions, in print and here, and of IPOPT's optimum."""
    spec = make_spec(phase, result.reading)
    names, best = spec.load().names, result.best(spec)
    columns = dict[str, Mapping[str, float]]()
    for search in SEARCHES:
        x = dict(zip(names, PRINTED_X[phase, search], strict=True))
        columns[f"{search} print"] = {**x, **PRINTED[phase, search]}
        columns[f"{search} here"] = result.measure(phase, search)
    columns["optimum"] = {**best.x, **best.metrics}
    rows: list[Mapping[str, Value]] = [
        {"": name, **{title: column.get(name) for title, column in columns.items()}} for name in (*names, *INDEXES)
    ]
    numbers = {"ssp": (6, 7), "dsp": (8, 9)}[phase]
    return tabulate(f"table{numbers[1]}", f"Tables {numbers[0]} and {numbers[1]}, {PHASES[phase]}", rows)


def tabulate_swings(result: NaoResults) -> Table:
    """Return the printed powers over the swing height next to those of the printed solutions raised."""
    rows = []
    for row in read_rows(FOLDER / "swing_heights.csv"):
        height = float(row["swing_height_m"])
        pairs: dict[str, Value] = {"swing height [m]": height}
        for search in SEARCHES:
            pairs[f"{search} print [W]"] = float(row[f"{search}_W"])
            pairs[f"{search} here [W]"] = result.measure("ssp", search, swing_height_m=height)["power_W"]
        rows.append(pairs)
    return tabulate("table7-swing-heights", "Table 7, rows 6 to 11; the printed solutions raised", rows)
