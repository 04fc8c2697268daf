"""Certainty as an answer: tables, and a picture of where many starts ended."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import with_unit
from compare.drawing.figures import COLOURS, new_figure, style
from compare.drawing.labels import axis_label
from compare.questions.answer import Answer
from compare.questions.certainty.study import Certainty
from compare.report.document import Figure, text_table

DRAWN, LISTED = 20, 10  # best distinct optima


def certainty_answer(study: Certainty) -> Answer:
    """How certain it is that the best known optimum is the global one."""
    problem, estimate = study.problem, study.unseen
    unit = problem.objective.unit
    optima = [(with_unit(o.objective, unit), f"{o.count:,}", f"{100 * o.share:.2f} %") for o in study.optima[:LISTED]]
    listed = f"Distinct optima of {study.starts:,} starts, {len(optima)} shown"
    covered = None if estimate.expected_covered is None else 100 * estimate.expected_covered
    estimates = [
        ("share of starts in unseen optima (Good, Turing)", f"{100 * estimate.good_turing:.3g} %"),
        ("expected number of all optima (Boender, Rinnooy Kan)", with_unit(estimate.expected_optima, "1", ".4g")),
        ("expected share of starts in seen optima (the same)", with_unit(covered, "%", ".4g")),
        ("largest share of one unseen optimum, 95 % confidence", f"{100 * estimate.largest_missed:.3g} %"),
    ]
    stem = f"{problem.name}-certainty"
    shown = "Where the starts ended, with the proven bound and the end of the long search."
    return Answer(
        stem=stem,
        title=f"{problem.name}: how certain the optimum is",
        verdict=(f"Proven: {study.proven}.", f"Supported: {study.supported}."),
        parts=(
            text_table((problem.objective.name, "starts", "share"), optima, listed),
            text_table(
                ("status", "starts"), [(k, f"{n:,}") for k, n in study.statuses.items()], "How the starts ended"
            ),
            text_table(("estimate", "value"), estimates, "Optima that no start reached: estimates, no proof"),
            Figure(name=stem, caption=shown, drawing=certainty_figure(study)),
        ),
        results={} if study.certificate_json is None else {f"{problem.name}-certificate": study.certificate_json},
        data=study.to_json(),
    )


def certainty_figure(study: Certainty) -> Drawing:
    """Objective and share of the best distinct optima; the proven bound and the end of the long search as lines."""
    objective = study.problem.objective
    shown = study.optima[:DRAWN]
    values, shares = [o.objective for o in shown], [100 * o.share for o in shown]
    with style():
        figure = new_figure(5.6, 3.6)
        axes = figure.subplots()
        axes.vlines(values, 0.0, shares, color=COLOURS["ipopt"], linewidth=1)
        label = f"distinct optima of {study.starts:,} starts of IPOPT ({len(shown)} of {len(study.optima)} shown)"
        axes.plot(values, shares, "o", color=COLOURS["ipopt"], label=label)
        if study.search is not None and study.search.objective is not None:
            label = f"CMA-ES, {study.search.evaluations:,} evaluations"
            axes.axvline(study.search.objective, color=COLOURS["cma"], linestyle="--", label=label)
        if study.certificate is not None and np.isfinite(study.certificate.bound):
            values.append(study.certificate.bound)
            axes.axvline(study.certificate.bound, color=COLOURS["ga"], linestyle=":", label="proven bound")
        pad = 0.05 * max(np.ptp(values), 0.01 * abs(values[0]))
        axes.set_xlim(min(values) - pad, max(values) + pad)
        axes.set_ylim(0.0, 105.0)
        axes.set_xlabel(axis_label(objective.name, objective.unit))
        axes.set_ylabel("share of converged starts [%]")
        figure.legend(loc="outside lower center")
    return figure
