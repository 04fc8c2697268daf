"""Gaits as one figure: the first one from the side, power and balance margin of all over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.charts import HEIGHT, WIDTH, Chart, Series, draw_chart
from compare.drawing.figures import LEGS, LINE, Drawing, Label, Stroke, draw_legend, place_drawings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Result, sample_signals
from nlp_gait.formulation.display import LEFT, RIGHT, Skeleton
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.signals import JOINT_UNITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PERIOD_S = 0.02  # between samples
GROUND = "#909090"
MARGIN = 0.04  # [m] around everything that moves
POSES, FAINTEST = 6, 0.25  # number of poses, and opacity of the first one; the last one has 1


@dataclass(frozen=True, kw_only=True, eq=False)
class GaitCurves:
    """Time histories of a gait for a figure."""

    skeleton: Skeleton | None  #: over time; None for a problem that has none
    t: Array  #: (T,) [s]
    power: Array | None  #: (T,) sum of the joints' |torque x rate| [W]; None for a problem without torques
    margin: Array | None  #: (T,) of ``Skeleton.margin``, in millimetres; None where no instant has one


@lock_casadi
def prepare_gait(result: Result) -> GaitCurves:
    """Compute the time histories of a result for a figure; InputError if there are none or time does not run forward."""
    problem = result.problem
    signals = sample_signals(result, PERIOD_S)
    arrays = signals.arrays
    skeleton = None if problem.display.skeleton is None else problem.display.skeleton(signals, problem.parameter_values)
    margin = None if skeleton is None else skeleton.margin()
    has_power = all(name in arrays and name in JOINT_UNITS for name in ("tau", "qd"))
    return GaitCurves(
        skeleton=skeleton,
        t=arrays["t"],
        power=np.abs(arrays["tau"] * arrays["qd"]).sum(axis=1) if has_power else None,
        margin=None if margin is None or np.isnan(margin).all() else 1000.0 * margin,
    )


def plot_gait(problem: GaitProblem, x: Array | Mapping[str, float], name: str) -> Figure:
    """Plot one gait, a point x of a problem, under the name of its solver; raises as ``prepare_gait``."""
    return place_drawings(draw_gaits({name: prepare_gait(Result(problem=problem, x=problem.check_x(x)))})).to_figure()


def draw_gaits(gaits: Mapping[str, GaitCurves], *, curves: bool = True) -> list[Drawing]:
    """Draw the first gait from the side, and the curves of all; raises InputError if there is nothing to draw."""
    charts = make_gait_charts(gaits) if curves else []
    first = next(iter(gaits.values()))
    if first.skeleton is None and not charts:
        raise InputError("these gaits have neither a skeleton nor torques: there is nothing to draw")
    return [*([] if first.skeleton is None else [draw_poses(first.skeleton)]), *map(draw_chart, charts)]


def make_gait_charts(gaits: Mapping[str, GaitCurves]) -> list[Chart]:
    """Return the power and the balance margin of all gaits over time."""
    curves: dict[str, dict[str, Array | None]] = {
        "mechanical power [W]": {name: gait.power for name, gait in gaits.items()},
        "balance margin [mm]": {name: gait.margin for name, gait in gaits.items()},
    }
    charts = []
    for words, values in curves.items():
        series = [Series(name=n, x=gaits[n].t, y=curve) for n, curve in values.items() if curve is not None]
        charts += [Chart(x="time [s]", y=words, series=series, is_time=True)] if series else []
    return charts


def draw_poses(first: Skeleton) -> Drawing:
    """Draw poses of a gait from the side, later ones darker, and a legend below."""
    low, high = first.box()
    low[2] = min(low[2], first.ground[:, 1].min() if first.planar else 0.0)
    ends = np.array([low - MARGIN, high + MARGIN])[:, [0, 2]] * (1.0, -1.0)
    scale = float(min((WIDTH, HEIGHT - LINE) / np.abs(ends[1] - ends[0])))
    corner = np.array([WIDTH, HEIGHT - LINE]) / 2.0 - scale * (ends[0] + ends[1]) / 2.0

    def place(points: Array) -> Array:  # pixels (..., 2)
        return corner + scale * points[..., [0, 2]] * (1.0, -1.0)

    shapes: list[Stroke | Label] = [Stroke(lines=[place(np.insert(first.ground, 1, 0.0, axis=1))], colour=GROUND)]
    chosen = np.unique(np.linspace(0, len(first.t) - 1, POSES).round().astype(int)).tolist()
    for k, opacity in zip(chosen, np.linspace(FAINTEST, 1.0, len(chosen)).tolist(), strict=True):
        parts = [(limb.side, limb.points[k], 1.5) for limb in first.limbs]
        parts += [(sole.side, np.concatenate([sole.corners[k], sole.corners[k, :1]]), 2.4) for sole in first.soles]
        shapes += [
            Stroke(lines=[place(points)], colour=LEGS[side], width=width, opacity=opacity)
            for side, points, width in parts
        ]
    legend = [("left leg", LEGS[LEFT], ""), ("right leg", LEGS[RIGHT], "")]
    shapes += draw_legend(legend, LINE / 2, HEIGHT - LINE, WIDTH)[0]
    return Drawing(width=WIDTH, height=HEIGHT, shapes=shapes)
