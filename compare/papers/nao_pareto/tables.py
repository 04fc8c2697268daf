"""Tables of the report."""

from __future__ import annotations

import numpy as np

from compare.papers.nao_pareto.nao_pareto_claims import NEAR, claims
from compare.papers.nao_pareto.nao_pareto_findings import NAMES, Findings, PhaseFindings
from compare.report.document import Rows, Value


def all_tables(findings: Findings) -> dict[str, Rows]:
    """Rows by name; headings and formats stand in ``report.md``."""
    tables: dict[str, Rows] = {
        "claims": [(c.text, c.test, c.verdict, c.evidence) for c in claims(findings)],
        "fronts": [_front(phase) for phase in findings.phases],
    }
    for phase in findings.phases:
        tables[f"ends-{phase.problem.name}"] = _ends(phase)
        tables[f"constraints-{phase.problem.name}"] = _constraints(phase)
        tables[f"running-{phase.problem.name}"] = _running(phase)
    return tables


def _front(phase: PhaseFindings) -> list[Value]:
    low, high = phase.front[0], phase.front[-1]
    answer = phase.answer
    return [
        *(
            phase.problem.name,
            len(phase.front),
            low.value,
            low.power_W,
            high.value,
            high.power_W,
            len(phase.bends.knees),
        ),
        *(answer.points, answer.solved, 100 * answer.least_excess, answer.moved),
    ]


def _ends(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measured.items():
        volume, distance = 100 * m.hypervolume[:, -1], m.igd[:, -1]
        rows.append(
            [
                *(
                    NAMES[name],
                    budget,
                    len(m.time_s),
                    float(np.median(volume)),
                    float(volume.min()),
                    float(volume.max()),
                ),
                *(float(np.median(distance)), float(distance.min()), float(distance.max())),
            ]
        )
    return rows


def _constraints(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measured.items():
        rows.append(
            [
                *(NAMES[name], budget, int(np.sum(m.hypervolume[:, -1] > 0.0)), 100 * float(np.median(m.feasible))),
                *(float(np.median(m.first_feasible)), float(np.median(m.until(NEAR)))),
                *(float(np.median(m.time_s)), float(np.median(m.objective_time_s))),
            ]
        )
    return rows


def _running(phase: PhaseFindings) -> Rows:
    """Medians at each look of the runs with the largest budget."""
    budget = phase.budgets[-1]
    chosen = [m for (_, b), m in phase.measured.items() if b == budget]
    columns = [chosen[0].evaluations]
    columns += [100 * np.median(m.hypervolume, axis=0) for m in chosen] + [np.median(m.igd, axis=0) for m in chosen]
    return np.column_stack(columns).tolist()
