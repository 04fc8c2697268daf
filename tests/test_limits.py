"""Limits that a user adds: every one on every kind of phase, and against values by hand and MuJoCo."""

import pickle
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import DM, MX

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.errors import GaitError
from nlp_gait.formulation import Grid
from nlp_gait.limits import LIMITS, FootClearance, FrictionCone, Limit, Point, Samples, make_rows_at_samples
from nlp_gait.proofs.guarantee import guarantee
from nlp_gait.symbolic.nonsmooth import Exact

ROWS = {"FrictionCone": "friction[", "FootClearance": "foot_clearance["}  # by limit
OPTIMUM = (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)  # of nao-ssp, to printed digits
ONE = """
from nlp_gait.limits import Limit, make_parameters, make_rows_at_samples

class HipHeight(Limit):
    parameters = make_parameters(("least_torso_m", "m", 0.2, "least height of the torso's origin", 0.0, 1.0))

    def add(self, at, samples, ops):
        return [make_rows_at_samples("hip_height", "m", samples.hip[2, :], ("hip",), at["least_torso_m"])], {}
"""


def test_the_rows_of_every_limit_are_tested() -> None:
    assert set(ROWS) == set(LIMITS), "add to ROWS how the names of a limit's rows begin, and test its values by hand"


@pytest.mark.parametrize(
    "name",
    ["nao-ssp", "nao-dsp", "nao-cycle", "humanoid-dsp", pytest.param("humanoid-walk", marks=pytest.mark.slow)],
)
def test_every_limit_has_rows_in_every_kind_of_phase(name: str) -> None:
    problem = nlp_gait.load(name, intervals=4, limits=",".join(LIMITS))
    rows = build_exact_model(problem).row_names
    found = {limit for limit, stem in ROWS.items() if any(stem in row for row in rows)}
    assert found == set(ROWS) - ({"FootClearance"} if "dsp" in name else set())
    assert set(build_nlp(problem).row_names) == {row for row in rows if not row.startswith("bounds[")}
    x = 0.5 * (problem.lower + problem.upper)
    values = build_exact_model(problem).at(x, problem.p)
    added = [value for row, value in zip(rows, values.g, strict=True) if any(stem in row for stem in ROWS.values())]
    assert np.isfinite(added).all()


