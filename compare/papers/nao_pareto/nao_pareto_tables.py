"""Tables of power against stability."""

from __future__ import annotations

import numpy as np

from compare.papers.nao_pareto.nao_pareto_claims import NEAR
from compare.papers.nao_pareto.nao_pareto_findings import NAMES, ParetoFindings, PhaseFindings
from compare.report.document import Rows, Value


def make_tables(findings: ParetoFindings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
    tables: dict[str, Rows] = {"fronts": [_make_front_row(phase) for phase in findings.phases]}
    for phase in findings.phases:
        tables[f"ends-{phase.problem.name}"] = _make_ends(phase)
        tables[f"constraints-{phase.problem.name}"] = _make_constraints(phase)
        tables[f"running-{phase.problem.name}"] = _make_running(phase)
    return tables


def _make_front_row(phase: PhaseFindings) -> list[Value]:
    low, high, answer = phase.front[0], phase.front[-1], phase.answer
    ends = [low.value, low.power_W, high.value, high.power_W]
    solved = [answer.points, answer.solved, 100 * answer.least_excess, answer.moved]
    return [phase.problem.name, len(phase.front), *ends, len(phase.bends.knees), *solved]


def _make_ends(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measures.items():
        ends = (100 * m.hypervolume[:, -1], m.igd[:, -1])
        spread = [float(value) for end in ends for value in (np.median(end), end.min(), end.max())]
        rows.append([NAMES[name], budget, len(m.time_s), *spread])
    return rows


def _make_constraints(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measures.items():
        columns = (100 * m.feasible, m.first_feasible, m.until(NEAR), m.time_s, m.objective_time_s)
        medians = [float(np.median(column)) for column in columns]
        rows.append([NAMES[name], budget, int(np.sum(m.hypervolume[:, -1] > 0.0)), *medians])
    return rows


def _make_running(phase: PhaseFindings) -> Rows:
    """Medians at each look of the runs with the largest budget."""
    chosen = [m for (_, budget), m in phase.measures.items() if budget == phase.budgets[-1]]
    columns = [chosen[0].evaluations]
    columns += [100 * np.median(m.hypervolume, axis=0) for m in chosen] + [np.median(m.igd, axis=0) for m in chosen]
    return np.column_stack(columns).tolist()
