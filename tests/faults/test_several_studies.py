"""Studies with different settings write to one folder at the same time, and lose nothing."""

from __future__ import annotations

import multiprocessing
import random
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

from compare.study.record import RunRecord
from compare.study.record_files import find_record, read_records, write_record
from compare.study.task import ProblemSpec, Stop, Task

STUDIES, RUNS = 3, 6
SPEC = ProblemSpec(name="walk12")


def make_task(study: int, run: int) -> Task:
    return Task(problem=SPEC, solver="random", stop=Stop(evaluations=50 + study), run=run)


def write_study(folder: Path, study: int, barrier: Barrier, seed: int) -> None:
    """Write all records of a study, in step with the others, and read those of this study back in between."""
    draw = random.Random(seed)
    records = [RunRecord.make_failed(make_task(study, run), "tried") for run in range(RUNS)]
    barrier.wait(60)
    for run, record in enumerate(records):
        write_record(record, folder)
        found = find_record(folder, make_task(study, draw.randrange(run + 1)))
        assert found is not None and found.inputs.stop["evaluations"] == 50 + study
        assert len(read_records(folder)) > run  # as for the report, while others write


@pytest.mark.slow
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="processes cannot be copied here")
def test_several_studies_in_one_folder_lose_nothing(tmp_path: Path) -> None:
    SPEC.load()
    make_task(0, 0).inputs()  # built before the forks
    context = multiprocessing.get_context("fork")
    studies = [*range(STUDIES), 0]  # one of them twice
    barrier = context.Barrier(len(studies))
    jobs = [context.Process(target=write_study, args=(tmp_path, s, barrier, k)) for k, s in enumerate(studies)]
    for job in jobs:
        job.start()
    for job in jobs:
        job.join()
    assert [job.exitcode for job in jobs] == [0] * len(jobs)
    found = {(r.inputs.stop["evaluations"], r.run) for r in read_records(tmp_path)}
    assert found == {(50 + study, run) for study in range(STUDIES) for run in range(RUNS)}
    assert len(read_records(tmp_path)) == STUDIES * RUNS
