"""The climb, in the engine."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import nlp_gait
from compare.cli import app
from nlp_gait.formulation import GaitProblem, Result

pytest.importorskip("mujoco")
pytestmark = pytest.mark.slow  # each gait is simulated

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.measurements import Measurements, measure  # noqa: E402
from nlp_gait.simulation.plan import Plan, make_plan  # noqa: E402
from nlp_gait.simulation.simulate import Simulation, simulate_plan  # noqa: E402

# Optimum of stairs-plan for case 2, to four digits, and one of stairs-track.
CLIMB = (0.6926, 0.0918, 0.2434, 0.0923, 0.709, 1.4, 0.5763, 0.7783, 1.3287, 0.3169, 0.2)
TRACKED = (8700.0, 10_000.0, 1.463)
PAPERS_GAINS = (2.6474, 7.3724, 1.2055)  # Bhardwaj et al., Table IV, case 2


def simulate(
    problem: GaitProblem, x: tuple[float, ...], steps: int | None = None
) -> tuple[Plan, Simulation, Measurements]:
    plan = make_plan(Result(problem=problem, x=problem.check_x(x)), steps)
    trace = simulate_plan(plan)
    return plan, trace, measure(plan, trace, Drive())


def test_the_planned_climb_is_climbed_with_the_planned_energy() -> None:
    plan, trace, m = simulate(nlp_gait.load("stairs-plan"), CLIMB)
    assert not m.fallen and m.largest_tilt_deg < 2.0
    assert m.measured.mechanical_W == pytest.approx(m.predicted.mechanical_W, rel=0.05)
    assert m.pressure_middle_rms_m is not None and m.pressure_middle_rms_m < 0.004
    assert m.landings["right"].error_m < 0.005
    rise = 0.508 / 2 * 0.70
    heights = trace.feet[[0, -1], 1, 2]
    assert heights[0] == pytest.approx(0.0, abs=0.002)
    assert heights[1] == pytest.approx(2 * rise + 0.05 * np.sin(np.pi / 6), abs=0.005)  # it stands on its toe
    assert np.abs(trace.feet[:, :, 1]).max() < 1e-12  # nothing leaves the plane
    weight = plan.robot.mass_kg * plan.gravity
    assert trace.loads[-200:].sum(axis=1).mean() == pytest.approx(weight, rel=0.01)


def test_tracked_steps_climb_with_stiff_gains_and_fall_with_the_papers() -> None:
    problem = nlp_gait.load("stairs-track")
    assert not simulate(problem, TRACKED)[2].fallen
    loose = problem.with_values(gravity_compensation=0.0)
    assert simulate(loose, PAPERS_GAINS)[2].fallen


def test_the_command_simulates_them_and_names_what_is_not_repeated(tmp_path: Path) -> None:
    problem = nlp_gait.load("stairs-track")
    result = tmp_path / "climb.json"
    result.write_text(json.dumps({"problem": problem.name, "x": problem.by_name(problem.check_x(TRACKED))}))
    done = CliRunner().invoke(app, ["simulate", str(result), "--out", str(tmp_path / "out"), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["fallen"] is False
    assert 'name="tread 1"' in (tmp_path / "out" / "model.xml").read_text()
    refused = CliRunner().invoke(app, ["simulate", str(result), "--steps", "2"])
    assert refused.exit_code != 0 and "not a cycle that can be repeated" in refused.output + refused.stderr
