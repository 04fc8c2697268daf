"""A compiler that fails, hangs, writes rubbish or computes wrong: the virtual machine takes over, and one line says so."""

from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.kernel import compiler as compiler_module
from nlp_gait.backends.kernel.compiler import find_compiler
from nlp_gait.backends.solvers import ipopt
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import CompilerError
from tests.backends.toys import corner, toy
from tests.evaluation import evaluated
from tests.faults.processes import fake_compiler

# The library's path follows -o; a working compiler stands behind the last ones.
TAKE_OUTPUT = 'while [ "$1" != -o ]; do shift; done; '
FAULTS = {
    "fails": (r"printf '\377kernel.cpp:1: error: no luck' >&2; exit 1", "kernel.cpp:1: error: no luck"),
    "dies": ("kill -9 $$", "failed with exit status -9: no message"),
    "hangs in a child": ("sleep 60 & wait", "did not end within 0.5 s"),
    "writes nothing": ("exit 0", "wrote no library"),
    "writes rubbish": (TAKE_OUTPUT + "head -c 5000 /dev/urandom > $2", "cannot be loaded"),
    "computes wrong": (
        "for a; do case $a in *.cpp) sed -i 's/w2 = 1[.];/w2 = 2.;/' $a;; esac; done; {real} \"$@\"",
        "computes other values than the virtual machine",
    ),
}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(compiler_module.FOLDER_VARIABLE, str(tmp_path / "cache"))


@pytest.mark.parametrize("fault", FAULTS)
def test_the_objective_is_interpreted_with_a_warning(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    body, words = FAULTS[fault]
    real = " ".join(find_compiler().command)
    monkeypatch.setenv("CXX", fake_compiler(tmp_path, body.replace("{real}", real)))
    monkeypatch.setattr(compiler_module, "TIME_LIMIT_S", 0.5 if "hangs" in fault else 60.0)
    monkeypatch.setattr(compiler_module, "SILENT_S", 0.1 if "hangs" in fault else 50.0)
    problem = toy(corner)
    objective = nlp_gait.compile_objective(problem)
    assert objective.backend == "interpreted"
    waiting, words_of_end = caplog.messages[:-1], caplog.messages[-1]
    assert [text.partition("which")[2] for text in waiting] == [" has run for 0.1 s (limit: 0.5 s)"] * (
        "hangs" in fault
    )
    assert "interpreted, which is many times slower" in words_of_end and words in words_of_end
    X = np.array([[1.0, 1.0], [2.0, 0.25], [-2.5, 1.0]])
    f, violation = objective(X)
    expected = [[found.cost, found.violation] for found in (evaluated(problem, x) for x in X)]
    assert np.column_stack([f, violation]).tolist() == pytest.approx(np.array(expected))
    with pytest.raises(CompilerError):
        nlp_gait.compile_objective(toy(corner), require_compiler=True)


@pytest.mark.parametrize("fault", ["fails", "writes rubbish"])
def test_ipopt_continues_with_interpreted_functions_and_a_warning(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("CXX", fake_compiler(tmp_path, FAULTS[fault][0]))
    monkeypatch.setattr(compiler_module, "TIME_LIMIT_S", 0.5)
    monkeypatch.setattr(ipopt, "WORTHWHILE_SIZE", 2)
    solution = nlp_gait.solve(toy(corner), starts=2)
    assert solution.converged and solution.best.functions == "interpreted"
    assert len(caplog.messages) == 1 and "IPOPT's functions are interpreted: " in caplog.messages[0]
    with pytest.raises(CompilerError):
        nlp_gait.solve(toy(corner), solver=IpoptSettings(compiled=True))
