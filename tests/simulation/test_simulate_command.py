"""The climb, in the engine."""

import json
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.stairs.track import PLAN
from tests.compare.cli.calls import as_json, one_sentence

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.slow  # each gait is simulated

from nlp_gait.simulation.balance.controller import Balance  # noqa: E402
from nlp_gait.simulation.balance.drives import load_drive  # noqa: E402
from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.measurements import Measurements, measure, measure_climb  # noqa: E402
from nlp_gait.simulation.mjcf import Bumps  # noqa: E402
from nlp_gait.simulation.plan import SIDES, Plan, make_plan  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, Simulation, prepare, simulate_plan  # noqa: E402

# Optima of stairs-plan for case 2, shanks free and limited, and one of stairs-track.
FREE = (0.6926, 0.0918, 0.2434, 0.0923, 0.709, 1.4, 0.5763, 0.7783, 1.3287, 0.3169, 0.2)
LIMITED = (0.707, 0.078, 0.232, 0.08, 0.755, 1.318, 0.488, 0.71, 1.311, 0.323, 0.115)
TRACKED = (8700.0, 10_000.0, 1.463)
PAPERS_GAINS = (2.6474, 7.3724, 1.2055)  # Bhardwaj et al., Table IV, case 2


def simulate(
    problem: GaitProblem, x: tuple[float, ...], steps: int | None = None
) -> tuple[Plan, Simulation, Measurements]:
    plan = make_plan(Result(problem=problem, x=problem.check_x(x)), steps)
    trace = simulate_plan(plan)
    return plan, trace, measure(plan, trace, Drive())


def count_shank_contacts(plan: Plan, trace: Simulation) -> int:
    """Return the contacts of shanks with the ground at every fifth millisecond of a simulation."""
    model, data = prepare(plan, Conditions(), Drive())
    shanks = [model.body(f"{side} shank").id for side in SIDES]
    contacts = 0
    for state in trace.states[::10]:
        data.qpos[:] = state
        mujoco.mj_forward(model, data)
        contacts += int(np.isin(model.geom_bodyid[data.contact.geom], shanks).sum())
    return contacts


@pytest.mark.parametrize(("shanks", "x", "hits"), [("free", FREE, True), ("limited", LIMITED, False)])
def test_shanks_are_solid_and_a_plan_that_limits_them_touches_no_edge(
    shanks: str, x: tuple[float, ...], hits: bool
) -> None:
    plan, trace, _ = simulate(nlp_gait.load("stairs-plan", shanks=shanks), x)
    assert (count_shank_contacts(plan, trace) > 0) == hits


def test_the_planned_climb_is_climbed_with_the_planned_energy() -> None:
    plan, trace, m = simulate(nlp_gait.load("stairs-plan", shanks="limited"), LIMITED)
    assert not m.fallen and m.largest_tilt_deg < 2.0
    assert m.measured.mechanical_W == pytest.approx(m.predicted.mechanical_W, rel=0.05)
    assert m.pressure_middle_rms_m is not None and m.pressure_middle_rms_m < 0.004
    assert m.landing_errors_m["right"] < 0.005
    rise = 0.508 / 2 * 0.70
    heights = trace.feet[[0, -1], 1, 2]
    assert heights[0] == pytest.approx(0.0, abs=0.002)
    assert heights[1] == pytest.approx(2 * rise + 0.05 * np.sin(np.pi / 6), abs=0.005)  # it stands on its toe
    assert np.abs(trace.feet[:, :, 1]).max() < 1e-12  # nothing leaves the plane
    weight = plan.robot.mass_kg * plan.gravity
    assert trace.loads[-200:].sum(axis=1).mean() == pytest.approx(weight, rel=0.01)


