"""Steps of questions in the store: runs of solvers with every bit, in forks, stopped, and of a changed robot."""

import json
import math
from dataclasses import fields, replace
from importlib.resources import files
from pathlib import Path

import numpy as np
from compare.study.store import Store, encode_outcome, parse_outcome, store_runs

import nlp_gait
from compare.questions.question import Work, find
from compare.questions.sweep import Sweep, parse_axis
from nlp_gait.backends.solve import run_starts
from nlp_gait.formulation.solution import Best, Outcome


def test_results_of_another_robot_are_others(tmp_path: Path) -> None:
    robot = tmp_path / "my.json"
    text = (files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8")
    heavy = text.replace('"mass_kg": 1.04956', '"mass_kg": 1.5')
    assert heavy != text
    powers, stored = [], []
    for content in (text, heavy, text):
        robot.write_text(content, encoding="utf-8")
        problem, store = nlp_gait.load("nao-ssp", robot=str(robot), intervals=2), Store(tmp_path)
        sweep = Sweep(problem=problem, axes=[parse_axis("swing_height_m=0.02")], starts=1)
        powers.append(find(sweep, Work(store=store))[0].objective)
        stored.append(len(list((tmp_path / "store").iterdir())))
    assert powers[1] > powers[0] == powers[2]
    assert stored == [2, 4, 4]


def test_forked_starts_are_stored(tmp_path: Path) -> None:
    problem = nlp_gait.load("walk12")
    points = [problem.start_point(np.random.default_rng(seed)) for seed in range(5)]
    first = Store(tmp_path)
    list(run_starts(store_runs(first), problem, points[:3], workers=2))
    assert len(list((tmp_path / "store").iterdir())) == 3
    second = Store(tmp_path)
    list(run_starts(store_runs(second), problem, points, workers=2))
    assert len(list((tmp_path / "store").iterdir())) == 5


def test_a_stored_outcome_has_every_bit() -> None:
    problem = nlp_gait.load("walk12")
    (outcome,) = nlp_gait.solve(problem).starts
    strange = replace(outcome, objective=math.nan, violation=math.inf, cost=-0.0, history=(Best(3, None, 0.5),))
    for whole in (outcome, strange, replace(outcome, guess=None)):
        back = parse_outcome(json.loads(json.dumps(encode_outcome(whole), allow_nan=False)))
        for field in fields(Outcome):
            if field.name != "guess":
                assert repr(getattr(back, field.name)) == repr(getattr(whole, field.name))
        for name in ("x", "x0"):
            assert getattr(back, name).tobytes() == getattr(whole, name).tobytes()
        if whole.guess is not None:
            assert back.guess is not None and back.guess.width == whole.guess.width
            assert all(
                getattr(back.guess, name).tobytes() == getattr(whole.guess, name).tobytes()
                for name in ("primal", "bounds", "rows")
            )


def test_a_solve_that_was_stopped_is_not_finished(tmp_path: Path) -> None:
    problem, store = nlp_gait.load("walk12"), Store(tmp_path)
    solver = store_runs(store)
    x0 = (problem.lower + problem.upper) / 2
    stopped = solver.run(problem, x0, lambda: True)
    assert stopped.status == "was interrupted" and not list((tmp_path / "store").iterdir())
    whole = solver.run(problem, x0)
    assert whole.converged and len(list((tmp_path / "store").iterdir())) == 1
    warm = solver.run_from(problem, whole)
    later = store_runs(Store(tmp_path))
    stored = later.run(problem, x0)
    stored_warm = later.run_from(problem, stored)
    assert warm is not None and stored_warm is not None and repr(stored_warm) == repr(warm)
