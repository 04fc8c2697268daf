"""Tables and figure: at what price each opponent is how near, and who is nearest at which budget."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.budgets.opponents import LARGEST, OPPONENTS, TARGETS
from compare.analysis.record_statistics import Curve, Weighting, compute_running_time, make_curve
from compare.drawing.figures import assign_looks, make_figure, save, use_log_axes, use_style
from compare.study.record import RunRecord
from compare.study.task import ProblemSpec

Curves = Mapping[str, Sequence[Curve]]
"""Runs by label."""

BUDGETS = (100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000, LARGEST)
LEADERS = 3  # named at each budget
GREATEST_GAP, LEAST_GAP = 10.0, 1e-5  # of the figure


def curves_of(problem: ProblemSpec, records: Sequence[RunRecord], reference: float) -> list[Curve]:
    """Best so far of runs, derivatives charged as forward differences."""
    return [make_curve(record, problem.load().objective, reference, Weighting()) for record in records]


def gap_at(run: Curve, budget: float) -> float:
    """Gap of a run after a budget; infinite without a feasible point."""
    within = run.gap[run.evaluations <= budget]
    return float(np.min(within, initial=math.inf))


def median_gap(runs: Sequence[Curve], budget: float) -> float:
    """Median over runs of the gap after a budget."""
    return float(np.median([gap_at(run, budget) for run in runs]))


def price(runs: Sequence[Curve], target: float) -> tuple[float, int]:
    """Expected evaluations until a target is reached, and how many runs reached it."""
    reached = [run.cost_to_reach(target) for run in runs]
    return compute_running_time(reached, [run.total_cost() for run in runs]), sum(map(math.isfinite, reached))


def leaders(curves: Curves, budget: int) -> list[tuple[str, float]]:
    """Labels and median gaps of those that are nearest after a budget; who knows its budget takes part at its own only.

    Of those within the tightest target, where runs end, the cheapest come first.
    """
    plans = {opponent.label: opponent.evaluations for opponent in OPPONENTS if opponent.planned}
    taking_part = [label for label in curves if plans.get(label, budget) == budget and label != "ipopt"]
    gaps = [(label, median_gap(curves[label], budget)) for label in taking_part]
    near = [pair for pair in gaps if math.isfinite(pair[1])]
    return sorted(near, key=lambda pair: (max(pair[1], TARGETS[-1]), price(curves[pair[0]], TARGETS[-1])[0]))[:LEADERS]


def write_page(folder: Path, found: Mapping[str, Curves], runs: int) -> list[Path]:
    """Write ``budgets.md`` and ``budgets.png`` with ``.svg``; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    text = folder / "budgets.md"
    text.write_text(page(found, runs), encoding="utf-8")
    return [text, *figure(folder / "budgets", found)]


def page(found: Mapping[str, Curves], runs: int) -> str:
    """Both tables in Markdown."""
    problems = list(found)
    labels = dict.fromkeys(label for curves in found.values() for label in curves)
    targets = [f"{100 * target:g} %" for target in TARGETS]
    lines = [f"Expected evaluations until within {', '.join(targets)} of the best known, {runs} runs", ""]
    lines += [f"| | {' | '.join(problems)} |", f"|---|{'---|' * len(problems)}"]
    for label in labels:
        cells = [" / ".join(_price(found[p][label], t) for t in TARGETS) if label in found[p] else "" for p in problems]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    lines += ["", f"Nearest after a budget: median gap of {runs} runs", ""]
    lines += [f"| evaluations | {' | '.join(problems)} |", f"|---|{'---|' * len(problems)}"]
    for budget in BUDGETS:
        cells = [", ".join(f"{label} {_gap(gap)}" for label, gap in leaders(found[p], budget)) for p in problems]
        lines.append(f"| {budget:,} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _price(runs: Sequence[Curve], target: float) -> str:
    expected, reached = price(runs, target)
    if not reached:
        return "-"
    share = "" if reached == len(runs) else f" ({reached}/{len(runs)})"
    return f"{float(f'{expected:.2g}'):,.0f}{share}"


def _gap(gap: float) -> str:
    return f"{100 * gap:.2g} %" if gap > TARGETS[-1] else f"< {100 * TARGETS[-1]:g} %"


def figure(stem: Path, found: Mapping[str, Curves]) -> tuple[Path, Path]:
    """Median gap over evaluations, a panel for each problem; a line ends where more than half of the runs have ended."""
    labels = [
        label for label in dict.fromkeys(label for curves in found.values() for label in curves) if label != "ipopt"
    ]
    look = assign_looks(labels)
    grid = np.geomspace(BUDGETS[0], LARGEST, 121)
    with use_style():
        drawing = make_figure(7.4, 3.4)
        panels = drawing.subplots(1, len(found), sharey=True, squeeze=False)[0]
        for axes, (problem, curves) in zip(panels, found.items(), strict=True):
            for label in labels:
                if label in curves:
                    end = float(np.median([run.total_cost() for run in curves[label]]))
                    at = np.append(grid[grid < end], end)
                    gaps = np.array([median_gap(curves[label], budget) for budget in at])
                    shown = np.where(np.isfinite(gaps), np.maximum(gaps, LEAST_GAP), np.nan)
                    axes.plot(at, shown, look[label].line, color=look[label].colour, label=label, linewidth=1.1)
            axes.set_title(problem, loc="left")
            axes.set_xlabel("evaluations")
            use_log_axes(axes, both=True)
            axes.set_xlim(BUDGETS[0], LARGEST)
            axes.set_ylim(LEAST_GAP, GREATEST_GAP)
            for target in TARGETS:
                axes.axhline(target, color="0.7", linewidth=0.6, linestyle=":")
        panels[0].set_ylabel("median gap to the best known [1]")
        drawn = {line.get_label(): line for axes in panels for line in axes.get_lines() if line.get_label() in labels}
        names = [label for label in labels if label in drawn]
        drawing.legend([drawn[name] for name in names], names, loc="outside lower center", ncols=6)
        drawing.set_figheight(drawing.get_figheight() + 0.19 * -(-len(names) // 6))
        return save(drawing, stem)
