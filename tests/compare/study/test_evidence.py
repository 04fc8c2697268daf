"""What contradicts a run's own counts, its end or the judge is found without repeating the run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from compare.study.evidence import check_claims, check_history
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop


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
    assert not [*check_history(record), *check_claims(record)]
    sooner = replace(history, evaluations=(10, *history.evaluations[1:]))
    assert not [*check_history(replace(record, history=sooner))]
    worse = last + (1.0 if record.definition["objective"]["sense"] == "minimise" else -1.0)
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
        found = replace(record, **changes)
        assert any(words in reason for reason in (*check_history(found), *check_claims(found))), words
