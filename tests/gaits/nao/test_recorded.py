"""Motions from elsewhere: judged as planned ones are, mirrored if need be, against Pinocchio and against our own optima."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from compare.judge import Evaluation, evaluate
from nlp_gait import load
from nlp_gait.errors import GaitError
from nlp_gait.export.formats import write_as
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.formulation import Result
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.gaits.nao.body import JOINTS, make_nao
from nlp_gait.gaits.nao.recorded import RecordedGait, make_recorded_gait
from nlp_gait.gaits.nao.recorded_motion import read_motion
from nlp_gait.robots import load_robot
from nlp_gait.robots.tree import find_partner, mirror_sign
from tests.pinocchio_oracle import check_standing, floating_model

ROBOT = load_robot("nao-v5")
# Feasible points of the planned problems; a spline through samples 10 or 20 ms apart is this near to a cubic hip.
GAITS = {
    "nao-ssp": (0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.02, 2.0),
    "nao-dsp": (0.30, 0.0, 0.0, 0.05, 0.05, -0.05, -0.05, 1.0),
}
SHARE = 1e-4


@cache
def planned(name: str) -> Result:
    problem = load(name)
    if name in GAITS:
        return Result(problem=problem, x=problem.check_x(GAITS[name]))
    x = 0.5 * (problem.lower + problem.upper)
    x[problem.names.index("hip_vy_lift_off_m_s")] = 0.0
    return Result(problem=problem, x=x)


def written(folder: Path, name: str, period_ms: int = 10) -> Path:
    path = folder / f"{name}.csv"
    write_as("csv", path, planned(name), period_ms)
    return path


def judged(gait: RecordedGait) -> Evaluation:
    return evaluate(gait.problem, np.array(gait.x), prove=False)


@pytest.mark.parametrize("name", [pytest.param("nao-ssp", marks=pytest.mark.commit), "nao-dsp", "nao-cycle"])
def test_a_planned_gait_that_is_read_back_gets_the_same_verdict(name: str, tmp_path: Path) -> None:
    gait = make_recorded_gait(read_joint_angles(written(tmp_path, name, 1 if name == "nao-cycle" else 10), ROBOT))
    assert gait.gait == name and not gait.motion.mirrored and gait.lean_deg < 1e-4
    own, before = judged(gait), evaluate(planned(name).problem, planned(name).x, prove=False)
    share = 20 * SHARE if name == "nao-cycle" else SHARE
    for index, value in before.metrics.items():
        assert own.metrics[index] == pytest.approx(value, rel=share, abs=share), index
    rows = {row.name: row.value for row in own.constraints}
    for row in before.constraints:
        if row.name.split("[")[0] in ("joint_angle", "torque_change", "dbm_x", "dbm_y", "dbm_x_mean", "dbm_y_mean"):
            assert rows[row.name] == pytest.approx(row.value, rel=share, abs=share), row.name


def test_its_own_limits_are_found_broken(tmp_path: Path) -> None:
    """Faster and lower than the phase allows: its time, the hip's velocities and height, and the swing height."""
    problem = load("nao-ssp")
    low = problem.with_values(
        **{"hip_height_m.lower": 0.2, "swing_height_m.lower": 0.0, "single_support_time_s.lower": 0.1}
    )
    x = low.check_x((0.24, 0.0, 0.0, 0.3, 0.0025, 0.0, 0.0, 0.01, 0.3))
    path = tmp_path / "fast.csv"
    write_as("csv", path, Result(problem=low, x=x), 5)
    broken = {row.name for row in judged(make_recorded_gait(read_joint_angles(path, ROBOT))).violations}
    assert {"hip_z_start", "hip_z_end", "hip_vx_start", "swing_height", "bounds[single_support_time_s]"} <= broken
    assert not any(name.startswith(("foot_stands", "feet_apart", "hip_vx_end")) for name in broken)


def angles_of(path: Path) -> JointAngles:
    return read_joint_angles(path, ROBOT)


def test_a_motion_on_the_right_foot_is_its_mirror_image(tmp_path: Path) -> None:
    angles = angles_of(written(tmp_path, "nao-ssp"))
    columns = [angles.joints.index(find_partner(name)) for name in angles.joints]
    signs = np.array([mirror_sign(ROBOT, name, find_partner(name)) for name in angles.joints])
    turned = JointAngles(owner="turned", joints=angles.joints, t=angles.t + 3.0, q=signs * angles.q[:, columns])
    gait, straight = make_recorded_gait(turned), make_recorded_gait(angles)
    assert gait.motion.mirrored and gait.gait == "nao-ssp"
    assert judged(gait).metrics["power_W"] == pytest.approx(judged(straight).metrics["power_W"], rel=1e-9)


