"""Whole walks: continuous from standing to standing, judged by their phases' limits, named where infeasible."""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.plan_walk import (
    MARGINS,
    WalkPlan,
    WalkSettings,
    choose_finer_grid,
    describe_violation,
    plan_walk,
)
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result, load_result
from nlp_gait.formulation.solution import ConstraintValue, Solution
from nlp_gait.gaits.biped.footholds import list_arc
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import Conditions
from nlp_gait.symbolic.dynamics import tilt_gravity
from tests.compare.cli.calls import as_json

STEPS = 3


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("nao-walk", steps=STEPS)


@pytest.fixture(scope="module")
def x(problem: GaitProblem) -> np.ndarray:
    return problem.start_point(np.random.default_rng(0))


def test_a_walk_begins_and_ends_at_rest_in_the_same_pose(problem: GaitProblem, x: np.ndarray) -> None:
    arrays = problem.signals(x).arrays
    for k in (0, -1):
        np.testing.assert_allclose(arrays["qd"][k], 0.0, atol=1e-9)
        feet = arrays["left_foot"][k], arrays["right_foot"][k]
        np.testing.assert_allclose((feet[0] - feet[1])[[0, 2]], 0.0, atol=1e-9)
    np.testing.assert_allclose(arrays["q"][0], arrays["q"][-1], atol=1e-9)
    step = dict(zip(problem.names, x, strict=True))["step_length_m"]
    assert arrays["left_foot"][-1, 0] - arrays["left_foot"][0, 0] == pytest.approx((STEPS - 1) * step)


def test_a_walk_of_two_half_steps_has_no_inner_step() -> None:
    """It has no row, variable or speed of one, so no limit of an inner step can stop it."""
    two = nlp_gait.load("nao-walk", steps=2)
    assert not {"swing_height_m", "single_support_time_s", "hip_x_touch_down_m"} & set(two.names)
    x, model = two.start_point(np.random.default_rng(0)), build_exact_model(two)
    found = model.at(x, two.p)
    assert not [row.name for row in model.rows(found) if row.name.startswith(("ssp_", "dsp_", "speed"))]
    assert "least_speed_m_s" not in two.parameter_values and "speed_m_s" not in found.metrics
    assert found.metrics["distance_m"] == pytest.approx(two.by_name(x)["step_length_m"])


def test_on_a_slope_the_weight_acts_behind_the_centre_of_mass() -> None:
    """At rest the ZMP is where the vertical line through the centre of mass meets the slope, which is also the engine's."""
    problem = nlp_gait.load("nao-walk", steps=STEPS, slope_deg=5.0)
    values = problem.by_name(problem.start_point(np.random.default_rng(0)))
    still = {name: 0.0 for name in values if "start_lift_off" in name}  # the weight shift is a rest
    still |= {f"hip_{axis}_start_lift_off_m": values[f"hip_{axis}_stand_m"] for axis in "xz"}
    found = np.array(list({**values, **still}.values()))
    arrays = {name: array[:5] for name, array in problem.signals(found).arrays.items()}
    below = arrays["com"][:, 0] - np.tan(np.radians(5.0)) * arrays["com"][:, 2]
    np.testing.assert_allclose(arrays["zmp"][:, 0], below, atol=1e-9)
    model = problem.display.simulation_model
    assert model is not None
    gravity = Conditions().gravity(model.gravity, model.slope_rad)
    np.testing.assert_allclose(gravity, tilt_gravity(9.8, np.radians(5.0)), rtol=1e-12)
    assert Conditions().gravity(9.8) == (0.0, 0.0, -9.8)


def test_energy_and_duration_count_every_inner_step(x: np.ndarray) -> None:
    found = {}
    for steps in (3, 8):
        problem = nlp_gait.load("nao-walk", steps=steps)
        found[steps] = build_exact_model(problem).at(x, problem.p).metrics
        signals = problem.signals(x)
        assert found[steps]["duration_s"] == pytest.approx(signals.arrays["t"][-1])
    cycle = found[3]["cycle_energy_J_per_m"] * found[3]["distance_m"] / 2
    assert found[8]["energy_J"] - found[3]["energy_J"] == pytest.approx(5 * cycle)


