"""A report says which settings were changed, and from which default."""

import json
from dataclasses import replace

from compare.report.provenance import compare_with_defaults
from compare.study.record import RunRecord
from compare.study.run_task import run_task
from compare.study.task import Handling, ProblemSpec, Stop, Task
from metaheuristics import ParticleSwarm

WALK = ProblemSpec(name="walk12")


def run(**task: object) -> RunRecord:
    return run_task(Task(problem=WALK, stop=Stop(evaluations=1200), **task))  # type: ignore[arg-type]


def test_defaults_are_distinguished_from_changed_settings() -> None:
    budget, changed, defaults = compare_with_defaults(run(solver="pso"))
    assert (budget, changed) == ("1\u202f200", "none")
    assert "population: 50" in defaults and "constraint handling: Deb" in defaults
    for solver in ("pso", ParticleSwarm(population=30)):
        settings = {"population": 30} if solver == "pso" else {}
        _, changed, defaults = compare_with_defaults(run(solver=solver, settings=settings))
        assert changed == "population: 30 (default 50)" and "population" not in defaults


def test_handling_and_gradient_methods_are_described_too() -> None:
    _, changed, _ = compare_with_defaults(
        run(solver="pso", handling=Handling(name="penalty", settings={"weight": 2.0}))
    )
    assert changed.startswith("constraint handling: ") and "weight: 2.0" in changed and "(default Deb)" in changed
    budget, changed, defaults = compare_with_defaults(run(solver="ipopt", settings={"few_rows": False}))
    assert budget == "no limit" and changed == "few_rows: false (default null)" and "few_rows" not in defaults


def test_neither_what_a_solver_chooses_nor_a_stored_tuple_is_a_change() -> None:
    record = run(solver="ipopt")
    stored = replace(record, settings=json.loads(json.dumps(record.settings)))
    assert [compare_with_defaults(of)[1] for of in (record, stored)] == ["none", "none"]