def test_torques_of_a_leaning_motion_are_pinocchios() -> None:
    """Every joint moves, the torso leans; nothing of it is planned."""
    rng, t = np.random.default_rng(3), np.linspace(0.0, 1.2, 60)
    base = angles_of_stance()
    lifted = {"RHipPitch": -0.6, "RKneePitch": 1.2, "RAnklePitch": -0.6}  # in the air
    base[[JOINTS.index(name) for name in lifted]] += list(lifted.values())
    waves = 0.1 * np.sin(np.outer(t, rng.uniform(2.0, 5.0, len(JOINTS))) + rng.uniform(0, 6, len(JOINTS)))
    gait = make_recorded_gait(JointAngles(owner="waves", joints=JOINTS, t=t, q=base + waves), gait="nao-ssp")
    assert gait.lean_deg > 1.0
    signals, model = gait.problem.signals(gait.x), floating_model(ROBOT)
    ankle = np.array(gait.motion.body.support)
    check_standing(signals, model, ankle, range(0, 11, 2), "hip")


def angles_of_stance() -> np.ndarray:
    standing = planned("nao-ssp").problem.signals(planned("nao-ssp").x)
    return np.asarray(standing.arrays["q"][0][[standing.joints.index(name) for name in JOINTS]])


def test_rates_are_those_of_finite_differences(tmp_path: Path) -> None:
    """The hip's velocity comes from the joints' rates through the chain of links."""
    gait = make_recorded_gait(angles_of(written(tmp_path, "nao-ssp")))
    x = planned("nao-ssp").x
    rows = {row.name: row.value for row in judged(gait).constraints}
    for row, variable in (("hip_vx_start", 3), ("hip_vx_end", 4), ("hip_vy_start", 5), ("hip_vz_end", 2)):
        assert rows[row] == pytest.approx(x[variable], abs=2e-5)
    assert rows["hip_z_start"] == pytest.approx(x[0], abs=1e-9) and rows["swing_height"] == pytest.approx(
        0.02, abs=1e-6
    )


def test_arms_may_be_left_out_and_degrees_are_read(tmp_path: Path) -> None:
    angles = angles_of(written(tmp_path, "nao-ssp"))
    legs = [name for name in angles.joints if "Hip" in name or "Knee" in name or "Ankle" in name]
    lines = ["time," + ",".join(f"{name} [deg]" for name in legs)]
    for t, row in zip(angles.t, np.degrees(angles.q[:, [angles.joints.index(n) for n in legs]]), strict=True):
        lines.append(",".join(map(repr, [float(t), *row.tolist()])))
    (tmp_path / "legs.csv").write_text("\n".join(lines))
    gait = make_recorded_gait(angles_of(tmp_path / "legs.csv"))
    assert len(gait.motion.held) == 10 and gait.motion.duration_s == pytest.approx(2.0)
    knee = JOINTS.index("LKneePitch")
    np.testing.assert_allclose(gait.motion.q[:, knee], angles.q[:, angles.joints.index("LKneePitch")], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,LKneePitch\n0,1\n", "has no angles of"),
        ("LKneePitch\n1\n", "needs a header with a column t of times"),
        ("t,LKneePich\n0,1\n", "unknown joint in motion .*did you mean .*'LKneePitch'"),
        ("t,LKneePitch [grad]\n0,1\n", "LKneePitch must be in rad or deg, got \\[grad\\]"),
    ],
)
def test_a_file_that_is_not_a_motion_is_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(GaitError, match=message):
        make_recorded_gait(angles_of(tmp_path / "m.csv"))


def test_a_gait_that_it_is_not_is_refused(tmp_path: Path) -> None:
    angles = angles_of(written(tmp_path, "nao-ssp"))
    with pytest.raises(GaitError, match="shows nao-ssp, not nao-cycle"):
        make_recorded_gait(angles, gait="nao-cycle")
    with pytest.raises(GaitError, match="limits of nao-ssp, nao-dsp, nao-cycle, got 'walk12'"):
        make_recorded_gait(angles, gait="walk12")
    infinite = JointAngles(owner="infinite", joints=angles.joints, t=angles.t, q=angles.q + np.inf)
    with pytest.raises(GaitError, match="infinite: an angle of .* is missing"):
        make_recorded_gait(infinite)


