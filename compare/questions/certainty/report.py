"""Picture of where many starts ended."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.figures import COLOURS, new_figure, save, style
from compare.drawing.labels import axis_label
from compare.questions.certainty.study import Certainty

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 20


def certainty_figure(study: Certainty) -> Figure:
    """Objective and share of the best distinct optima; the proven bound and the end of the long search as lines."""
    objective = study.problem.objective
    shown = study.optima[:SHOWN]
    with style():
        figure = new_figure(5.6, 3.0)
        axes = figure.subplots()
        axes.vlines(
            [o.objective for o in shown], 0.0, [100 * o.share for o in shown], color=COLOURS["ipopt"], linewidth=1
        )
        axes.plot(
            [o.objective for o in shown],
            [100 * o.share for o in shown],
            "o",
            color=COLOURS["ipopt"],
            label=f"distinct optima of {study.starts:,} starts of IPOPT ({len(shown)} of {len(study.optima)} shown)",
        )
        if study.search is not None and study.search.objective is not None:
            label = f"CMA-ES, {study.search.evaluations:,} evaluations"
            axes.axvline(study.search.objective, color=COLOURS["cma"], linestyle="--", label=label)
        values = [o.objective for o in shown]
        if study.certificate is not None and np.isfinite(study.certificate.bound):
            values.append(study.certificate.bound)
            axes.axvline(study.certificate.bound, color=COLOURS["ga"], linestyle=":", label="proven bound")
        pad = 0.05 * max(np.ptp(values), 0.01 * abs(values[0]))
        axes.set_xlim(min(values) - pad, max(values) + pad)
        axes.set_ylim(0.0, 105.0)
        axes.set_xlabel(axis_label(objective.name, objective.unit))
        axes.set_ylabel("share of converged starts [%]")
        figure.legend(loc="outside lower center")
        figure.set_figheight(3.6)
    return figure


def write_certainty(folder: Path, study: Certainty) -> list[Path]:
    """Write the picture; returns its paths."""
    return list(save(certainty_figure(study), folder / f"{study.problem.name}-certainty"))
