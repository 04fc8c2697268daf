"""Data that a page draws itself: runs for charts with hover, zoom and a choice of solvers; gaits in 3-D, also alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.record_statistics import ECDF_TARGETS, Curve
from compare.drawing.comparison_figures import SMALLEST_GAP
from compare.drawing.figures import Look, assign_looks, render_svg
from compare.drawing.gait_figure import GaitCurves, plot_gaits, prepare_gait
from compare.report.document import Document, Figure
from compare.report.writing import render_page
from nlp_gait.errors import InputError
from nlp_gait.files import write_text
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.formulation.display import Skeleton

MOST_FRAMES, MOST_SIMULATED = 61, 601  # of a gait; the page interpolates between them
SIGNIFICANT_DIGITS = 5
CAPTION = "Left blue, right orange; the support polygon green, the zero-moment point pink, the centre of mass in ink."


def describe_runs(comparison: Comparison) -> dict[str, Any]:
    """Return the best so far of all runs of a problem: gaps are relative, costs are equivalent evaluations and seconds."""
    looks = assign_looks([solver.name for solver in comparison.solvers])
    return {
        "kind": "convergence",
        "smallest": SMALLEST_GAP,
        "targets": _round(np.array(ECDF_TARGETS)),
        "objective": f"{comparison.objective.name} [{comparison.objective.unit}]",
        "solvers": [_describe_solver(comparison, solver, looks[solver.name]) for solver in comparison.solvers],
    }


def describe_gaits(gaits: Mapping[str, GaitCurves], most_frames: int = MOST_FRAMES) -> dict[str, Any] | None:
    """Return the skeletons of gaits over time in millimetres and milliseconds, with power and margin; None without any."""
    looks = assign_looks(list(gaits))
    shown = [
        _describe_gait(name, gait, looks[name].colour, most_frames)
        for name, gait in gaits.items()
        if gait.skeleton is not None
    ]
    return {"kind": "gaits", "gaits": shown} if shown else None


def _describe_solver(comparison: Comparison, solver: SolverRuns, look: Look) -> dict[str, Any]:
    runs = [
        {"run": record.run, "value": _round(np.array([comparison.value(cost)]), 9)[0], **_describe_curve(curve)}
        for record, cost, curve in zip(solver.records, solver.costs, solver.curves, strict=True)
    ]
    known = {axis: solver.has_costs(axis) for axis in ("evaluations", "seconds")}
    return {"name": solver.name, "colour": look.colour, "line": look.line, "known": known, "runs": runs}


def _describe_curve(curve: Curve) -> dict[str, Any]:
    """Return the entries at which the best so far improves, and the last one."""
    best = np.minimum.accumulate(curve.gap)
    improves = np.append(best[:1] < np.inf, best[1:] < best[:-1])
    improves[-1:] = True
    kept = {"evaluations": curve.evaluations, "seconds": curve.seconds, "gap": best}
    return {name: _round(values[improves]) for name, values in kept.items()}


def _describe_gait(name: str, gait: GaitCurves, colour: str, most_frames: int) -> dict[str, Any]:
    skeleton = gait.skeleton
    assert skeleton is not None
    frames = np.unique(np.linspace(0, len(gait.t) - 1, most_frames).round().astype(int))
    points = {"com": skeleton.com, "zmp": skeleton.zmp}
    curves = {"power": gait.power, "margin": gait.margin}
    return {
        "name": name,
        "colour": colour,
        "planar": skeleton.planar,
        "t": _round(1000.0 * gait.t[frames]),
        "ground": _to_mm(skeleton.ground),
        "limbs": [{"side": limb.side, "points": _to_mm(limb.points[frames])} for limb in skeleton.limbs],
        "soles": [
            {"side": s.side, "points": _to_mm(s.corners[frames]), "supports": s.supports[frames].astype(int).tolist()}
            for s in skeleton.soles
        ],
        **{key: None if place is None else _to_mm(place[frames]) for key, place in points.items()},
        **{key: None if curve is None else _round(curve[frames]) for key, curve in curves.items()},
    }


def _to_mm(metres: Array) -> list[Any]:
    """Return whole millimetres; a skeleton has no unknown coordinates."""
    rounded: list[Any] = np.round(1000.0 * metres).astype(int).tolist()
    return rounded


def _round(values: Array, digits: int = SIGNIFICANT_DIGITS) -> list[float | int | None]:
    """Round to significant digits; None for infinite and unknown values."""
    rounded = [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values]
    return [int(value) if value is not None and value.is_integer() else value for value in rounded]


@dataclass(frozen=True)
class GaitPage:
    """A page that plays a gait; notebooks display it."""

    html: str  #: the whole page, without any other file

    def write(self, path: Path) -> None:
        """Write the page; raises OutputError."""
        write_text(path, self.html)

    def _repr_html_(self) -> str:
        frame = 'sandbox="allow-scripts" title="gait in 3-D" style="width: 100%; height: 52rem; border: 0"'
        return f'<iframe srcdoc="{escape(self.html)}" {frame}></iframe>'


def animate_gait(problem: GaitProblem, x: Array | Mapping[str, float], name: str) -> GaitPage:
    """Return the page of a gait, a point x of a problem, under the name of its solver; InputError if it cannot be drawn."""
    return _make_page(problem.title, name, prepare_gait(Result(problem=problem, x=problem.check_x(x))))


def animate_simulation(skeleton: Skeleton, power_W: Array) -> GaitPage:
    """Return the page of a simulation with the mechanical power (T,) of its drives."""
    margin = 1000.0 * skeleton.margin()
    return _make_page(
        skeleton.title, "engine", GaitCurves(skeleton=skeleton, t=skeleton.t, power=power_W, margin=margin)
    )


def _make_page(title: str, name: str, gait: GaitCurves) -> GaitPage:
    data = describe_gaits({name: gait}, MOST_SIMULATED)
    if data is None:
        raise InputError(f"{title}: this problem has no skeleton to draw")
    drawing = plot_gaits({name: gait})
    figure = Figure(name="gait", caption=CAPTION, drawing=drawing, data=data)
    return GaitPage(render_page(Document(title=title, parts=[figure]), [render_svg(drawing)]))
