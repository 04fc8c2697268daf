"""Walks along footholds: continuous through turns, exact against the engine's kinematics, judged by rotated soles."""

import math
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.plan_walk import WalkSettings, list_speeds, plan_route
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.biped.body import TIMES
from nlp_gait.gaits.biped.footholds import (
    Foothold,
    find_support_sides,
    list_arc,
    list_swings,
    parse_footholds,
    read_footholds,
)
from nlp_gait.gaits.biped.walk_sections import start_from_cycle
from nlp_gait.gaits.humanoid.body import Humanoid, make_humanoid
from nlp_gait.gaits.humanoid.turning import find_sharpest_turn, list_turn
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import Addresses, load_mujoco
from nlp_gait.simulation.mjcf import make_plan_model
from nlp_gait.simulation.plan import SIDES, Plan, make_plan

STEPS, TURN_DEG, LENGTH_M = 4, 24.0, 0.12


@pytest.fixture(scope="module")
def body() -> Humanoid:
    return make_humanoid("nao-v5")


@pytest.fixture(scope="module")
def problem(body: Humanoid) -> GaitProblem:
    arc = list_arc(TURN_DEG, STEPS, LENGTH_M, body.feet_y)
    return nlp_gait.load("humanoid-walk", steps=STEPS, intervals=2, footholds=arc)


@pytest.fixture(scope="module")
def plan(problem: GaitProblem) -> Plan:
    return make_plan(Result(problem=problem, x=problem.start_point(np.random.default_rng(0))))


def test_feet_land_on_their_footholds_and_the_torso_faces_the_mean_of_both(body: Humanoid, plan: Plan) -> None:
    arrays, places = plan.signals.arrays, parse_footholds(plan_footholds(body))
    for side, foot in (("right", places[2]), ("left", places[3])):
        np.testing.assert_allclose(arrays[f"{side}_foot"][-1], [foot.x, foot.y, 0.0], atol=1e-9)
    np.testing.assert_allclose(np.degrees(arrays["feet_yaw"][-1]), TURN_DEG, atol=1e-6)
    np.testing.assert_allclose(plan.heading(arrays["t"]), arrays["feet_yaw"].mean(axis=1), atol=1e-12)
    apart = arrays["left_foot"][-1] - arrays["right_foot"][-1]
    assert math.hypot(*apart[:2]) == pytest.approx(body.feet_y[0] - body.feet_y[1])


def plan_footholds(body: Humanoid) -> str:
    return list_arc(TURN_DEG, STEPS, LENGTH_M, body.feet_y)


def test_angles_and_rates_are_continuous_through_the_turn(plan: Plan) -> None:
    """On a dense grid no angle, rate or place jumps, though accelerations do at the switches."""
    arrays = plan.signals.arrays
    t = np.diff(arrays["t"])[:, None]
    for name, rate in {"q": "qd", "qd": "qdd"}.items():
        trapezoid = t * (arrays[rate][1:] + arrays[rate][:-1]) / 2
        assert np.abs(np.diff(arrays[name], axis=0) - trapezoid).max() < 0.6 * t.max() * np.abs(arrays[rate]).max()
    for name in ("hip", "com", "left_foot", "right_foot", "attitude"):
        assert np.abs(np.diff(arrays[name], axis=0)).max() < 0.02


def test_soles_and_yaw_are_those_of_the_engine(plan: Plan) -> None:
    """The engine's forward kinematics of the planned angles has the planned soles, level and turned as planned."""
    pytest.importorskip("mujoco")
    engine, arrays = load_mujoco(), plan.signals.arrays
    model = engine.MjModel.from_xml_string(make_plan_model(plan, Drive()))
    data, at = engine.MjData(model), Addresses(model, plan)
    for k in np.linspace(0, len(arrays["t"]) - 1, 9, dtype=int):
        data.qpos[:3], data.qpos[3:7], data.qpos[at.angles] = (arrays[name][k] for name in ("hip", "attitude", "q"))
        engine.mj_forward(model, data)
        for j, side in enumerate(("left", "right")):
            np.testing.assert_allclose(data.site_xpos[at.soles[j]], arrays[f"{side}_foot"][k], atol=1e-9)
            axes = data.site_xmat[at.soles[j]].reshape(3, 3)
            yaw = arrays["feet_yaw"][k, j]
            np.testing.assert_allclose(axes[:, 0], [math.cos(yaw), math.sin(yaw), 0.0], atol=1e-9)


