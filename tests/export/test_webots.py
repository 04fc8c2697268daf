"""Webots `.motion`: written, read back by the strict reader, and by a parser written from the published grammar."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.export.set_points import SetPoints, make_set_points
from nlp_gait.export.webots import format_motion, parse_motion, read_motion, write_motion
from nlp_gait.formulation import Result
from nlp_gait.robots import load_robot

OPTIMUM = (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)
HALF_A_DIGIT = 5.1e-10  # nine decimals are written
GOOD = "#WEBOTS_MOTION,V1.0,LKneePitch,RKneePitch\n00:00:000,Pose1,0.1,-0.2\n00:00:040,Pose2,*,1e-3\n"


@pytest.fixture(scope="module")
def points():
    problem = nlp_gait.load("nao-ssp")
    return make_set_points(Result(problem=problem, x=problem.check_x(OPTIMUM)))


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


@pytest.mark.slow
def test_a_gait_is_written_every_40_ms_and_read_back(points, tmp_path):
    path = tmp_path / "walk.motion"
    write_motion(path, points)
    back = read_motion(path, motors=load_robot("nao-v5").joints)
    assert back.joints == points.joints and len(back.joints) == 22
    assert back.times_ms == tuple(range(0, 4001, 40))
    np.testing.assert_allclose(back.angles, points.angles, atol=HALF_A_DIGIT)
    names, times, poses = by_the_grammar(path.read_text())
    assert tuple(names) == points.joints and tuple(times) == points.times_ms
    np.testing.assert_array_equal(poses, back.angles)
    assert path.read_text().splitlines()[1].startswith("00:00:000,Pose1,")


def test_set_points_are_the_planned_angles(points):
    problem = nlp_gait.load("nao-ssp")
    signals = problem.signals(problem.check_x(OPTIMUM))  # 11 samples, 400 ms apart
    np.testing.assert_allclose(points.angles[::10], signals.arrays["q"], atol=1e-9)


def test_the_last_pose_is_the_end_of_the_phase():
    problem = nlp_gait.load("nao-ssp")
    found = make_set_points(Result(problem=problem, x=problem.check_x((*OPTIMUM[:-1], 0.4567))))
    assert found.times_ms[-3:] == (360, 400, 440)


@pytest.mark.slow
@given(
    st.lists(st.integers(0, 5_000_000), min_size=1, max_size=6, unique=True),
    st.lists(st.one_of(st.floats(-4, 4), st.just(float("nan"))), min_size=3, max_size=3),
)
def test_any_set_points_survive_the_round_trip(times, row):
    points = SetPoints(joints=("A", "B", "C"), times_ms=tuple(sorted(times)), angles=np.array([row] * len(times)))
    text = format_motion(points)
    back = parse_motion(text, "any")
    assert back.times_ms == points.times_ms
    np.testing.assert_allclose(back.angles, points.angles, atol=HALF_A_DIGIT)
    np.testing.assert_array_equal(by_the_grammar(text)[2], back.angles)


def test_what_webots_accepts_is_accepted():
    back = parse_motion(
        GOOD.replace("\n", "\r\n") + "\r\nanything after an empty line", "crlf", ("LKneePitch", "RKneePitch")
    )
    assert back.times_ms == (0, 40)
    np.testing.assert_array_equal(back.angles, [[0.1, -0.2], [np.nan, 1e-3]])
    assert parse_motion("#WEBOTS_MOTION,V1.0,A\n5,p,1\n1:5,p,1\n1:1:005,p,1", "times").times_ms == (5, 1005, 61005)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", r"line 1: must begin with #WEBOTS_MOTION,V1.0"),
        (GOOD.replace("V1.0", "V2.0"), r"line 1: must begin"),
        ("#WEBOTS_MOTION,V1.0\n0,P,1\n", r"line 1: a motor has no name"),
        (GOOD.replace("RKneePitch", ""), r"line 1: a motor has no name"),
        (GOOD.replace("RKneePitch", "LKneePitch"), r"line 1: motor 'LKneePitch' appears twice"),
        (GOOD.replace("RKneePitch", "RKneeBend"), r"line 1: the robot has no motor 'RKneeBend'"),
        (GOOD.replace("0.1,-0.2", "0.1"), r"line 2: 1 values for 2 motors"),
        (GOOD.replace("0.1,-0.2", "0.1,-0.2,0.3"), r"line 2: 3 values for 2 motors"),
        (GOOD.replace("*,1e-3", "*,"), r"line 3: expected an angle of RKneePitch.* got ''"),
        (GOOD.replace("1e-3", "nan"), r"line 3: expected an angle of RKneePitch.* got 'nan'"),
        (GOOD.replace("1e-3", "٣"), r"line 3: expected an angle"),
        (GOOD.replace("00:00:040", "00:00:000"), r"line 3: time 0 ms is not after 0 ms"),
        (GOOD.replace("00:00:040", "00:00:04.0"), r"line 3: expected a time"),
        (GOOD.replace("00:00:040", "1:2:3:4"), r"line 3: expected a time"),
        (GOOD.replace("00:00:040", "-5"), r"line 3: expected a time"),
        (GOOD.replace("Pose2", ""), r"line 3: the pose has no name"),
        (GOOD.replace("Pose2", "P" * 5000), r"line 3: \d+ characters"),
        (GOOD.splitlines()[0], "has no pose"),
    ],
)
def test_damage_is_refused_with_its_line(text, words):
    with pytest.raises(InputError, match=words):
        parse_motion(text, "bad.motion", ("LKneePitch", "RKneePitch"))


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_motion(tmp_path / "absent.motion")
    binary = tmp_path / "binary.motion"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot be read"):
        read_motion(binary)


@pytest.mark.parametrize("period", [0, -40, 2.5, True])
def test_the_period_is_whole_milliseconds(period):
    problem = nlp_gait.load("nao-ssp")
    with pytest.raises(InputError, match="whole number of milliseconds"):
        make_set_points(Result(problem=problem, x=problem.check_x(OPTIMUM)), period)
