"""Ctrl-C in every long command: one sentence, exit status 130, what was found until then is kept and named; and its handlers."""

import itertools
import json
import os
import pickle
import re
import signal
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import nlp_gait
from compare.cli import app, questions
from compare.papers import load_reproduction
from compare.papers.paper_runs import Effort, Runner
from compare.questions import sweep
from compare.study.record import read_record
from nlp_gait.backends.solvers.solver import IterationWatch
from nlp_gait.interrupts import (
    Interrupted,
    defer_interrupts,
    delay_interrupts,
    exit_on_interrupt,
    raise_interrupts,
)
from tests.faults.processes import ROOT, start, wait_for

SWEEP = "sweep walk12 --over step_length_m=0.05:0.12:30 --starts 1"
LIFTS = "sweep walk12 --over foot_lift_m=0.01,0.02 --starts 1"


def press_after(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, calls: int) -> None:
    """Ctrl-C during a certain call of a method."""
    method, count = getattr(owner, name), itertools.count(1)

    def counted(*arguments: Any, **named: Any) -> Any:
        if next(count) == calls:
            signal.raise_signal(signal.SIGINT)
        return method(*arguments, **named)

    monkeypatch.setattr(owner, name, counted)


def run(*arguments: str) -> Result:
    before = signal.getsignal(signal.SIGINT)
    done = CliRunner().invoke(app, list(arguments))
    assert done.exit_code == 130, done.output
    assert done.stderr.startswith("nlp-gait: interrupted") and done.stderr.count("\n") == 1
    assert signal.getsignal(signal.SIGINT) is before
    return done


def test_solve_within_a_later_start_keeps_the_best_of_the_earlier_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = nlp_gait.solve(nlp_gait.load("walk12"), starts=1)
    press_after(monkeypatch, IterationWatch, "eval", 3 * whole.starts[0].iterations)
    out = tmp_path / "best.json"
    done = run("solve", "walk12", "--starts", "50", "--jobs", "1", "--out", str(out))
    kept = json.loads(out.read_text())
    starts, last = len(kept["starts"]), kept["starts"][-1]
    assert 2 <= starts < 50 and kept["feasible"] and kept["objective"] >= whole.objective - 1e-6
    assert last["status"] == "was interrupted" or last["claimed"]
    assert kept["status"].startswith(f"interrupted in start {starts} of 50; ")
    assert f"interrupted in start {starts} of 50; the best point so far is in {out}" in done.stderr
    assert "walk12: f " in done.stdout


def test_solve_within_the_first_start_keeps_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    press_after(monkeypatch, IterationWatch, "eval", 4)
    with pytest.raises(Interrupted, match="interrupted in start 1 of 2") as caught:
        nlp_gait.solve(nlp_gait.load("walk12"), starts=2)
    solution = caught.value.partial
    assert isinstance(solution, nlp_gait.Solution)
    assert not solution.converged and solution.best.iterations == 3 and "was interrupted" in solution.status
    assert isinstance(caught.value, KeyboardInterrupt)
    assert str(pickle.loads(pickle.dumps(caught.value))) == "interrupted in start 1 of 2"


KEPT = r"; the results are in .*"
NOTHING = r"; (\d) finished results are stored in .*"


@pytest.mark.parametrize(
    ("owner", "name", "calls", "line", "said", "table"),
    [
        (IterationWatch, "eval", 60, SWEEP, rf"after (\d+) of 30 points, not all.*{KEPT}", "step_length_m-ipopt"),
        (questions, "add_origin", 1, LIFTS, "at the end" + KEPT, "foot_lift_m-ipopt"),
        (sweep, "solve_both_ways", 1, LIFTS, "after 0 of 4 solves" + NOTHING, ""),
    ],
)
@pytest.mark.usefixtures("coarse_pictures")
def test_a_question_writes_what_it_has_or_counts_what_is_stored(
    owner: object, name: str, calls: int, line: str, said: str, table: str, tmp_path: Path, monkeypatch: Any
) -> None:
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "solve-1.json").write_text("{}")
    press_after(monkeypatch, owner, name, calls)
    done = run(*line.split(), "--out", str(tmp_path))
    match = re.fullmatch(rf"nlp-gait: interrupted ?{said}; rerun the same command to continue\n", done.stderr)
    assert match is not None and f" in {tmp_path};" in done.stderr, done.stderr
    if table:
        (file,) = tmp_path.glob(f"*-{table}.csv")
        points = len(file.read_text().splitlines()) - 1
        assert (points == int(match[1]) >= 1 if match.groups() else points == 2) and done.stdout
    else:
        assert int(match[1]) == len(list(tmp_path.glob("store/*.json"))) >= 1
        assert [path.name for path in tmp_path.iterdir()] == ["store"]