def test_phases_and_power_survive_rounding_and_noise(tmp_path: Path) -> None:
    """Three decimals or noise of 0.5 mrad; without smoothing they change the power by 21 % and 145 %."""
    angles = angles_of(written(tmp_path, "nao-cycle", 20))
    exact, noise = make_recorded_gait(angles), np.random.default_rng(0).normal(0.0, 5e-4, angles.q.shape)
    assert not exact.motion.noise_rad.any()
    power = judged(exact).metrics["power_W"]
    for disturbed, error in ((angles.q.round(3), 2.9e-4), (angles.q + noise, 5e-4)):
        gait = make_recorded_gait(replace(angles, q=disturbed))
        assert gait.gait == "nao-cycle" and gait.inferred and gait.motion.repeats
        assert gait.x[0] == pytest.approx(exact.x[0], abs=0.03)
        assert gait.motion.noise_rad.max() == pytest.approx(error, rel=1.0)
        assert judged(gait).metrics["power_W"] == pytest.approx(power, rel=0.1)


@pytest.mark.parametrize(("period_ms", "touch_down_s"), [(20, 2.2), (5, 2.2), (20, 2.205), (20, None)])
def test_noise_of_an_encoder_costs_no_power(period_ms: int, touch_down_s: float | None, tmp_path: Path) -> None:
    """Noise of 2 mrad; estimated for each joint by itself it changed the power by up to 100 %.

    Touch-down is at 2.2 s; inferred from the distance of the foot alone it was 120 ms late, and the power 14 % too high.
    """
    angles = angles_of(written(tmp_path, "nao-cycle", period_ms))
    noise = np.random.default_rng(0).normal(0.0, 2e-3, angles.q.shape)
    gait = make_recorded_gait(replace(angles, q=angles.q + noise), touch_down_s=touch_down_s)
    assert gait.x[0] == pytest.approx(2.2, abs=0.025)
    assert judged(gait).metrics["power_W"] == pytest.approx(
        evaluate(planned("nao-cycle").problem, planned("nao-cycle").x, prove=False).metrics["power_W"], rel=0.05
    )


def test_other_units_wrapped_angles_and_several_steps_are_refused(tmp_path: Path) -> None:
    angles = angles_of(written(tmp_path, "nao-cycle", 20))
    motion = read_motion(angles, make_nao("nao-v5"))
    knee = angles.joints.index("LKneePitch")
    wrapped = angles.q.copy()
    wrapped[80:, knee] += 2.0 * np.pi
    twice = np.vstack([motion.q, motion.mirror_image().q[1:]])
    cases = [
        (replace(angles, q=np.degrees(angles.q)), r"Degrees\? Name the column '\w+ \[deg\]'"),
        (replace(angles, t=1000.0 * angles.t), r"rows are 20 s apart.*Milliseconds\? Name their column 't \[ms\]'"),
        (replace(angles, q=wrapped), r"LKneePitch is .* rad at 1.6 s, beyond half a turn. Wrapped\?"),
        (replace(angles, t=angles.t[np.r_[0, :165]]), "times must ascend, got 0 s after 0 s"),
        (JointAngles(owner="walk", joints=JOINTS, t=0.02 * np.arange(len(twice)), q=twice), "walk shows 2 steps"),
    ]
    for refused, message in cases:
        with pytest.raises(GaitError, match=message):
            make_recorded_gait(refused)


def test_files_of_opensim_and_webots_give_the_same_angles(tmp_path: Path) -> None:
    angles = angles_of(written(tmp_path, "nao-ssp", 20))
    header = ["Coordinates", "version=1", "inDegrees=yes", "endheader", "\t".join(("time", *angles.joints))]
    rows = [
        "\t".join(map(repr, [t, *q])) for t, q in zip(angles.t.tolist(), np.degrees(angles.q).tolist(), strict=True)
    ]
    (tmp_path / "a.mot").write_text("\n".join([*header, *rows]))
    (tmp_path / "a.sto").write_text("\n".join([*header, *rows]).replace("inDegrees=yes", "inDegrees=no"))
    write_as("webots", tmp_path / "a.motion", planned("nao-ssp"), 20)
    for name in ("a.mot", "a.motion"):
        read = angles_of(tmp_path / name)
        columns = [read.joints.index(joint) for joint in angles.joints]
        np.testing.assert_allclose(read.q[:, columns], angles.q, atol=1e-9)
        np.testing.assert_allclose(read.t, angles.t, atol=1e-12)
    with pytest.raises(GaitError, match=r"Degrees\?"):
        make_recorded_gait(angles_of(tmp_path / "a.sto"))
