"""What contradicts a run's own counts, its end or the judge is found without repeating the run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from compare.study.evidence import CHECKS, Context
from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop


def find_reasons(record: RunRecord) -> list[str]:
    return [reason for check in CHECKS if (reason := check(record, Context()))]


def test_a_forged_history_is_found_without_repeating_its_run() -> None:
    """An improvement moved to an earlier entry is not found."""
    settings = StudySettings(
        problems=(ProblemSpec(name="walk12-w015"),),
        solvers=(SolverSpec(name="pso"),),
        runs=1,
        stop=Stop(evaluations=100),
    )
    (record,) = run_study(Study(tasks=settings.tasks()))
    history, last = record.history, record.verdict.objective
    assert not find_reasons(record)
    sooner = replace(history, evaluations=(10, *history.evaluations[1:]))
    assert not find_reasons(replace(record, history=sooner))
    worse = last + record.inputs.objective.sign
    forged: dict[str, dict[str, Any]] = {
        "worsens": {"history": replace(history, objective=(last, worse))},
        "but the judge finds": {"history": replace(history, objective=(last + 1.0, last + 1.0))},
        "two entries at the same number": {"history": replace(history, evaluations=(100, 100))},
        "more than its 1 iterations": {"iterations": 1},
        "it counts 60 of 100 evaluations": {
            "evaluations": {"f": 60},
            "history": replace(history, evaluations=(50, 60)),
        },
        "ended by: no better point": {"status": "no better point in 5 generations"},
    }
    for words, changes in forged.items():
        assert any(words in reason for reason in find_reasons(replace(record, **changes))), words
