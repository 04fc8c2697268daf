"""Gaits that a page draws itself in 3-D, in a report or alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from compare.drawing.figures import assign_looks
from compare.drawing.gait_figure import GaitCurves, draw_gaits, prepare_gait
from compare.report.document import Document, Figure
from compare.report.writing import render_page
from nlp_gait.errors import InputError
from nlp_gait.files import write_text
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.formulation.display import Skeleton

MOST_FRAMES, MOST_SIMULATED = 41, 601  # of a gait; the page interpolates between them


def describe_gaits(gaits: Mapping[str, GaitCurves], most_frames: int = MOST_FRAMES) -> dict[str, Any] | None:
    """Return the skeletons of gaits over time in millimetres and milliseconds; None without any."""
    looks = assign_looks(list(gaits))
    shown = [
        _describe_gait(name, gait.skeleton, looks[name].colour, most_frames)
        for name, gait in gaits.items()
        if gait.skeleton is not None
    ]
    return {"gaits": shown} if shown else None


def _describe_gait(name: str, skeleton: Skeleton, colour: str, most_frames: int) -> dict[str, Any]:
    frames = np.unique(np.linspace(0, len(skeleton.t) - 1, most_frames).round().astype(int))
    points = {"com": skeleton.com, "zmp": skeleton.zmp}
    return {
        "name": name,
        "colour": colour,
        "planar": skeleton.planar,
        "t": [round(1000.0 * t, 1) for t in skeleton.t[frames].tolist()],
        "ground": _to_mm(skeleton.ground),
        "limbs": [{"side": limb.side, "points": _to_mm(limb.points[frames])} for limb in skeleton.limbs],
        "soles": [
            {"side": s.side, "points": _to_mm(s.corners[frames]), "supports": s.supports[frames].astype(int).tolist()}
            for s in skeleton.soles
        ],
        **{key: None if place is None else _to_mm(place[frames]) for key, place in points.items()},
    }


def _to_mm(metres: Array) -> list[Any]:
    """Return whole millimetres; a skeleton has no unknown coordinates."""
    rounded: list[Any] = np.round(1000.0 * metres).astype(int).tolist()
    return rounded


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
    figure = Figure(name="gait", caption="", drawing=draw_gaits({name: gait}), gaits=data)
    return GaitPage(render_page(Document(title=title, parts=[figure])))