def test_torques_and_forces_of_the_ground_satisfy_the_equations_of_motion(plan: Plan) -> None:
    """Of the whole robot by Pinocchio, over the left foot: a swinging foot that turns, and a turned foot that bears load."""
    oracle = pytest.importorskip("tests.pinocchio_oracle")
    arrays = plan.signals.arrays
    over_left = np.flatnonzero(arrays["feet_yaw"][:, 0] == 0.0)
    turning = np.flatnonzero(arrays["right_foot"][over_left, 2] > 0.005)
    turned = np.flatnonzero(arrays["feet_yaw"][over_left, 1] == arrays["feet_yaw"][over_left[-1], 1])
    weight = plan.robot.mass_kg * plan.gravity
    for k in (0, turning[3], turning[-2], turned[1], turned[-2]):
        left_over = oracle.left_over(plan.robot, plan.signals, int(over_left[k]), plan.gravity)
        np.testing.assert_allclose(left_over / weight, 0.0, atol=1e-10)
    assert arrays["right_force"][turned[1], 2] > 0.05 * weight


def test_the_zmp_is_limited_by_the_hull_of_rotated_soles(problem: GaitProblem, body: Humanoid, plan: Plan) -> None:
    """Margins of a double support are the distances along the standing foot's axes to the sides of the hull."""
    x = problem.start_point(np.random.default_rng(0))
    found, model = build_exact_model(problem).at(x, problem.p), build_exact_model(problem)
    rows = {row.name: row.value for row in model.rows(found)}
    (_, landed), *_ = list_swings(parse_footholds(plan_footholds(body)), body.feet_y)
    soles = body.robot.feet
    outlines = [Foothold(0.0, body.feet_y[0], 0.0).outline(soles["left"]), landed.outline(soles["right"])]
    sides = find_support_sides(outlines)
    assert all((sides[:, :2] @ corner <= sides[:, 2] + 1e-12).all() for corner in np.concatenate(outlines))
    arrays = plan.signals.arrays
    k = int(np.flatnonzero((arrays["feet_yaw"][:, 0] == 0.0) & (arrays["right_foot"][:, 2] < 1e-9))[-1])
    free = sides[:, 2] - sides[:, :2] @ arrays["zmp"][k]
    for axis, name in enumerate("xy"):
        slanted = np.abs(sides[:, axis]) > 0.01
        expected = (free[slanted] / np.abs(sides[slanted, axis])).min()
        assert rows[f"step1_dsp_dbm_{name}[2]"] == pytest.approx(expected, abs=1e-9)


def test_energy_and_distance_are_those_of_all_phases(problem: GaitProblem, plan: Plan) -> None:
    x = problem.start_point(np.random.default_rng(0))
    metrics = build_exact_model(problem).at(x, problem.p).metrics
    assert metrics["duration_s"] == pytest.approx(plan.duration_s)
    paths = (
        np.linalg.norm(np.diff(plan.signals.arrays[f"{side}_foot"][:, :2], axis=0), axis=1).sum() for side in SIDES
    )
    assert metrics["distance_m"] == pytest.approx(sum(paths) / 2, rel=1e-6)
    assert metrics["energy_J_per_m"] == pytest.approx(metrics["energy_J"] / metrics["distance_m"])


def test_a_start_from_a_cycle_has_its_states_in_all_steps(problem: GaitProblem) -> None:
    start = problem.start_point(np.random.default_rng(0))
    cycle = {"hip_z_lift_off_m": 0.2, "double_support_time_s": 0.7, "step_length_m": 0.04}
    found = problem.by_name(start_from_cycle(problem, start, cycle))
    assert {found[f"hip_z_{state}_m"] for state in ("stand", "step1_lift_off", "step4_lift_off")} == {0.2}
    assert found["shift_time_s"] == found["step3_double_support_time_s"] == 0.7


