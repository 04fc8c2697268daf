"""Gaits as one figure: the first one from the side, power and balance margin of all over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.charts import Chart, Series, draw_chart
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
    return place_drawings(draw_gaits({name: prepare_gait(Result(problem=problem, x=problem.check_x(x)))})).to_figure()


def draw_gaits(gaits: Mapping[str, GaitCurves], *, curves: bool = True) -> list[Drawing]:
    """Draw the first gait from the side with the second one laid over it, and the curves of all.

    Raises:
        InputError: there is nothing to draw.
    """
    charts = make_gait_charts(gaits) if curves else []
    first, *later = gaits.values()
    if first.skeleton is None and not charts:
        raise InputError("these gaits have neither a skeleton nor torques: there is nothing to draw")
    over, panels = None, []
    if later and later[0].skeleton is not None:
        name = list(gaits)[1]
        over = (name, later[0].skeleton, assign_looks(list(gaits))[name])
    if first.skeleton is not None:
        panels.append(draw_poses(first.skeleton, over))
    return [*panels, *map(draw_chart, charts)]


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
