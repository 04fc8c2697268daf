"""Libraries of gaits: optima of a grid with derivatives, what lies between them, and the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from compare.questions.question import find
from compare.questions.sweep import Axis
from compare.questions.walk.gait_library import FoundLibrary, LibraryOfGaits
from nlp_gait.backends.optima.gait_library import GaitLibrary, make_library
from nlp_gait.errors import InputError, UnknownNameError
from tests.compare.cli.calls import one_sentence

LENGTHS = (0.06, 0.09, 0.12)


@pytest.fixture(scope="module")
def question() -> LibraryOfGaits:
    return LibraryOfGaits(problem=nlp_gait.load("walk12"), axes=[Axis(name="step_length_m", values=LENGTHS)], starts=1)


@pytest.fixture(scope="module")
def findings(question: LibraryOfGaits) -> FoundLibrary:
    return find(question)


def test_gaits_between_the_points_are_judged_and_read_back(
    question: LibraryOfGaits, findings: FoundLibrary, tmp_path: Path
) -> None:
    """At the points they are the optima; between them the exact functions judge them, also from the file."""
    question.report(findings).write(tmp_path)
    library = nlp_gait.load_library(tmp_path / "walk12-library.json")
    for point in findings.points:
        gait = library.interpolate(**point.at)
        assert gait.objective == pytest.approx(point.objective, rel=1e-9)
        assert gait.result.problem.by_name(gait.result.x) == pytest.approx(point.x)
    (first, second) = findings.judged
    gait = library.interpolate(**first.at)
    assert gait.objective == first.objective and gait.feasible == (first.violated == "")
    assert first.optimum is not None and second.at["step_length_m"] == pytest.approx(0.105)
    solved = nlp_gait.solve(question.problem.place(first.at), starts=2, workers=1)
    assert first.optimum == pytest.approx(solved.objective, rel=1e-6)


def test_values_beyond_the_library_are_refused(
    question: LibraryOfGaits, findings: FoundLibrary, tmp_path: Path
) -> None:
    axes = {"step_length_m": LENGTHS}
    library = make_library(question.problem, axes, findings.points[:2])
    for at, error, words in (
        ({"step_length_m": 0.2}, InputError, r"must be within the library's 0.06 to 0.12, got 0.2"),
        ({"step_length_m": 0.1}, InputError, r"no optimum next to step_length_m = 0.1"),
        ({"speed": 0.1}, UnknownNameError, "unknown axis 'speed'"),
        ({}, InputError, "step_length_m is missing"),
    ):
        with pytest.raises(error, match=words):
            library.interpolate(**at)
    with pytest.raises(InputError, match="increasing values"):
        make_library(question.problem, {"step_length_m": (0.1, 0.1)}, [])
    (tmp_path / "other.json").write_text('{"problem": "walk12"}', encoding="utf-8")
    with pytest.raises(InputError, match="`nlp-gait walk --library` writes a valid one"):
        nlp_gait.load_library(tmp_path / "other.json")


def test_a_grid_is_checked_before_the_work(question: LibraryOfGaits) -> None:
    for name, values, error in (
        ("step_length_m", (0.12, 0.06), "increasing values"),
        ("step_lenght_m", LENGTHS, "did you mean 'step_length_m"),
    ):
        with pytest.raises((InputError, UnknownNameError), match=error):
            replace(question, axes=[Axis(name=name, values=values)])


def test_a_library_takes_no_options_that_it_would_ignore(tmp_path: Path) -> None:
    message = one_sentence("walk", "--library", "--engine", "--out", tmp_path)
    assert "leave out --engine, --steps and --baseline" in message


def test_quadratic_functions_of_one_axis_are_met(question: LibraryOfGaits) -> None:
    problem, at = question.problem, np.array(LENGTHS)
    middle, scale = (problem.lower + problem.upper) / 2, 0.1 * (problem.upper - problem.lower)
    x = middle + scale * (at[:, None] ** 2)
    slopes = (2 * at[:, None] * scale)[..., None]
    library = GaitLibrary(problem=problem, axes={"step_length_m": LENGTHS}, x=x, slopes=slopes)
    found = library.interpolate(step_length_m=0.1).result.x
    np.testing.assert_allclose(found[1:], (middle + scale * 0.01)[1:], rtol=1e-12)  # the first one is the axis


def test_a_quantity_that_follows_from_the_variables_is_placed_by_its_bounds() -> None:
    problem = nlp_gait.load("nao-cycle", objective="power").place({"step_length_m": 0.06, "speed_m_s": 0.05})
    values = problem.parameter_values
    assert values["step_length_m.lower"] == values["step_length_m.upper"] == 0.06 and values["speed_m_s"] == 0.05
