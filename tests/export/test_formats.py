"""CSV, JSON, MJCF, NAOqi and Webots exports, the last read back by a parser written from the published grammar."""

import csv
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlp_gait
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.export.formats import PERIOD_MS, format_motion, write_as
from nlp_gait.formulation import Result, Signals
from nlp_gait.formulation.solution import sample_at_period
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import make_plan_model
from nlp_gait.simulation.plan import make_plan

DSP = (0.31, -0.0008, -0.0055, 0.052, 0.001, -0.0367, -0.0424, 2)


@pytest.fixture(scope="module")
def result():
    problem = nlp_gait.load("nao-dsp").with_values(torque_change_limit_Nm=1.0)
    return Result(problem=problem, x=problem.check_x(DSP))


def test_csv_has_plain_headers_with_units_and_rows_exactly_a_period_apart(result, tmp_path):
    path = tmp_path / "gait.csv"
    write_as("csv", path, result, 100)
    header, *rows = csv.reader(path.read_text().splitlines())
    assert header[0] == "t_s" and {"tau_LKneePitch_Nm", "qdd_LKneePitch_rad_s2", "zmp_y_m", "com_z_m"} <= set(header)
    assert all(name.isidentifier() for name in header) and len(set(header)) == len(header)
    table = np.array(rows, dtype=float)
    assert table.shape == (21, len(header))
    np.testing.assert_array_equal(table[:, 0], np.arange(21) / 10)
    signals = result.problem.signals(result.x)
    knee = signals.joints.index("LKneePitch")
    np.testing.assert_allclose(table[::2, header.index("tau_LKneePitch_Nm")], signals.arrays["tau"][:, knee], rtol=1e-9)


def test_ros_trajectory_is_exactly_periodic_and_agrees_with_the_csv(result, tmp_path):
    write_as("ros", tmp_path / "gait.json", result, 30)
    data = json.loads((tmp_path / "gait.json").read_text())
    points = data["points"]
    times = [1e9 * p["time_from_start"]["sec"] + p["time_from_start"]["nanosec"] for p in points]
    np.testing.assert_array_equal(np.diff(times), 30e6)
    assert times[-1] == 1.98e9  # the last multiple before the end at 2 s, where the robot moves
    assert all(
        len(p[field]) == len(data["joint_names"]) for p in points for field in ("positions", "velocities", "effort")
    )
    signals = result.problem.signals(result.x)
    np.testing.assert_allclose(points[20]["positions"], signals.arrays["q"][3], atol=1e-9)  # at 0.6 s
    np.testing.assert_allclose(points[20]["effort"], signals.arrays["tau"][3], atol=1e-9)


def test_both_phases_of_a_cycle_have_rows_exactly_a_millisecond_apart():
    problem = nlp_gait.load("nao-cycle")
    middle = (problem.lower + problem.upper) / 2
    x = dict(zip(problem.names, middle, strict=True)) | {"single_support_time_s": 0.4003, "double_support_time_s": 0.2}
    signals = sample_at_period(Result(problem=problem, x=problem.check_x(x)), 1)
    np.testing.assert_array_equal(signals.arrays["t"], np.arange(601) / 1000)
    exact = problem.signals(problem.check_x(x)).arrays
    k = np.searchsorted(exact["t"], 0.5, side="left")
    assert abs(exact["t"][k] - 0.5) > 1e-5  # not a sample of the problem
    rate = np.diff(signals.arrays["q"], axis=0) / 0.001 - (signals.arrays["qd"][1:] + signals.arrays["qd"][:-1]) / 2
    assert np.abs(np.delete(rate, 400, axis=0)).max() < 0.05  # accelerations jump where the foot lands, at 400.3 ms


def test_naoqi_keys_move_every_motor_once_after_an_approach(result, tmp_path):
    path = tmp_path / "gait.json"
    write_as("naoqi", path, result, 40)
    data = json.loads(path.read_text())
    assert data["isAbsolute"] is True
    assert "LHipYawPitch" in data["names"] and "RHipYawPitch" not in data["names"]  # one motor
    assert len(data["names"]) == len(data["keys"]) == len(data["times"]) == 21
    times = data["times"][0]
    assert times[0] == 2.0 and times[-1] == 4.0 and len(times) == 51 == len(data["keys"][3])
    assert np.diff(times).min() > 0.0


def test_a_reference_is_the_planned_motion_in_the_engine(result, tmp_path):
    """Played back by the names in the engine's model of the plan: bodies are where it has them, and move as they are said to."""
    mujoco = pytest.importorskip("mujoco")
    write_as("npz", tmp_path / "gait.npz", result, 20)
    reference, fps = np.load(tmp_path / "gait.npz"), 50.0
    model = mujoco.MjModel.from_xml_string(make_plan_model(make_plan(result), Drive()))
    data = mujoco.MjData(model)
    bodies, joints = (reference[name].tolist() for name in ("body_names", "joint_names"))
    assert reference["fps"] == fps and set(joints) == set(result.problem.display.robot.joints)
    root = bodies.index(result.problem.display.robot.root)
    for k in range(len(reference["joint_pos"])):
        data.qpos[:7] = *reference["body_pos_w"][k, root], *reference["body_quat_w"][k, root]
        for i in range(1, model.njnt):
            data.qpos[6 + i] = reference["joint_pos"][k, joints.index(model.joint(i).name)]
        mujoco.mj_forward(model, data)
        for i in range(1, model.nbody):
            place = reference["body_pos_w"][k, bodies.index(model.body(i).name)]
            np.testing.assert_allclose(data.body(i).xpos, place, atol=1e-9)
    place, velocity = reference["body_pos_w"], reference["body_lin_vel_w"]
    differences = (place[2:] - place[:-2]) * fps / 2
    np.testing.assert_allclose(velocity[1:-1], differences, atol=0.05 * np.abs(velocity).max())


def test_what_a_problem_has_not_is_refused(tmp_path):
    problem = nlp_gait.load("walk12")
    walk = Result(problem=problem, x=problem.check_x((0.13, 0.1135, 0.02, 0.0204)))
    for name in ("webots", "naoqi"):
        with pytest.raises(InputError, match="no robot with motors; export it as csv or json"):
            write_as(name, tmp_path / "x", walk, 40)
    with pytest.raises(InputError, match="has no simulation model"):
        write_as("mjcf", tmp_path / "x", walk, 40)
    write_as("csv", tmp_path / "x.csv", walk, 40)
    assert ",left_stance" in (tmp_path / "x.csv").read_text().splitlines()[0]
    with pytest.raises(UnknownNameError, match="webots"):
        write_as("webot", tmp_path / "x", walk, 40)


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
