"""Gaits as one figure: the first one from the side, the deviation of the others from it, power and balance margin over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.charts import HEIGHT, WIDTH, Chart, Series, add_legend, draw_chart
from compare.drawing.figures import assign_looks
from compare.drawing.poses import draw_poses
from compare.drawing.shapes import Drawing, place_drawings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Result, sample_signals
from nlp_gait.formulation.display import Skeleton
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.signals import JOINT_UNITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PERIOD_S = 0.02  # between samples


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
    return draw_gaits({name: prepare_gait(Result(problem=problem, x=problem.check_x(x)))}).to_figure()


def draw_gaits(gaits: Mapping[str, GaitCurves], *, curves: bool = True) -> Drawing:
    """Draw the first gait from the side with the second one laid over it, and the curves of all.

    Raises:
        InputError: there is nothing to draw.
    """
    charts = make_gait_charts(gaits) if curves else []
    (name, first), *later = gaits.items()
    if first.skeleton is None and not charts:
        raise InputError("these gaits have neither a skeleton nor torques: there is nothing to draw")
    count = (first.skeleton is not None) + len(charts)
    columns = 2 if count == 4 else count
    panels, over = [], None
    if later and later[0][1].skeleton is not None:
        over = (later[0][0], later[0][1].skeleton, assign_looks(list(gaits))[later[0][0]])
    if first.skeleton is not None:
        panels.append(draw_poses(name, first.skeleton, WIDTH / max(columns, 2), HEIGHT, over))
    drawing = place_drawings([*panels, *(draw_chart(chart, WIDTH / columns, HEIGHT) for chart in charts)], columns)
    return add_legend(drawing, charts) if charts else drawing


def make_gait_charts(gaits: Mapping[str, GaitCurves]) -> list[Chart]:
    """Return the deviation of each gait from the first one, the power and the balance margin over time."""
    first, *later = gaits.values()
    curves: dict[str, dict[str, Array | None]] = {
        "deviation [mm]": {
            name: measure_deviation(gait.skeleton, first.skeleton)
            for name, gait in gaits.items()
            if gait is not first and gait.skeleton is not None and first.skeleton is not None
        },
        "mechanical power [W]": {name: gait.power for name, gait in gaits.items()},
        "balance margin [mm]": {name: gait.margin for name, gait in gaits.items()},
    }
    charts = []
    for words, values in curves.items():
        series = [Series(name=n, x=gaits[n].t, y=curve) for n, curve in values.items() if curve is not None]
        charts += [Chart(x="time [s]", y=words, series=series)] if series else []
    return charts


def measure_deviation(gait: Skeleton, reference: Skeleton) -> Array:
    """Return (T,) the largest distance of a joint from its place in a reference gait after the same share of the time [mm]."""
    drawn, planned = (np.concatenate([limb.points for limb in s.limbs], axis=1) for s in (gait, reference))
    share, steps = ((s.t - s.t[0]) / (s.t[-1] - s.t[0]) for s in (gait, reference))
    index = np.interp(share, steps, np.arange(len(steps)))
    low = np.minimum(index.astype(int), len(steps) - 2)
    weight = (index - low)[:, None, None]
    expected = (1.0 - weight) * planned[low] + weight * planned[low + 1]
    return 1000.0 * np.linalg.norm(drawn - expected, axis=2).max(axis=1)