def test_footholds_are_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "places.csv"
    path.write_text("x_m,y_m,z_m,yaw_deg\n0.04,-0.05,0,0\n0.04,0.05,0,10\n", encoding="utf-8")
    first, second = parse_footholds(read_footholds(path))
    assert first == (0.04, -0.05, 0.0) and second == (0.04, 0.05, pytest.approx(math.radians(10.0)))
    path.write_text("x,y\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"first line must be x_m,y_m,z_m,yaw_deg, got 'x,y'"):
        read_footholds(path)


def test_the_sharpest_turn_names_its_limit(body: Humanoid) -> None:
    sharpest = find_sharpest_turn(body, 0.04)
    assert "passes over the standing one" in sharpest.stopped_by and 10.0 < sharpest.turn_deg < 90.0
    list_turn(body, 2 * sharpest.turn_deg, 3, 0.08)
    with pytest.raises(InputError, match=r"the sharpest with steps of 0.04 m is .*; take more steps"):
        list_turn(body, 2 * sharpest.turn_deg + 2, 3, 0.08)
    assert len(parse_footholds(list_turn(body, 40.0, None, None))) == 4


@pytest.mark.parametrize(
    ("footholds", "words"),
    [
        ("0,0,0", r"foothold 1 must be four numbers x_m,y_m,z_m,yaw_deg, got '0,0,0'"),
        ("0.05,-0.05,0.1,0", r"foothold 1 is 0.1 m high, but footholds are planned on a level floor"),
        ("0.05,nan,0,0", r"foothold 1 must be finite and within 10000 m and 36000 degrees of the start"),
        ("0,-0.05,0,0", r"a walk has 2 to 100 footholds, got 1"),
        ("0.05,0.05,0,0;0.05,0.05,0,0", r"in step 1 the swinging sole passes over the standing one; take more steps"),
        ("0.05,-0.05,0,0;0.05,0.05,0,0;0.1,-0.05,0,0", r"steps must be the number of footholds, 3, got 4"),
    ],
)
def test_footholds_that_cannot_be_walked_are_refused(footholds: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        nlp_gait.load("humanoid-walk", steps=footholds.count(";") + (2 if "got 4" in words else 1), footholds=footholds)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"turn_deg": 90.0}, "robot 'nao-v5' does not turn: NAO has one motor for both hip yaw-pitch joints"),
        ({"speeds_m_s": [0.05, -1.0]}, r"speeds_m_s must be finite numbers > 0, got \[0.05, -1.0\]"),
        (
            {"speeds_m_s": [0.05] * 5, "steps": 6},
            "5 speeds are given, and a walk of 6 steps has 4 inner ones; plan more steps",
        ),
    ],
)
def test_turns_that_cannot_be_planned_are_refused(options: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plan_route("nao-v5", **options)  # type: ignore[arg-type]


def test_every_inner_step_has_its_speed() -> None:
    """What both feet advance on average, by the time between lift-offs; NAO's feet stay parallel."""
    straight = list_arc(0.0, STEPS, LENGTH_M, make_nao("nao-v5").feet_y)
    problem = nlp_gait.load("nao-walk", steps=STEPS, intervals=2, footholds=straight)
    problem = problem.with_values(**list_speeds([0.04, 0.06], STEPS))
    x = problem.start_point(np.random.default_rng(0))
    model, point = build_exact_model(problem), problem.by_name(x)
    rows = {row.name: row for row in model.rows(model.at(x, problem.p))}
    for k, wanted in ((2, 0.04), (3, 0.06)):
        row, time = rows[f"step{k}_speed"], sum(point[f"step{k}_{name}"] for name in TIMES.values())
        assert (row.lower, row.upper) == (wanted, wanted)
        assert row.value == pytest.approx(LENGTH_M / (STEPS - 1) / time)
    assert list_speeds([0.02, 0.04, 0.02], 7)["step3_least_speed_m_s"] == pytest.approx(0.03)
    arrays = make_plan(Result(problem=problem, x=x)).signals.arrays
    assert "feet_yaw" not in arrays and arrays["right_foot"][-1, 0] == pytest.approx(LENGTH_M)


@pytest.mark.parametrize(("distance_m", "end"), [(0.001, "lower"), (2.0, "upper")])
def test_a_walk_starts_from_the_cycle_with_the_nearest_step_within_bounds(
    monkeypatch: pytest.MonkeyPatch, distance_m: float, end: str
) -> None:
    cycles: list[GaitProblem] = []

    def stop(cycle: GaitProblem, **_: object) -> None:
        cycles.append(cycle)
        raise InputError("stop")

    monkeypatch.setattr("nlp_gait.backends.plan_walk.solve", stop)
    with pytest.raises(InputError, match="stop"):
        plan_route("nao-v5", steps=3, distance_m=distance_m, settings=WalkSettings(intervals=2))
    nearest = nlp_gait.load("nao-cycle").value(f"step_length_m.{end}")
    assert [cycles[0].value(f"step_length_m.{bound}") for bound in ("lower", "upper")] == [nearest, nearest]
