"""Webots `.motion`: written, and read back by a parser written from the published grammar."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.export.formats import PERIOD_MS, format_motion
from nlp_gait.formulation import Result, Signals, sample_at_period

OPTIMUM = (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)
HALF_A_DIGIT = 5.1e-10  # nine decimals are written


@pytest.fixture(scope="module")
def points():
    problem = nlp_gait.load("nao-ssp")
    return sample_at_period(Result(problem=problem, x=problem.check_x(OPTIMUM)), PERIOD_MS)


def poses_of(joints, times_ms, q):
    return Signals(joints=joints, arrays={"t": np.array(times_ms) / 1000, "q": q}, columns={})


def by_the_grammar(text):
    """As `motion.c` reads: tokens between commas and line ends, time as [[MM:]SS:]mmm, an empty line ends the file."""
    header, *rows = text.split("\n")
    magic, version, *names = header.split(",")
    assert magic == "#WEBOTS_MOTION" and version == "V1.0" and names
    times, poses = [], []
    for row in rows:
        tokens = [token for token in row.split(",") if token]
        if not tokens:
            break
        assert len(row) < 4095 and len(tokens) == 2 + len(names)
        parts = [int(part) for part in tokens[0].split(":")]
        assert 1 <= len(parts) <= 3 and set(tokens[0]) <= set("0123456789:")
        minutes, seconds, milliseconds = [0] * (3 - len(parts)) + parts
        times.append(minutes * 60000 + seconds * 1000 + milliseconds)
        poses.append([np.nan if token == "*" else float(token) for token in tokens[2:]])
    assert all(b > a for a, b in zip(times, times[1:], strict=False))
    return names, times, np.array(poses)


def test_a_gait_is_written_every_40_ms_and_read_back(points):
    text = format_motion(points)
    names, times, poses = by_the_grammar(text)
    assert tuple(names) == points.joints and len(names) == 22
    assert times == list(range(0, 4001, 40))
    np.testing.assert_allclose(poses, points.arrays["q"], atol=HALF_A_DIGIT)
    assert text.splitlines()[1].startswith("00:00:000,Pose1,")


@given(
    st.lists(st.integers(0, 5_000_000), min_size=1, max_size=6, unique=True),
    st.lists(st.floats(-4, 4), min_size=3, max_size=3),
)
def test_any_set_points_survive_the_round_trip(times, row):
    points = poses_of(("A", "B", "C"), sorted(times), np.array([row] * len(times)))
    names, back_ms, angles = by_the_grammar(format_motion(points))
    assert tuple(names) == points.joints and back_ms == sorted(times)
    np.testing.assert_allclose(angles, points.arrays["q"], atol=HALF_A_DIGIT)


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (("LKnee,Pitch",), "names without commas"),
        (tuple(f"a_joint_with_a_long_name_{k:03d}" for k in range(200)), r"has \d+ characters for 200 joints"),
    ],
)
def test_joints_that_the_format_cannot_express_are_refused(joints, words):
    with pytest.raises(InputError, match=words):
        format_motion(poses_of(joints, [0], np.zeros((1, len(joints)))))
