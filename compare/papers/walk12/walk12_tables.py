"""Findings of the reproduced 12-joint walk, and its tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from compare.papers.paper_runs import Runs, choose_best, get_point
from compare.papers.walk12.walk12_errata import StableShare, compute_stable_share
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_3, TABLE_4
from compare.papers.walk12.walk12_runs import (
    HORIZONS,
    MODEL,
    PAPER,
    PathPoint,
    Walk12Effort,
    compute_f1,
    find_f1max_of_row,
    find_own_f1max,
    title_table_3,
    title_table_4,
)
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.task import IPOPT

SAME_OPTIMUM = 2e-4  # starts whose f differs by less agree
SEARCHES = ("ga", "pso")


@dataclass(frozen=True, kw_only=True)
class Walk12Findings:
    """All results of the reproduction.

    Attributes:
        effort: what was computed.
        runs: by title of the problem and solver.
        weighted: optima of the weighted sum over lambda.
        front: largest f1 for each step length.
    """

    effort: Walk12Effort
    runs: Runs
    weighted: Sequence[PathPoint]
    front: Sequence[PathPoint]
    f1_of_table_3: Sequence[float] = field(default_factory=lambda: [compute_f1(row) for row in TABLE_3])

    def records(self, label: str, weight: float, solver: str) -> Sequence[RunRecord]:
        """Return the runs of a solver at a lambda under a normalisation."""
        return self.runs[title_table_3(label, weight), solver]

    def optimum(self, label: str, weight: float) -> RunRecord:
        """Return IPOPT's best start at a lambda under a normalisation."""
        return choose_best(self.records(label, weight, IPOPT))

    @cached_property
    def own_f1max(self) -> float:
        """The model's largest f1 [1/(m^2 s)]."""
        return find_own_f1max(self.runs)

    @cached_property
    def stable(self) -> Sequence[StableShare]:
        """When each gait of Table III satisfies (8)."""
        return [compute_stable_share(row.x) for row in TABLE_3]

    def f_of_printed_gaits(self, label: str) -> list[float]:
        """Return f of the printed gaits in the model under a normalisation, on the dense grid."""
        f1max = F1MAX if label == PAPER else self.own_f1max
        known = zip(TABLE_3, self.f1_of_table_3, strict=True)
        return [row.weight * f1 / f1max + (1 - row.weight) * row.x[0] / F2MAX for row, f1 in known]


def get_dense(record: RunRecord) -> Mapping[str, float]:
    """Return the judge's indexes on the dense grid, which this problem has."""
    return record.verdict.dense or {}


def list_f(records: Sequence[RunRecord]) -> list[float]:
    """Return f at the end of each run; minus infinity without a feasible gait."""
    return [r.verdict.objective if r.verdict.feasible else -math.inf for r in records]


def make_tables(findings: Walk12Findings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
    return {
        "table3-paper": _table_3(findings, PAPER),
        "table3-model": _table_3(findings, MODEL),
        "gaits": _gaits(findings),
        "table4": _table_4(findings),
    }


def _table_3(findings: Walk12Findings, label: str) -> Rows:
    """f of the paper's gait and of every solver under one normalisation."""
    rows = []
    for row, of_printed_gait in zip(TABLE_3, findings.f_of_printed_gaits(label), strict=True):
        cells: list[Value] = [row.weight, row.f, of_printed_gait]
        for name in SEARCHES:
            f = list_f(findings.records(label, row.weight, name))
            cells += [max(f), float(np.median(f)), min(f)]
        begun, optimum = findings.records(label, row.weight, IPOPT), findings.optimum(label, row.weight)
        f_best = optimum.verdict.objective
        agreeing = sum(r.claimed and abs(r.verdict.objective - f_best) < SAME_OPTIMUM for r in begun)
        time_s = float(np.median([r.time_s.solve for r in begun]))
        rows.append([*cells, f_best, get_dense(optimum)["f"], agreeing, time_s])
    return rows


def _gaits(findings: Walk12Findings) -> Rows:
    """Gaits behind Table III under the paper's normalisation, and how long each is statically stable."""
    rows: list[Sequence[Value]] = []
    for row, f1, stable in zip(TABLE_3, findings.f1_of_table_3, findings.stable, strict=True):
        rows.append([row.weight, "paper", *row.x, f1, stable.share])
        for solver in (*SEARCHES, IPOPT):
            found = choose_best(findings.records(PAPER, row.weight, solver))
            figures = get_dense(found)
            rows.append([row.weight, solver.upper(), *get_point(found), figures["f1_per_m2s"], figures["stable_share"]])
    return rows


def _table_4(findings: Walk12Findings) -> Rows:
    """The paper's step times under both horizons of Q."""
    rows: list[Sequence[Value]] = []
    for row in TABLE_4:
        for horizon in HORIZONS:
            optimum = choose_best(findings.runs[title_table_4(row, horizon), IPOPT])
            words = {"step": "0 to T", "1s": "1 s"}[horizon]
            ours = [compute_f1(row, horizon=horizon), find_f1max_of_row(findings.runs, row, horizon)]
            ours += [optimum.verdict.objective, *get_point(optimum)]
            rows.append([row.step_time_s, words, row.f1max, row.f, row.implied_f1, *ours])
    return rows