def test_compare_with_worker_processes_is_continued_by_the_same_command(tmp_path: Path) -> None:
    """As a terminal does it: the signal goes to the workers too."""
    study = "compare walk12 --algorithms pso --runs 400 --starts 0 --evaluations 2000 --jobs 2 --out"
    process = start(*study.split(), str(tmp_path))
    wait_for(lambda: bool(list(tmp_path.glob("records/*/pso-*.json"))))
    os.killpg(process.pid, signal.SIGINT)
    _, messages = process.communicate(timeout=60)
    records = list(tmp_path.glob("records/*/*.json"))
    assert process.returncode == 130, messages
    assert messages.count("\n") == 1 and f"stored in {tmp_path}; rerun the same command to continue" in messages
    assert f"interrupted after {len(records)} of 400 runs" in messages
    assert all(read_record(path).counts == {"f": 2000} for path in records)
    assert not list(tmp_path.rglob("*.tmp*")) and not (tmp_path / "report.html").exists()


def test_reproduce_reports_its_stored_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run_two(runner: Runner, _: Effort) -> None:
        for name, function in (("one", lambda: 1), ("two", lambda: signal.raise_signal(signal.SIGINT))):
            runner.compute([(name, ({}, function))])

    module = import_module("compare.papers.nao.nao")
    monkeypatch.setattr(module, "REPRODUCTION", replace(load_reproduction("nao"), compute=run_two))
    done = run("reproduce", "nao", "--out", str(tmp_path))
    assert f"1 finished results are stored in {tmp_path}; rerun the same command to continue" in done.stderr
    assert [path.name.partition("-")[0] for path in (tmp_path / "store").iterdir()] == ["one"]


PRESSED_AT_IMPORT = """
import signal, sys

class Presses:
    name = sys.argv.pop(1)

    def find_spec(self, name, *rest):
        if name == self.name:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Presses())
from compare.__main__ import main
main()
"""


@pytest.mark.parametrize("module", ["typer", "nlp_gait.backends.kernel.compiled"])
def test_while_modules_are_imported(module: str) -> None:
    """Before the command has begun, and within it."""
    done = subprocess.run(
        [sys.executable, "-c", PRESSED_AT_IMPORT, module, "solve", "walk12", "--starts", "1"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=60,
    )
    assert done.returncode == 130, done.stderr
    assert done.stderr.startswith("nlp-gait: interrupted") and done.stderr.count("\n") == 1
    assert done.stdout == ""


PRESSED_WITHIN_EXEC = """
import sys
from nlp_gait.interrupts import exit_on_interrupt, raise_interrupts

exit_on_interrupt()
try:
    with raise_interrupts():
        exec("import signal; signal.raise_signal(signal.SIGINT)")
except KeyboardInterrupt:
    sys.exit(130)
"""


def test_within_exec_the_status_is_the_same(tmp_path: Path) -> None:
    """Python ends by the signal there if a module runs by ``python -m``, as the command line does here."""
    (tmp_path / "pressed.py").write_text(PRESSED_WITHIN_EXEC, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    done = subprocess.run([sys.executable, "-m", "pressed"], env={**os.environ, "PYTHONPATH": path}, timeout=60)
    assert done.returncode == 130


def test_a_second_press_is_not_deferred() -> None:
    with pytest.raises(KeyboardInterrupt), defer_interrupts() as pressed:
        signal.raise_signal(signal.SIGINT)
        assert pressed()
        signal.raise_signal(signal.SIGINT)


def test_a_press_while_the_handler_is_restored_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    restore = signal.signal

    def press(number: int, handler: object) -> object:
        signal.raise_signal(signal.SIGINT)
        return restore(number, handler)  # type: ignore[arg-type]

    with pytest.raises(KeyboardInterrupt), delay_interrupts():
        monkeypatch.setattr(signal, "signal", press)


def test_an_ignored_interrupt_stays_ignored() -> None:
    """As under nohup, and for what a shell runs in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with defer_interrupts() as pressed:
            signal.raise_signal(signal.SIGINT)
            assert not pressed()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_the_process_outside_of_a_command_only(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[object] = []
    monkeypatch.setattr(os, "_exit", ended.append)
    monkeypatch.setattr(os, "write", lambda *what: ended.append(what))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        exit_on_interrupt()
        with pytest.raises(KeyboardInterrupt), raise_interrupts():
            signal.raise_signal(signal.SIGINT)
        assert ended == []
        signal.raise_signal(signal.SIGINT)
        assert ended == [(2, b"nlp-gait: interrupted\n"), 130]
    finally:
        signal.signal(signal.SIGINT, before)
