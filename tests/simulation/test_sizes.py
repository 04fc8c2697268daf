"""Sizes that are allowed one by one but whose product is too large: refused by name before memory or time is spent."""

import json
import re
from pathlib import Path

import pytest

from nlp_gait import load
from nlp_gait.errors import InputError
from nlp_gait.export.formats import FORMATS, write_as
from nlp_gait.formulation import Result
from nlp_gait.formulation.registry import LARGEST_COUNT
from nlp_gait.formulation.result import LONGEST_S, SHORTEST_S, load_result, sample_signals
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.feedback import Feedback
from nlp_gait.simulation.plan import LONGEST_S as LONGEST_PLAYED_S
from nlp_gait.simulation.plan import MOST_STEPS, make_plan
from nlp_gait.simulation.video import MOST_FRAMES, check_frames


@pytest.mark.parametrize("name", ["nao-ssp", "nao-cycle"])
def test_a_grid_is_as_large_as_its_samples(name: str) -> None:
    with pytest.raises(InputError, match=f"at most {LARGEST_COUNT} intervals in all, got intervals "):
        load(name, intervals=LARGEST_COUNT // 10, samples_per_interval=12)
    with pytest.raises(InputError, match="samples_per_interval"):
        load(name, samples_per_interval=LARGEST_COUNT)  # with the intervals that it has by itself


@pytest.mark.parametrize("duration_s", [1e308, 0.0, 1e-300, 1.01 * LONGEST_S])
def test_a_gait_without_a_duration_is_not_drawn_simulated_or_exported(duration_s: float, tmp_path: Path) -> None:
    problem = load("nao-ssp")
    x = {**problem.by_name((problem.lower + problem.upper) / 2), "single_support_time_s": duration_s}
    path = tmp_path / "result.json"
    path.write_text(json.dumps({"problem": "nao-ssp", "x": x}))
    result = load_result(path)
    expected = re.escape(f"but it lasts {duration_s:g} s")
    with pytest.raises(InputError, match=rf"must last {SHORTEST_S:g} to {LONGEST_S:g} s, {expected}"):
        sample_signals(result, 0.02)
    for format_, ending in FORMATS.items():
        with pytest.raises(InputError, match="must last 0.001 to 300 s"):
            write_as(format_, tmp_path / f"gait{ending}", result, 40)
    assert [file.name for file in tmp_path.iterdir()] == ["result.json"]


def test_the_length_of_a_simulated_walk_is_limited() -> None:
    walk = load("nao-cycle", intervals=2)
    result, longest = Result(problem=walk, x=walk.upper), f"at most {LONGEST_PLAYED_S:g} s are simulated"
    for steps, words in (
        (60, rf"60 steps of this gait last 360 s, and {longest}"),
        (10**9, f"at most {MOST_STEPS} steps"),
    ):
        with pytest.raises(InputError, match=words):
            make_plan(result, steps)


@pytest.mark.parametrize("owner", [Drive, Feedback])
@pytest.mark.parametrize("period_s", [1e-12, 1e6])
def test_no_controller_commands_every_picosecond_or_once_a_month(owner: type, period_s: float) -> None:
    with pytest.raises(InputError, match=f"must be from 0.0001 to 1 s, got {period_s!r}"):
        owner(period_s=period_s)


def test_the_number_of_frames_of_a_film_is_limited() -> None:
    check_frames(60.0, MOST_FRAMES / 60.0)
    with pytest.raises(InputError, match=f"at most {MOST_FRAMES} frames, got 60 s at 50.1 frames a second = 3006"):
        check_frames(60.0, 50.1)