def evaluate_rows(limit: Limit, values: dict[Any, MX], **samples: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return values (m,) of a limit's rows and its metrics on samples by hand."""
    found = Samples(
        joints=(), moving=(), duration=MX(1.0), grid=Grid(intervals=4), evaluate=values.__getitem__, **samples
    )
    names = [parameter.name for parameter in limit.parameters]
    at = Point.of(MX(0, 1), MX(DM([parameter.default for parameter in limit.parameters])), (), names)
    rows, metrics = limit.add(at, found, Exact())
    found_values = [np.array(ca.evalf(row.value)).ravel() for row in rows]
    return np.concatenate(found_values or [np.zeros(0)]), np.array([float(ca.evalf(v)) for v in metrics.values()])


def test_friction_by_hand() -> None:
    wrench = MX(DM([[3.0, 0.0], [4.0, -6.0], [10.0, 10.0], [0, 0], [0, 0], [0, 0]]))
    values, ratios = evaluate_rows(
        FrictionCone(), standing=("L",), progress=MX(DM([[0.0, 1.0]])), values={Samples.wrench_left: wrench}
    )
    np.testing.assert_allclose(values, [0.6 * 10 - 5, 0.6 * 10 - 6], atol=1e-6)
    np.testing.assert_allclose(ratios, [0.6], atol=1e-6)


def test_clearance_by_hand() -> None:
    progress = MX(DM([[0.0, 0.25, 0.5, 0.75, 1.0]]))
    heights = MX(DM([[0.0, 0.006, 0.009, 0.006, 0.0]]))
    values, highest = evaluate_rows(
        FootClearance(), standing=("L",), progress=progress, values={Samples.swing_heights: heights}
    )
    quarter = 0.01 * 16 * (0.25 * 0.75) ** 2
    np.testing.assert_allclose(values, [0.006 - quarter, -0.001, 0.006 - quarter], atol=1e-15)
    assert highest == 0.009
    none, _ = evaluate_rows(FootClearance(), standing=("L", "R"), progress=progress, values={})
    assert none.size == 0


def test_friction_and_height_are_those_of_mujoco() -> None:
    """The ground's wrench on the standing foot by MuJoCo's inverse dynamics, and the swinging foot by its kinematics."""
    pytest.importorskip("mujoco", reason="needs the extra sim")
    from nlp_gait.gaits.nao.body import GRAVITY
    from nlp_gait.robots.tree import make_tree
    from nlp_gait.simulation.engine import load_mujoco
    from tests.simulation.inverse_dynamics_oracle import fixed_model, standing_on

    problem = nlp_gait.load("nao-ssp", limits=",".join(LIMITS)).with_values(friction_coefficient=0.3)
    x = problem.check_x((*OPTIMUM[:-1], 0.6))  # fast, so that there is friction
    model, signals = build_exact_model(problem), problem.signals(x)
    rows = dict(zip(model.row_names, model.at(x, problem.p).g, strict=True))
    robot = problem.display.simulation_model.robot  # type: ignore[union-attr]
    _, wrench = standing_on(robot, GRAVITY, "left", signals)
    slack = 0.3 * wrench[:, 2] - np.hypot(wrench[:, 0], wrench[:, 1])
    np.testing.assert_allclose([rows[f"friction[left, {k}]"] for k in range(11)], slack, atol=1e-5)
    assert np.ptp(slack) > 1.0

    engine = load_mujoco()
    fixed = engine.MjModel.from_xml_string(fixed_model(make_tree(robot, robot.feet["left"].link)))
    data = engine.MjData(fixed)
    columns = [signals.joints.index(fixed.joint(i).name) for i in range(fixed.njnt)]
    place = []
    for angles in signals.arrays["q"]:
        data.qpos[:] = angles[columns]
        engine.mj_kinematics(fixed, data)
        place.append(data.body(robot.feet["right"].link).xpos[2])
    heights = np.array(place) - place[0]
    s = np.linspace(0.0, 1.0, 11)
    above = heights - 0.01 * 16 * s**2 * (1 - s) ** 2
    np.testing.assert_allclose([rows[f"foot_clearance[sole, {k}]"] for k in range(1, 10)], above[1:-1], atol=1e-9)


def test_a_limit_costs_what_it_must_and_is_guaranteed_between_samples() -> None:
    problem = nlp_gait.load("nao-ssp", intervals=4)
    higher = problem.with_limits(single_support=[FootClearance()]).with_values(foot_clearance_m=0.02)
    optimum, limited = (nlp_gait.solve(p, starts=1, seed=0) for p in (problem, higher))
    assert limited.objective > optimum.objective
    (price, *_) = [active.price for active in limited.active_constraints if active.name.startswith("foot_clearance[")]
    assert price > 0.0
    assert "foot_clearance" in str(guarantee(higher, higher.check_x(optimum.x)))
    slippery = problem.with_limits(single_support=[FrictionCone()])
    assert (
        guarantee(slippery, slippery.check_x(optimum.x)).satisfied
        == guarantee(problem, problem.check_x(optimum.x)).satisfied
    )


def test_limits_of_one_kind_of_phase_are_loaded_again_as_such() -> None:
    cycle = nlp_gait.load("nao-cycle", intervals=2)
    limited = cycle.with_limits(single_support=[FrictionCone(), FootClearance()], double_support=[FootClearance()])
    names = "single_support:FrictionCone,single_support:FootClearance,double_support:FootClearance"
    assert limited.options["limits"] == names
    rows = build_exact_model(limited).row_names
    assert build_exact_model(pickle.loads(pickle.dumps(limited))).row_names == rows
    assert not any(row.startswith("dsp_friction[") for row in rows)
    assert build_exact_model(nlp_gait.load("nao-cycle", **limited.options)).row_names == rows


def test_a_recorded_motion_has_the_rows_too() -> None:
    from nlp_gait.gaits.biped.body import Support
    from nlp_gait.gaits.nao.body import make_nao
    from nlp_gait.gaits.nao.recorded import make_recorded_phase_problem
    from nlp_gait.gaits.nao.recorded_motion import RecordedMotion

    problem = nlp_gait.load("nao-ssp")
    signals = problem.signals(problem.check_x(OPTIMUM))
    body = make_nao("nao-v5", limits=",".join(LIMITS))
    motion = RecordedMotion(body=body, t=signals.arrays["t"], q=signals.arrays["q"])
    recorded = make_recorded_phase_problem(Support.SINGLE, motion, Grid(intervals=10))
    rows = build_exact_model(recorded)
    values = dict(zip(rows.row_names, rows.at(np.array([4.0]), recorded.p).g, strict=True))
    planned = nlp_gait.load("nao-ssp", limits=",".join(LIMITS))
    model = build_exact_model(planned)
    own = dict(zip(model.row_names, model.at(planned.check_x(OPTIMUM), planned.p).g, strict=True))
    assert values["friction[left, 5]"] == pytest.approx(own["friction[left, 5]"], abs=0.05)
    assert values["foot_clearance[front left, 5]"] == pytest.approx(own["foot_clearance[sole, 5]"], abs=1e-4)


def test_your_own_limit_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "my_limits.py"
    file.write_text(ONE)
    problem = nlp_gait.load("nao-ssp", intervals=3, limits=f"{file}:HipHeight")
    assert "hip_height[hip, 3]" in build_exact_model(problem).row_names
    assert problem.value("least_torso_m") == 0.2


def test_a_limit_of_a_file_that_is_missing_is_refused() -> None:
    with pytest.raises(GaitError, match="no_such_file.py"):
        nlp_gait.load("nao-ssp", limits="no_such_file.py:A")


def test_a_limit_that_reads_what_a_motion_lacks_is_refused() -> None:
    class Unknown(Limit):
        def add(self, at: Point, samples: Samples, ops: Any) -> Any:
            return [], {"index": ca.mmax(samples.temperature)}  # type: ignore[attr-defined]

    problem = nlp_gait.load("nao-ssp").with_limits(single_support=[Unknown()])
    with pytest.raises(GaitError, match="temperature"):
        build_exact_model(problem)


@pytest.mark.parametrize("derivatives", ["analytic", "finite-difference"])
def test_a_quantity_that_no_limit_declares_is_evaluated_when_it_is_read(derivatives: str) -> None:
    class Height(Limit):
        """Height of the centre of mass."""

        def add(self, at: Point, samples: Samples, ops: Any) -> Any:
            return [make_rows_at_samples("height", "m", samples.com[2, :], ("com",), MX(0.1))], {}

    problem = nlp_gait.load("nao-ssp", intervals=4, derivatives=derivatives).with_limits(single_support=[Height()])
    x, model = 0.5 * (problem.lower + problem.upper), build_exact_model(problem)
    heights = model.at(x, problem.p).g[[group == "height" for group in model.row_groups]]
    np.testing.assert_allclose(heights, problem.signals(x).arrays["com"][:, 2], rtol=1e-12)
