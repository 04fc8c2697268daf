"""Runs of a reproduction: start points, the best of several, and what becomes of a run that fails."""

from dataclasses import replace
from pathlib import Path

import pytest

import nlp_gait
from compare.papers.paper_runs import Runner, choose_best, make_start_tasks
from compare.study.run import ProblemSpec, Run, check_run
from nlp_gait.errors import InputError
from tests.compare.records import POWER, record, run_once

WALK = ProblemSpec(name="walk12")


def test_starts_are_those_of_one_solve_with_as_many() -> None:
    problem = WALK.load()
    solution = nlp_gait.solve(problem, starts=2, seed=5)
    tasks = make_start_tasks(WALK, 2, seed=5)
    assert [task.start for task in tasks] == [problem.by_name(start.x0) for start in solution.starts]
    assert run_once(tasks[1]).x == problem.by_name(solution.starts[1].x)


def test_the_best_run_succeeds_before_it_is_cheap() -> None:
    runs = [record("ga", run, [(10, value)]) for run, value in enumerate((3.0, 2.0, 1.0, 0.5))]
    runs[2] = replace(runs[2], reported_feasible=False)
    runs[3] = replace(runs[3], reported_feasible=False, feasible=False, violation=1.0, objective=0.5)
    assert choose_best(runs) is runs[1] and choose_best(runs[2:]) is runs[2]
    maximised = [replace(r, inputs=replace(r.inputs, objective=replace(POWER, sense="maximise"))) for r in runs[:2]]
    assert choose_best(maximised) is maximised[0]


def no_luck(*arguments: object) -> None:
    raise ValueError("no luck")


def test_a_run_without_a_point_ends_the_reproduction_and_says_why(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="walk12, no_luck, run 0 failed: ValueError: no luck; fix this and delete"):
        Runner(folder=tmp_path, jobs=1).run_tasks([Run(problem=WALK, solver=no_luck)])


def test_a_start_point_is_for_nlp_solvers() -> None:
    point = make_start_tasks(WALK, 1)[0].start
    check_run(Run(problem=WALK, solver="slsqp", start=point))
    with pytest.raises(InputError, match="'pso' takes no start point"):
        check_run(Run(problem=WALK, solver="pso", start=point))
