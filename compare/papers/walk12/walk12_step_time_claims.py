"""Checks of the claims of the 12-joint walk's paper on other step times (section 7.2, Table IV), as in ``walk12_claims.py``."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from compare.papers.claims import Check, compare_changes, compare_levels, require_change
from compare.papers.paper_runs import choose_best, compute_range
from compare.papers.walk12.walk12_claims import list_x
from compare.papers.walk12.walk12_findings import Walk12Findings, choose_median, list_rounded
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_4, PaperRow
from compare.papers.walk12.walk12_runs import HORIZONS, compute_f1, title_table_4
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.gaits.walk12.walk12_problem import Horizon


def _choose(
    findings: Walk12Findings, row: PaperRow, horizon: Horizon, solver: str, most_stable: bool = False
) -> RunRecord:
    runs = findings.runs[title_table_4(row, horizon, most_stable=most_stable), solver]
    return choose_best(runs) if solver == IPOPT else choose_median(runs)


def list_f1max(findings: Walk12Findings, horizon: Horizon, solver: str = IPOPT) -> list[float]:
    """Return f1 of the most stable gait at each T of Table IV [1/(m^2 s)], IPOPT's or that of a search's median run."""
    return [F1MAX * _choose(findings, row, horizon, solver, True).verdict.objective for row in TABLE_4]


def _check_f1max_over_time(findings: Walk12Findings, horizon: Horizon, solver: str) -> Check:
    f1max = list_f1max(findings, horizon, solver)
    return compare_levels([row.f1max for row in TABLE_4], f1max, found=", ".join(f"{value:.0f}" for value in f1max))


def _check_trend(findings: Walk12Findings, horizon: Horizon) -> Check:
    slow, fast, f1max = TABLE_4[0], TABLE_4[-1], list_f1max(findings, horizon)
    ours = 100 * (f1max[0] / f1max[-1] - 1)
    times = {"slow": slow.step_time_s, "fast": fast.step_time_s}
    return compare_changes(100 * (slow.f1max / fast.f1max - 1), ours, **times, found=ours)


def _check_slows(findings: Walk12Findings) -> Check:
    """Check how much slower each T of Table IV walks than the next lower one [%]: by the printed steps, and by the optima."""
    times, printed = np.array([[row.step_time_s, row.x[0]] for row in TABLE_4]).T
    speeds = [printed / times, 1e-3 * list_x(findings, IPOPT, "step")[:, 0] / times]
    changes = [[100 * (1 - slow / fast) for slow, fast in pairwise(row)] for row in speeds]
    texts = [", ".join(f"{speed:.3f}" for speed in row) for row in speeds]
    return require_change(changes, printed=texts[0], optima=texts[1], times=times)


def _check_f1_over_time(_: Walk12Findings, horizon: Horizon) -> Check:
    """Check whether f1 of the printed gaits rises with T, also for the gaits that round to the printed digits."""
    f1 = [compute_f1(row, horizon=horizon) for row in TABLE_4]
    ranges = [compute_range(compute_f1(row, horizon=horizon) for row in list_rounded(row)) for row in TABLE_4]
    least, most = ([100 * (a[k] / b[1 - k] - 1) for a, b in pairwise(ranges)] for k in (0, 1))
    texts = (", ".join(f"{v:.0f}" for v in f1), ", ".join(f"{low:.0f} to {high:.0f}" for low, high in ranges))
    return require_change([least, most], found=texts[0], ranges=texts[1])


def _check_variables_over_time(findings: Walk12Findings, horizon: Horizon, solver: str) -> Check:
    """Check the range of each variable over the T of Table IV [mm]."""
    printed, found = np.ptp([row.x for row in TABLE_4], axis=0) * 1e3, np.ptp(list_x(findings, solver, horizon), axis=0)
    texts = [", ".join(f"{value:.0f}" for value in values) for values in (printed, found)]
    return compare_levels(printed, found, ranges=texts[0], found=texts[1])


def _check_f_of_table_4(_: Walk12Findings, horizon: Horizon) -> Check:
    """Check f of the printed gaits in the model under the printed f1max of each T."""
    ours = [_compute_f(row, row.f1max, horizon) for row in TABLE_4]
    return compare_levels([row.f for row in TABLE_4], ours, found=", ".join(f"{f:.4f}" for f in ours))


def _check_optimal_over_time(findings: Walk12Findings, horizon: Horizon) -> Check:
    """Check f of the printed gaits against the optima, under the model's f1max of each T."""
    best = [_choose(findings, row, horizon, IPOPT).verdict.objective for row in TABLE_4]
    ours = [_compute_f(row, most, horizon) for row, most in zip(TABLE_4, list_f1max(findings, horizon), strict=True)]
    gaps = compute_range(100 * (1 - f / b) for f, b in zip(ours, best, strict=True))
    return compare_levels(best, ours, gaps=gaps)


def _compute_f(row: PaperRow, f1max: float, horizon: Horizon) -> float:
    """Return f of a printed gait under a normalisation."""
    return row.weight * compute_f1(row, horizon=horizon) / f1max + (1 - row.weight) * row.x[0] / F2MAX


def _check_f_over_time(findings: Walk12Findings) -> Check:
    """Check the spread of the optimal f over T with both horizons of Q [%]."""
    values: dict[str, list[float]] = {
        h: [_choose(findings, row, h, IPOPT).verdict.objective for row in TABLE_4] for h in HORIZONS
    }
    values["printed"] = [row.f for row in TABLE_4]
    spreads = {name: 100 * (max(f) / min(f) - 1) for name, f in values.items()}
    texts = {name: ", ".join(f"{value:.4f}" for value in f) for name, f in values.items()}
    return compare_levels(np.zeros(len(HORIZONS)), [spreads[h] for h in HORIZONS], f=texts, spread=spreads)


def _check_share_over_time(findings: Walk12Findings) -> Check:
    """Check the spread of f1 / f1max over T [%]: of the printed numbers, which give it by (11), and of the optima."""
    printed = [row.implied_f1 / row.f1max for row in TABLE_4]
    optima, f1max = [_choose(findings, row, "step", IPOPT) for row in TABLE_4], list_f1max(findings, "step")
    ours = [run.verdict.indexes["f1_per_m2s"] / most for run, most in zip(optima, f1max, strict=True)]
    spreads = [100 * (max(values) / min(values) - 1) for values in (printed, ours)]
    texts = [", ".join(f"{value:.3f}" for value in values) for values in (printed, ours)]
    return compare_levels(np.zeros(2), spreads, printed=texts[0], ours=texts[1], spreads=spreads)
