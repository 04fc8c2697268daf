"""Records as rows of a table: what CSV files and data frames hold of a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.study.record import RunRecord
from nlp_gait.notebook import import_pandas

CALLS = ("f", "g", "gradient", "jacobian", "hessian")
JUDGED = ("objective", "violation", "feasible", "feasible_between_samples", "guaranteed")
HEADER = (
    *("problem", "solver", "run", "seed", "claimed", "status", "claimed_objective", "claimed_violation"),
    *JUDGED,
    *(f"calls_{kind}" for kind in CALLS),
    *("failed_evaluations", "iterations", "time_s"),
)


def row_of(record: RunRecord) -> list[object]:
    """A run under ``HEADER``; None where something is not known."""
    claims = (record.claimed_objective, record.claimed_violation)
    calls = [record.evaluations.get(kind) for kind in CALLS]
    return [
        *(record.problem, record.solver, record.run, record.seed, record.claimed, record.status, *claims),
        *judged(record),
        *(*calls, record.failed_evaluations, record.iterations, record.time_s.solve),
    ]


def judged(record: RunRecord) -> list[object]:
    """What the judge finds of a run, under ``JUDGED``."""
    verdict = record.verdict
    proven = None if verdict.guaranteed is None else verdict.guaranteed.satisfied
    return [verdict.objective, verdict.violation, verdict.feasible, verdict.dense_feasible, proven]


def frame_of(records: Sequence[RunRecord]) -> Any:
    """Records as a pandas data frame: a row a run, ``HEADER``, then a column ``x.<name>`` for each variable.

    Raises:
        MissingExtraError: pandas is not installed.
    """
    names = list(dict.fromkeys(name for record in records for name in record.x))
    rows = [[*row_of(record), *(record.x.get(name) for name in names)] for record in records]
    return import_pandas().DataFrame(rows, columns=[*HEADER, *(f"x.{name}" for name in names)])