@pytest.mark.nightly
def test_one_optimum_climbs_four_stairs_and_ten_from_standing_to_standing() -> None:
    problem = nlp_gait.load("stairs-climb")
    every_row = IpoptSettings(few_rows=False, iterations=600)  # learning the rows that matter pays from two starts on
    solution = nlp_gait.solve(problem, starts=1, seed=0, solver=every_row)
    assert solution.converged
    for stairs in (4, 10):
        plan, trace, _ = simulate(nlp_gait.load("stairs-climb", stairs=stairs), tuple(solution.x.values()))
        speeds = np.abs(np.diff(plan.signals.arrays["qd"], axis=0)).max(axis=1)
        switch = (len(speeds) // (stairs + 1)) * np.arange(1, stairs + 1)
        # Between two samples rates change by acceleration alone, also where steps meet.
        assert speeds[switch].max() < 1.1 * np.delete(speeds, switch).max()
        climb = measure_climb(plan, trace)
        assert climb.climbed == climb.stairs == stairs and max(climb.landing_errors_m) < 0.02
        assert climb.hip_rises_m == pytest.approx(climb.planned_rises_m, abs=0.005)
        assert count_shank_contacts(plan, trace) == 0
        if stairs == 4:
            climb_on_bumps(plan)


def climb_on_bumps(plan: Plan) -> None:
    """With errors of mass, friction and sensors, too; alone, it falls on the bumps."""
    worse = Conditions(bumps=Bumps(height_m=0.005, seed=1), mass_factor=1.05, friction=0.5)
    climb, alone = (
        measure_climb(plan, simulate_plan(plan, conditions, drive))
        for conditions, drive in (
            (worse, Drive(feedback=Balance(noise=1.0, delay_s=0.004, seed=1))),
            (Conditions(bumps=worse.bumps), Drive()),
        )
    )
    assert climb.climbed == climb.stairs == 4 and max(climb.landing_errors_m) < 0.02
    assert alone.climbed < 4


def test_balance_refuses_a_plan_that_leans_on_its_toe() -> None:
    plan = make_plan(Result(problem=(problem := nlp_gait.load("stairs-plan")), x=problem.check_x(FREE)))
    with pytest.raises(InputError, match="needs the ZMP on the sole in single support; this plan's is .* on the toe"):
        simulate_plan(plan, drive=Drive(feedback=Balance()))


def test_tracked_steps_climb_with_stiff_gains_and_fall_with_the_papers() -> None:
    problem = nlp_gait.load("stairs-track")
    assert not simulate(problem, TRACKED)[2].fallen
    loose = problem.with_values(gravity_compensation=0.0)
    assert simulate(loose, PAPERS_GAINS)[2].fallen


@pytest.mark.parametrize(
    ("gains", "share", "fallen", "climbed"),
    [(PAPERS_GAINS, 0, True, 0), ((2000.0, 200.0, 1.318), 0, False, 0), ((2000.0, 200.0, 1.318), 1, False, 1)],
)
def test_the_papers_controller_climbs_with_stiff_gains_and_gravity_compensated(
    tmp_path: Path, gains: tuple[float, ...], share: int, fallen: bool, climbed: int
) -> None:
    names = nlp_gait.load("stairs-plan").names
    plan = {name: x for name, x in zip(names, LIMITED, strict=True) if name in PLAN}
    problem = nlp_gait.load("stairs-track").with_values(**plan)
    drive = tmp_path / "paper.toml"
    kp, kd, _ = gains
    drive.write_text(f"[controller]\nkp = {kp}\nkd = {kd}\ngravity_compensation = {share}\n")
    reference = make_plan(Result(problem=problem, x=problem.check_x(gains)))
    trace = simulate_plan(reference, drive=load_drive(str(drive)))
    assert ((trace.fell_at_s is not None), measure_climb(reference, trace).climbed) == (fallen, climbed)


def test_the_command_simulates_them_and_names_what_is_not_repeated(tmp_path: Path) -> None:
    problem = nlp_gait.load("stairs-track")
    result = tmp_path / "climb.json"
    result.write_text(json.dumps({"problem": problem.name, "x": problem.by_name(problem.check_x(TRACKED))}))
    assert as_json("simulate", result, "--out", tmp_path / "out")["fallen"] is False
    assert 'name="tread 1"' in (tmp_path / "out" / "model.xml").read_text()
    assert "not a cycle that can be repeated" in one_sentence("simulate", result, "--steps", "2")
