"""A gait from elsewhere next to the optimum of its step and duration, and in the engine."""

from pathlib import Path

import numpy as np
import pytest

from compare.questions.recorded import judge_gait
from nlp_gait import load
from nlp_gait.export.formats import write_as
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.formulation import Result
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.gaits.nao.recorded import make_recorded_gait
from nlp_gait.robots import load_robot
from tests.compare.cli.calls import as_json, nlp_gait
from tests.compare.records import DSP_X

pytestmark = pytest.mark.usefixtures("coarse_pictures")

X = (0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4.0)


@pytest.fixture(scope="module")
def gait(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gait") / "gait.csv"
    problem = load("nao-ssp")
    write_as("csv", path, Result(problem=problem, x=problem.check_x(X)), 20)
    return path


@pytest.fixture(scope="module")
def double_support(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gait") / "dsp.csv"
    problem = load("nao-dsp")
    write_as("csv", path, Result(problem=problem, x=problem.check_x(DSP_X)), 20)
    return path


def test_the_command_judges_simulates_and_compares_with_the_optimum(double_support: Path) -> None:
    pytest.importorskip("mujoco")
    found = as_json("evaluate", "--motion", double_support, "--robot", "nao-v5")
    own, best = found["recorded"]["metrics"], found["optimum"]["metrics"]
    planned = load("nao-dsp")
    expected = as_json("evaluate", "nao-dsp", "--x", ",".join(map(str, DSP_X.values())))["metrics"]
    assert found["gait"] == "nao-dsp" and found["step_m"] == pytest.approx(0.06, abs=1e-6)
    assert own["power_W"] == pytest.approx(expected["power_W"], rel=1e-4) and best["power_W"] < own["power_W"]
    assert found["optimum"]["x"]["double_support_time_s"] == pytest.approx(DSP_X["double_support_time_s"], abs=1e-6)
    assert not found["engine"]["fallen"]
    assert found["engine"]["predicted"]["mechanical_W"] > 0
    assert set(planned.names) == set(found["optimum"]["x"])


def test_tighter_limits_are_named(double_support: Path) -> None:
    call = ("evaluate", "--motion", double_support, "--no-engine", "--set", "torque_change_limit_Nm=0.01")
    shown = nlp_gait(*call).stdout
    assert "Infeasible on the samples" in shown and "torque_change[" in shown and "In the engine" not in shown


def test_missing_results_are_explained(gait: Path) -> None:
    """A step on the spot has no optimum; a torso that leans at the beginning is not played."""
    angles = read_joint_angles(gait, load_robot("nao-v5"))
    q = np.array(angles.q)
    q[:, [angles.joints.index(name) for name in ("LHipPitch", "RHipPitch")]] -= (
        0.1  # the torso leans over straight legs
    )
    leaning = make_recorded_gait(JointAngles(owner="leaning", joints=angles.joints, t=angles.t, q=q), gait="nao-ssp")
    judged = judge_gait(leaning, starts=0)
    assert any("the torso leans by" in note for note in judged.notes) and judged.engine is None
    still = JointAngles(owner="still", joints=angles.joints, t=angles.t, q=np.tile(angles.q[0], (len(angles.t), 1)))
    standing = judge_gait(make_recorded_gait(still, gait="nao-ssp"), in_engine=False)
    assert standing.optimum is None and any("no optimum of nao-ssp" in note for note in standing.notes)
