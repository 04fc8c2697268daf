"""User-defined algorithms that fail in every way: each has a record of its failure, and the others' records are complete."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, read_records, run_study

PSO = Run(problem=ProblemSpec(name="walk12"), solver="pso", evaluations=200)

ALGORITHM = """
import os, sys, time
import numpy as np

class Algorithm:
    population = 20
    name = "hostile"

    def start(self, start):
        {start}
        self.s, self.X = start, start.initial
        return self

    def ask(self):
        {ask}
        return self.X

    def tell(self, X, f, violation, rule):
        {tell}
        self.X = self.s.rng.uniform(self.s.lower, self.s.upper, (20, len(self.s.lower)))

    def stop(self):
        return ()
{end}
"""
# Where it is put, what is done there, and what the record says; None for a run that ends well in spite of it.
WAYS: dict[str, tuple[str, str, str | None]] = {
    "raises at import": ("end", "raise RuntimeError('no luck')", r"fails at line \d+, `raise Runtime.*no luck"),
    "exits at import": ("end", "sys.exit(3)", "SystemExit: 3"),
    "is no code": ("end", "def :", "SyntaxError"),
    "raises at start": ("start", "raise ValueError('x' * 10**6)", "failed: ValueError: xxx"),
    "raises in ask": ("ask", "raise KeyError", "failed: KeyError"),
    "raises in tell": ("tell", "1 / 0", "ZeroDivisionError: division by zero"),
    "raises what is no Exception": ("tell", "raise BaseException('b')", "failed: BaseException: b"),
    "another shape": ("ask", "return np.zeros(3)", r"ask: points must have shape \(P, 4\)"),
    "no points": ("ask", "return np.zeros((0, 4))", "with P >= 1"),
    "no numbers": ("ask", "return 'points'", "something other than numbers"),
    "nothing": ("ask", "return None", "ask: points must have shape"),
    "not a number": ("ask", "return np.full((2, 4), np.nan)", "outside the bounds"),
    "out of bounds": ("ask", "return self.s.upper[None] + 1", "outside the bounds"),
    "never returns at import": ("end", "time.sleep(10**6)", "evaluated nothing within its time limit of 0.5 s"),
    "calls sys.exit": ("tell", "sys.exit('bye')", "failed: SystemExit: bye"),
    "ends its process": ("tell", "os._exit(7)", "its process ended without a result, by status 7"),
    "is killed": ("tell", "os.kill(os.getpid(), 9)", "by signal SIGKILL"),
    "prints megabytes": ("tell", "print('x' * 10**7); sys.stderr.write('y' * 10**7)", None),
    "closes the outputs": ("start", "os.close(1); os.close(2)", None),
    "changes what it was told": ("tell", "f[:] = -1e9; violation[:] = 0", None),
    "writes into its bounds": ("start", "start.lower[:] = -9", "read-only"),
    "a population that is not a number": (
        "end",
        "Algorithm.population = 'many'",
        "population must be a whole number >= 1",
    ),
    "leaves a child": ("start", "os.fork() or time.sleep(10**6)", None),
}


def written(folder: Path, name: str, way: str) -> Path:
    place, what, _ = WAYS[way]
    parts = dict.fromkeys(("start", "ask", "tell"), "pass") | {"end": ""}
    path = folder / f"{name}.py"
    path.write_text(ALGORITHM.format(**{**parts, place: what}))
    return path


@pytest.mark.commit
def test_many_hostile_plug_ins_leave_the_others_records_whole(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (alone,) = run_study(Study(runs=(PSO,)))
    ways = {f"h{k}": way for k, way in enumerate(WAYS)}
    hostile = [
        replace(PSO, solver=f"{written(tmp_path, label, way)}:Algorithm", label=label, time_limit_s=limit)
        for label, way in ways.items()
        for limit in [0.5 if way == "never returns at import" else 60.0]  # on a busy machine a process may begin late
    ]
    runs = (PSO, *hostile)
    records = run_study(Study(runs=runs, folder=tmp_path / "out"))
    assert capfd.readouterr().out == ""
    assert len(read_records(tmp_path / "out")[0]) == len(runs)  # every file is read strictly
    (pso,) = [record for record in records if record.solver == "pso"]
    assert (pso.x, pso.objective, pso.history) == (alone.x, alone.objective, alone.history)
    for record in (record for record in records if record.solver in ways):
        said = WAYS[ways[record.solver]][2]
        assert record.reported_feasible == (said is None), (ways[record.solver], record.status)
        assert record.reported_feasible or not record.feasible
        assert (
            re.match("evaluation budget used|time limit reached", record.status)
            if said is None
            else re.search(said, record.status)
        ), (ways[record.solver], record.status)
