"""Studies: the same files whatever the workers, resumed after kill -9, all wrong said before the work; gradient methods."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.study.record import SCHEMA, read_record
from compare.study.run import ProblemSpec, Run, plan_runs
from compare.study.study import Study, read_records, read_study_file, run_study, write_record
from metaheuristics import ParticleSwarm, SearchError
from nlp_gait.errors import GaitError, InputError
from tests.compare.records import run_once

EXAMPLE = Path(__file__).parents[3] / "examples" / "bring_your_own.py"
SSP = ProblemSpec(name="nao-ssp")
SOLVERS = [("", "pso"), ("", "ga"), ("", "ipopt"), ("pso-20", ParticleSwarm(population=20))]
SMALL = plan_runs([ProblemSpec(name="walk12")], SOLVERS, runs=2, starts=2, evaluations=500)


def contents(folder: Path) -> dict[str, Any]:
    """Every record but its times."""
    found = {}
    for path in sorted(folder.glob("records/*/*.json")):
        data = json.loads(path.read_text())
        assert data.pop("time_s")["solve"] > 0.0
        found[str(path.relative_to(folder))] = data
    return found


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    run_study(Study(runs=SMALL, folder=folder))
    return folder


def test_each_run_has_one_file_named_after_its_inputs(undisturbed: Path) -> None:
    names = [f"walk12/{solver}-000{run}" for solver in ("ga", "ipopt", "pso", "pso-20") for run in (0, 1)]
    runs = read_study_file(undisturbed).runs
    assert sorted(contents(undisturbed)) == sorted(f"records/{name}.json" for name in runs)
    assert sorted(name.rpartition("-")[0] for name in runs) == sorted(names)


def test_many_workers_give_the_same_files(undisturbed: Path, tmp_path: Path) -> None:
    run_study(Study(runs=SMALL, folder=tmp_path, jobs=2))
    assert contents(tmp_path) == contents(undisturbed)


def test_a_damaged_record_is_named(undisturbed: Path, tmp_path: Path) -> None:
    run = SMALL[0]
    (record,) = [r for r in read_records(undisturbed)[0] if (r.solver, r.run) == (run.title, run.number)]
    path = write_record(record, tmp_path)
    good = path.read_text()
    for text, message in (
        (good[: len(good) // 2], "is not valid JSON"),
        ("[]", f"'schema' must be {SCHEMA}, got 'list'"),
        (good.replace(f'"schema": {SCHEMA}', '"schema": 0'), f"'schema' must be {SCHEMA}, got 0"),
        (good.replace('"build": ', '"build": -1'), "times must be at least 0"),
        (good.replace('"history": {', '"history": 3, "other": {'), "damaged"),
        (good.replace(' "failed_evaluations": 0,\n', ""), "failed_evaluations is missing"),
        (good.replace(' "feasible": true,\n', ""), "feasible is missing"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=message):
            run_study(Study(runs=(run,), folder=tmp_path))


def test_killed_at_a_random_moment_and_resumed_it_ends_as_undisturbed(undisturbed: Path, tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from tests.compare.study.test_study import SMALL, Study, run_study\n"
        "if __name__ == '__main__': run_study(Study(runs=SMALL, folder=Path(sys.argv[1]), jobs=2))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path)], cwd=Path(__file__).parents[3], start_new_session=True
    )
    while process.poll() is None and len(list(tmp_path.glob("records/*/*.json"))) < 2:
        time.sleep(0.01)
    time.sleep(random.Random(4).uniform(0.0, 0.05))
    with suppress(ProcessLookupError):  # it may have ended
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert all(read_record(path) for path in tmp_path.glob("records/*/*.json"))  # whole or absent
    run_study(Study(runs=SMALL, folder=tmp_path))
    assert contents(tmp_path) == contents(undisturbed)


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (Run(problem=SSP, solver="psoo"), "unknown algorithm 'psoo'; did you mean"),
        (Run(problem=SSP, solver="pso", settings={"inertial": 1}), "no setting 'inertial'"),
        (Run(problem=SSP, solver="ipopt", settings={"tol": 1}), "unknown setting of ipopt 'tol'"),
        (Run(problem=SSP, solver="slsqp", settings={"tol": 1}), "unknown setting of slsqp 'tol'"),
        (Run(problem=SSP, solver="slsqp", evaluations=9), "at least 10 evaluations"),
        (Run(problem=SSP, solver="pso", evaluations=9), "population of 'pso', 50, got 9"),
        (Run(problem=SSP, solver="pso", handling="penalty"), "penalty=WEIGHT"),
        (Run(problem=SSP, solver="pso", handling="debb"), "penalty=WEIGHT"),
        (Run(problem=SSP, solver="ipopt", time_limit_s=0.0), "time_limit_s must be"),
        (Run(problem=SSP, solver="pso", label="../../etc"), "label has 1 to 64 letters"),
        (Run(problem=SSP, solver="pso", seed=2**63 - 1, number=1), "64 bits"),
        (Run(problem=ProblemSpec(name="nao-spp"), solver="pso"), "unknown problem"),
        (Run(problem=SSP, solver="pymoo:XYZ"), "unknown algorithm 'pymoo:XYZ'"),
        (Run(problem=SSP, solver="none.py:A"), "cannot be read: No such file"),
        (Run(problem=SSP, solver="nowhere_at_all:A"), "is installed; name a file as nowhere_at_all.py:A"),
        (Run(problem=SSP, solver=f"{EXAMPLE}:Shrinkin"), "did you mean 'Shrinking'"),
    ],
)
def test_what_cannot_run_is_reported_before_the_work(task: Run, message: str, tmp_path: Path) -> None:
    with pytest.raises((GaitError, SearchError), match=message):
        run_study(Study(runs=(task,), folder=tmp_path))
    assert not list(tmp_path.rglob("*.json"))


def test_two_solvers_of_one_name_are_refused() -> None:
    task = Run(problem=SSP, solver="pso")
    with pytest.raises(InputError, match="give them different labels"):
        Study(runs=(task, replace(task, settings={"population": 20})))


OPTIMUM = 0.845868


def test_slsqp_finds_the_optimum_and_counts_every_finite_difference() -> None:
    record = run_once(Run(problem=SSP, solver="slsqp"))
    assert record.reported_feasible and record.feasible
    assert record.objective == pytest.approx(OPTIMUM, rel=1e-4)
    assert record.counts["f"] == record.history.evaluations[-1] > 10 * record.iterations
    assert (np.diff(record.history.evaluations) > 0).all() and (np.diff(record.time_s.history) > 0.0).all()


def test_slsqp_keeps_its_best_point_within_the_budget() -> None:
    record = run_once(Run(problem=SSP, solver="slsqp", evaluations=45))
    assert record.status == "evaluation budget used" and not record.reported_feasible
    assert record.counts["f"] <= 45 and set(record.x) == set(SSP.load().names)
    assert run_once(Run(problem=SSP, solver="slsqp", time_limit_s=1e-9)).status == "time limit reached"