@pytest.mark.usefixtures("without_compiler")
def test_a_plan_is_feasible_and_walks_in_the_engine(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = tmp_path / "walk.json"
    data = as_json("plan", "--steps", "3", "--distance", "0.1", "--set", "intervals=2", "--starts", "1", "--out", path)
    assert data["feasible"] and data["claimed"] and data["steps"] == 3 and not data["obstacles"]
    assert data["distance_m"] == pytest.approx(0.1, abs=1e-7)
    again = load_result(path)
    assert again.problem.options["steps"] == 3 and again.problem.by_name(again.x) == data["x"]
    metrics = build_exact_model(again.problem).at(again.x, again.problem.p).metrics
    assert data["duration_s"] == pytest.approx(metrics["duration_s"]) and again.problem.options["intervals"] == 2
    assert abs(metrics["energy_J"] / data["energy_J"] - 1.0) > 0.05  # three samples a phase
    assert (
        metrics["ssp_dbm_x_min_m"] > MARGINS[0] * 0.15 - 1e-6 and metrics["ssp_dbm_y_min_m"] > MARGINS[1] * 0.08 - 1e-6
    )
    simulated, balanced = as_json("simulate", path, "--feedback", "none"), as_json("simulate", path)
    assert (simulated["mode"], balanced["mode"]) == ("in open loop", "with balance feedback")
    assert not simulated["fallen"] and not balanced["fallen"] and simulated["planned_m"] == pytest.approx(0.1)
    assert simulated["walked_m"] > 0.98 * simulated["planned_m"]
    assert data["energy_J"] == pytest.approx(simulated["walk"]["model_J_per_m"] * 0.1, rel=0.01)
    assert simulated["energy_J"] == pytest.approx(data["energy_J"], rel=0.1)


def test_a_start_shows_whether_a_grid_is_too_coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """A grid is refined where the energy differs from that on a fine one by more than a limit; fixed values stay."""
    monkeypatch.setattr("nlp_gait.backends.plan_walk.FINE_GRID", 24)
    problem = nlp_gait.load("nao-walk", steps=3, intervals=2).fix(step_length_m=0.05)
    x, said = np.clip(problem.start_point(np.random.default_rng(0)), problem.lower, problem.upper), list[str]()
    fine = nlp_gait.load("nao-walk", steps=3, intervals=24)
    coarse, right = (build_exact_model(p).at(x, p.p).metrics["energy_J"] for p in (problem, fine))
    error = abs(coarse / right - 1.0)
    for limit, refined in ((0.9 * error, True), (1.1 * error, False)):
        monkeypatch.setattr("nlp_gait.backends.plan_walk.ENERGY_ERROR", limit)
        finer = choose_finer_grid(problem, x, WalkSettings(progress=said.append))
        assert (finer is not None) is refined
        assert finer is None or (finer.options["intervals"], finer.values) == (3, problem.values)
    assert said == [f"2 intervals of a phase: energy {error:.1%} off, now 3"]


def test_margins_are_shares_of_the_sole_in_plans_and_not_in_problems(problem: GaitProblem) -> None:
    least = [f"{kind}_dbm_{axis}_min_limit_m" for kind in ("ssp", "dsp", "stand") for axis in "xy"]
    assert {problem.value(name) for name in least} == {0.0}
    planned = WalkSettings().apply(problem)
    assert [planned.value(name) for name in least] == 3 * [
        pytest.approx(MARGINS[0] * 0.15),
        pytest.approx(MARGINS[1] * 0.08),
    ]
    chosen = WalkSettings(margins=(0.2, 0.1), values={"ssp_dbm_x_min_limit_m": 0.001}).apply(problem)
    assert [chosen.value(name) for name in least] == pytest.approx([0.001, 0.008, 0.03, 0.008, 0.03, 0.008])
    for shares in ((0.5, 0.1), (-0.1, 0.1), (0.1,), (float("nan"), 0.1)):
        with pytest.raises(InputError, match="two shares of a sole"):
            WalkSettings(margins=shares).apply(problem)


def test_a_walk_along_footholds_keeps_its_larger_margins_unless_told_otherwise() -> None:
    text = list_arc(0.0, 3, 0.1, make_nao("nao-v5").feet_y)
    route = nlp_gait.load("nao-walk", steps=3, footholds=text)
    own = route.value("ssp_dbm_x_min_limit_m")
    assert own == pytest.approx(0.15 / 4)
    assert WalkSettings().apply(route).value("ssp_dbm_x_min_limit_m") == own
    assert WalkSettings(margins=(0.0, 0.0)).apply(route).value("ssp_dbm_x_min_limit_m") == 0.0


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ("start_ssp_joint_angle[LKneePitch, 3]", "step 1 (half step), single support: LKneePitch exceeds its limit"),
        ("stop_dsp_torque_change[LHipRoll, 2]", "after step 10, weight shift: LHipRoll torque changes too fast"),
        ("speed", "steps 2 to 9: speed of the inner steps is not reached by 0.1 rad"),
    ],
)
def test_a_violation_names_step_constraint_amount_and_remedy(row: str, sentence: str) -> None:
    value = ConstraintValue(name=row, value=1.0, lower=None, upper=0.9, violation=0.1, unit="rad")
    found = describe_violation(value, 10)
    assert found.startswith(sentence) and row in found and "; " in found


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"steps": 4, "distance_m": 3.0, "speed_m_s": 0.05}, r"needs steps of 1 m; they are .*; use 26 to 151 steps"),
        ({"steps": 2, "speed_m_s": 0.05}, "a walk of 2 half steps has none; plan more steps"),
        ({"slope_deg": 60.0}, r"slope_deg must be within \+-30, got 60.0"),
        ({"distance_m": float("nan")}, "distance_m must be a finite number > 0"),
    ],
)
def test_what_cannot_be_planned_is_refused(options: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plan_walk("nao-v5", **options)  # type: ignore[arg-type]


@pytest.mark.usefixtures("without_compiler")
def test_a_start_that_fails_is_tried_again_with_a_monotone_barrier(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    quick, used = nlp_gait.IpoptSettings(iterations=1, compiled=False), list[Solver]()

    def solve_badly_at_first(problem: GaitProblem, *, solver: Solver, **rest: Any) -> Solution:
        used.append(solver)
        return nlp_gait.solve(problem, solver=solver if used[1:] else quick, **rest)

    monkeypatch.setattr("nlp_gait.backends.plan_walk.solve", solve_badly_at_first)
    plan = plan_walk("nao-v5", 3, settings=WalkSettings(intervals=2, starts=1, progress=said.append))
    assert plan.feasible and len(set(used)) == 2
    assert [line.partition(":")[0] for line in said] == ["start 1, adaptive barrier", "start 1, monotone barrier"]


def test_an_infeasible_plan_names_its_obstacles(problem: GaitProblem) -> None:
    x0 = problem.start_point(np.random.default_rng(0))
    quick = nlp_gait.IpoptSettings(iterations=1, compiled=False, hessian="limited-memory")
    solution = nlp_gait.solve(problem, x0=x0, solver=quick)
    plan = WalkPlan(solution=solution, distance_m=1.0, duration_s=1.0, energy_J=1.0)
    assert not plan.feasible and plan.obstacles


@pytest.fixture(scope="module")
def climb(tmp_path_factory: pytest.TempPathFactory) -> GaitProblem:
    """A walk up two treads, of a NAO whose soles are shorter than its longest step."""
    data = json.loads((files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8"))
    for foot in data["feet"].values():
        foot |= {"front_m": 0.045, "back_m": 0.03}
    path = tmp_path_factory.mktemp("robots") / "short-soles.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return nlp_gait.load("humanoid-walk", robot=str(path), steps=3, intervals=2, stair_rise_m=0.01, stair_run_m=0.1)


def test_every_step_climbs_one_tread_and_clears_its_edge(climb: GaitProblem) -> None:
    values = climb.by_name(climb.start_point(np.random.default_rng(0)))
    assert values["step_length_m"] == 0.1 and climb.value("swing_height_m.lower") > 0.01
    lowest = {name: climb.value(f"{name}.lower") for name in values if name.endswith("swing_height_m")}
    plan = make_plan(Result(problem=climb, x=np.array(list({**values, **lowest}.values()))))
    arrays = plan.signals.arrays
    assert [tread.height_m for tread in plan.ground] == [0.01, 0.02]
    for side in ("left_foot", "right_foot"):
        np.testing.assert_allclose(arrays[side][[0, -1]][:, [0, 2]], [[0.0, 0.0], [0.2, 0.02]], atol=1e-12)
        ends = [arrays[side][:, 0] - 0.03, arrays[side][:, 0] + 0.045]
        assert all((plan.level(end) < arrays[side][:, 2] + 1e-9).all() for end in ends)
    landed = plan.stands("left", arrays["t"]) + plan.stands("right", arrays["t"])
    assert landed.min() >= 1.0
