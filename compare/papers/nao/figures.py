"""Figures 9 to 19 of Gupta, Pratihar, Deb (2023), from our runs; printed solutions are points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from compare.analysis.units import name_in_words
from compare.drawing.charts import Chart, Series
from compare.papers.nao.results import (
    FOLDER,
    PHASES,
    PRINTED,
    PRINTED_X,
    RECONSTRUCTED,
    SEARCHES,
    NaoResults,
    make_spec,
)
from compare.papers.paper import make_gait_figure, read_rows
from compare.papers.paper_runs import get_history, get_point
from compare.report.document import Figure
from compare.report.study_sections import make_chart_figure

SOLVERS = {"PSO": "pso", "GA": "ga"}  # names that have colours
# Figures of clouds: phase, and variables from the first one on.
CLOUDS = {
    "10": ("ssp", 0, 3),
    "11": ("ssp", 3, 5),
    "12": ("ssp", 5, 7),
    "13": ("ssp", 7, 8),
    "14": ("ssp", 8, 9),
    "16": ("dsp", 0, 3),
    "17": ("dsp", 3, 5),
    "18": ("dsp", 5, 7),
    "19": ("dsp", 7, 8),
}
CONVERGENCE = {"9": "ssp", "15": "dsp"}
GENERATIONS = 200


def draw_figures(results: Mapping[str, NaoResults]) -> list[Figure]:
    """Return all figures in the paper's order; those of convergence need runs."""
    drawn = {int(number): draw_cloud(results[RECONSTRUCTED], number, *which) for number, which in CLOUDS.items()}
    if "damped" in results:
        drawn |= {
            int(number): draw_convergence(results["damped"], number, phase) for number, phase in CONVERGENCE.items()
        }
    return [drawn[number] for number in sorted(drawn)]


def draw_gait(result: NaoResults) -> Figure:
    """Return PSO's printed single support and the optimum."""
    spec = make_spec("ssp", result.reading)
    problem, best = spec.load(), get_point(result.best(spec))
    caption = "Single support (Fig. 20): PSO's printed solution, and IPOPT's optimum"
    return make_gait_figure(caption, {"PSO, printed": (problem, PRINTED_X["ssp", "PSO"]), "ipopt": (problem, best)})


def draw_convergence(result: NaoResults, number: str, phase: str) -> Figure:
    """Return the least, the mean and the largest best power of all runs over the generations."""
    series = list[Series]()
    for search, solver in SOLVERS.items():
        best = np.array([get_history(run, GENERATIONS) for run in result.list_runs(phase, search)])
        known = np.isfinite(best).all(axis=0)
        x, y = np.arange(1, GENERATIONS + 1)[known], best[:, known]
        series.append(Series(name=solver, x=x, y=y.min(axis=0), upper=y.max(axis=0), shape="band"))
        series.append(Series(name=solver, x=x, y=y.mean(axis=0)))
        at_end = np.array([GENERATIONS]), np.array([PRINTED[phase, search]["power_W"]])
        series.append(Series(name=f"{search} printed", x=at_end[0], y=at_end[1], shape="points"))
    chart = Chart(x="generation", y="best power [W]", series=series)
    caption = f"Fig. {number}, {PHASES[phase]}: mean and range of the best power, once all runs are feasible"
    return make_chart_figure(f"figure-{number}", caption, [chart])


def draw_cloud(result: NaoResults, number: str, phase: str, first: int, last: int) -> Figure:
    """Return the power of feasible gaits of one run of each search over some variables."""
    variables = make_spec(phase, result.reading).load().variables[first:last]
    labels = [f"{variable.name} [{variable.unit}]" for variable in variables]
    charts = [_make_cloud(result, phase, k, label) for k, label in enumerate(labels, start=first)]
    names = ", ".join(name_in_words(variable.name, variable.unit) for variable in variables)
    caption = (
        f"Fig. {number}, {PHASES[phase]}: power over {names}; feasible gaits of one run of PSO and GA, printed solutions and "
        "powers as points"
    )
    return make_chart_figure(f"figure-{number}", caption, charts)


def _make_cloud(result: NaoResults, phase: str, k: int, label: str) -> Chart:
    series = list[Series]()
    for search, solver in SOLVERS.items():
        cloud = np.array(result.computed[f"cloud-{phase}-{search}"])
        if len(cloud):
            series.append(Series(name=solver, x=cloud[:, k], y=cloud[:, -1], shape="points"))
    for search in SEARCHES:
        printed: Sequence[tuple[float, float]] = [(PRINTED_X[phase, search][k], PRINTED[phase, search]["power_W"])]
        if label.startswith("swing_height"):
            rows = read_rows(FOLDER / "swing_heights.csv")
            printed = [(float(row["swing_height_m"]), float(row[f"{search}_W"])) for row in rows]
        x, y = np.array(printed).T
        series.append(Series(name=f"{search} printed", x=x, y=y, shape="points"))
    return Chart(x=label, y="power [W]", series=series)
