"""What contradicts a run's own counts, its end or the judge is found without repeating the run."""

from __future__ import annotations

from compare.study.evidence import CHECKS, Context
from compare.study.record import RunRecord


def find_reasons(record: RunRecord) -> list[str]:
    return [reason for check in CHECKS if (reason := check(record, Context()))]
