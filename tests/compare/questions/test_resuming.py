"""Questions that are killed continue when they are rerun: no finished step is repeated, and the answer is the same.

All run by `compare/questions/question.py`; those here store solves, runs of searches, proofs, variants and fronts.
"""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import nlp_gait
from compare.cli import app
from compare.questions import local_optima
from compare.study.store import Store, encode_outcome, parse_outcome, store_runs
from nlp_gait.backends.identity import hash_json
from nlp_gait.backends.solve import run_starts
from nlp_gait.backends.solvers.ipopt import Ipopt
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best, Evaluations, Guess, Outcome
from tests.compare.cli.test_question_commands import PARETO

pytestmark = pytest.mark.usefixtures("undrawn_pictures")

RUN = CliRunner()
TIMES = ("time_s", "cpu_s", "run_time_s", "files")
NAO = ("nao-ssp", "--set", "intervals=2", "--starts", "1")
WHOLE = {
    "sweep": ("sweep", "walk12", "--over", "step_length_m=0.08,0.1", "--starts", "1"),
    "sweep by a search": (
        "sweep", "walk12", "--over", "foot_lift_m=0.01:0.03:3", "--algorithm", "random", "--evaluations", "200",
    ),
    "variants": ("variants", *NAO, "--variant", "limits:motors=limits"),
    "certainty": ("certainty", "walk12", "--starts", "4", "--evaluations", "0", "--time-limit", "0"),
}  # fmt: skip
# Complete runs of these take long; their beginning is enough, since all load finished solves in the same way.
BEGUN = {
    "pareto": (*PARETO, "--search", "none"),
    "cycles": ("sweep", "nao-cycle", "--over", "speed_m_s=0.02,0.03", "--starts", "1", "--set", "intervals=2"),
}


class Killed(BaseException):
    """Is not caught anywhere, so that nothing happens after it, as after a kill."""


@pytest.fixture(autouse=True)
def cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local_optima, "BATCH", 2)


def kill_after(monkeypatch: pytest.MonkeyPatch, steps: int) -> list[str]:
    """Collect the names of stored results; raise Killed after so many."""
    stored: list[str] = []
    save = Store.save

    def counted(self: Store, name: str, inputs: Any, *rest: Any) -> Any:
        result = save(self, name, inputs, *rest)
        stored.append(f"{name} {hash_json(inputs)}")
        if len(stored) == steps:
            raise Killed
        return result

    monkeypatch.setattr(Store, "save", counted)
    return stored


def answer(out: Path, *arguments: object) -> tuple[Any, str]:
    """Return the answer without its times, and the messages."""
    done = RUN.invoke(app, [*map(str, arguments), "--out", str(out), "--json"])
    assert done.exit_code == 0, done.output
    return without_times(json.loads(done.stdout)), done.stderr


def without_times(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if key not in TIMES}
    return [without_times(item) for item in data] if isinstance(data, list) else data


@pytest.mark.parametrize("case", WHOLE)
def test_a_rerun_continues(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        all_steps = kill_after(patch, 0)
        undisturbed, _ = answer(tmp_path / "undisturbed", *WHOLE[case])
    killed = tmp_path / "killed"
    with monkeypatch.context() as patch:
        before = kill_after(patch, max(1, len(all_steps) // 2))
        with pytest.raises(Killed):
            RUN.invoke(app, [*WHOLE[case], "--out", str(killed)])
    with monkeypatch.context() as patch:
        after = kill_after(patch, 0)
        resumed, _ = answer(killed, *WHOLE[case])
    assert resumed == undisturbed
    assert not set(before) & set(after) and sorted([*before, *after]) == sorted(
        all_steps
    )  # no step is lost or repeated


def end_at_start(problem: GaitProblem, x0: Array, *_: object) -> Outcome:
    """Stand in for a solve."""
    return Outcome(
        solver="ipopt", x0=x0, x=x0, claimed=True, status="found", objective=1.0, cost=1.0, violation=0.0, iterations=1,
        evaluations=Evaluations(f=1), time_s=0.0, guess=Guess(primal=x0, bounds=x0, rows=x0, width=1.0),
    )  # fmt: skip


@pytest.mark.parametrize("case", BEGUN)
def test_a_second_call_repeats_no_solve(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if case == "cycles":  # the others need multipliers
        monkeypatch.setattr(Ipopt, "__init__", lambda *_: None)
        monkeypatch.setattr(Ipopt, "run", lambda _, *rest: end_at_start(*rest))
        monkeypatch.setattr(Ipopt, "run_from", lambda _, problem, near, *rest: end_at_start(problem, near.x))
    calls = []
    for _ in range(2):
        with monkeypatch.context() as patch:
            calls.append(kill_after(patch, 1))
            with pytest.raises(Killed):
                RUN.invoke(app, [*BEGUN[case], "--out", str(tmp_path)])
    first, second = calls
    assert first[-1].startswith("solve ")
    assert not set(first) & set(second)


def test_results_of_another_robot_are_others(tmp_path: Path) -> None:
    robot = tmp_path / "my.json"
    text = (files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8")
    heavy = text.replace('"mass_kg": 1.04956', '"mass_kg": 1.5')
    answers = []
    for content in (text, heavy, text):
        robot.write_text(content, encoding="utf-8")
        sweep = ("sweep", *NAO, "--robot", robot, "--over", "swing_height_m=0.02")
        answers.append(answer(tmp_path / "out", *sweep))
    (first, said), (other, other_said), (again, again_said) = answers
    assert other["points"][0]["objective"] > first["points"][0]["objective"]
    assert again == first and again_said == "2 of 2 results were stored by an earlier run\n"
    assert said == other_said == ""


def test_steps_of_forked_starts_are_counted(tmp_path: Path) -> None:
    """Starts that run side by side are steps of this call too."""
    problem = nlp_gait.load("walk12")
    points = [problem.start_point(np.random.default_rng(seed)) for seed in range(5)]
    first = Store(tmp_path)
    list(run_starts(store_runs(first), problem, points[:3], workers=2))
    assert first.summary == ""
    second = Store(tmp_path)
    list(run_starts(store_runs(second), problem, points, workers=2))
    assert second.summary == "3 of 5 results were stored by an earlier run"


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
