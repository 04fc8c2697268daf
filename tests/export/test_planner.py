"""The planner in C: built by its own build line, the optima of nlp_gait.make_replanner, bounds and motion as in Python."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.onboard.replanner import Replanner, make_replanner
from nlp_gait.errors import InputError
from nlp_gait.export.solver import export_solver
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Outcome
from tests.backends.toys import corner, toy
from tests.compare.cli.calls import one_sentence
from tests.export.exported_planner import ExportedPlanner

pytest.importorskip("daqp")
pytestmark = pytest.mark.skipif(not (shutil.which("c++") and shutil.which("cc")), reason="no C and C++ compiler")


def make_in_c(problem: GaitProblem, near: Outcome, folder: Path, lanes: str = "") -> ExportedPlanner:
    """Export and build a planner, without optimisation and with all warnings; for all CPUs unless lanes are given."""
    flags = {"CFLAGS": "-O0 -Wall -Wextra -Wno-unused-parameter -Werror", "CXXFLAGS": f"-O0 {lanes}"}
    return ExportedPlanner(problem, near, folder, flags)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Replanner, ExportedPlanner]]:
    problem = nlp_gait.load("nao-dsp", trajectory="measured", intervals=4)
    solution = nlp_gait.solve(problem, starts=1)
    plan = make_replanner(problem, near=solution)
    yield plan, make_in_c(problem, solution.starts[0], tmp_path_factory.mktemp("planner"), "-DLANES=1")


@pytest.mark.slow
def test_c_finds_the_optima_of_python(both: tuple[Replanner, ExportedPlanner]) -> None:
    """A second solve at the same parameters removes what the tolerance of the first left."""
    plan, in_c = both
    problem = plan.problem
    for change in (0.03, -0.02, 0.0):
        values = {"dbm_y_mean_limit_m": problem.value("dbm_y_mean_limit_m") * (1.0 + change)}
        values |= {"hip_x_start_m": problem.value("hip_x_start_m") + 0.05 * change}
        p = problem.with_values(**values).p
        first, (status, report) = plan.solve(values), in_c.solve(p)
        assert first.solver == "sqp" and first.converged and status == "optimal"
        assert report.cost == pytest.approx(first.objective, rel=1e-6)
        expected, (status, report) = plan.solve(values), in_c.solve(p)
        assert status == "optimal" and report.cost == pytest.approx(expected.objective, rel=1e-9)
        np.testing.assert_allclose(in_c.x, expected.x, atol=1e-6)


@pytest.mark.slow
def test_every_bound_is_a_function_of_the_parameters(both: tuple[Replanner, ExportedPlanner]) -> None:
    plan, in_c = both
    model, problem = build_nlp(plan.problem), plan.problem
    moved = problem.with_values(**{q.name: q.default * 1.01 for q in problem.own_parameters if q.default > 0.0})
    lower, upper = np.zeros((2, len(model.row_names) + len(model.tie_upper)))
    in_c.call("bounds", moved.p, lower, upper)
    expected = model.bounds(moved)
    np.testing.assert_array_equal([lower, upper], [expected["lbg"], expected["ubg"]])
    assert (lower != model.bounds(problem)["lbg"]).any() or (upper != model.bounds(problem)["ubg"]).any()
    start = np.zeros(model.variables + model.lifted)
    in_c.call("lift", in_c.x, moved.p, start)
    np.testing.assert_allclose(start, model.start(moved, in_c.x, model.widths[-1]), rtol=1e-12, atol=1e-12)
    wrong = problem.p.copy()
    wrong[-1] = np.nan
    assert in_c.solve(wrong)[0] == "wrong parameters"


@pytest.mark.slow
def test_the_motion_at_a_time_is_that_of_the_signals(both: tuple[Replanner, ExportedPlanner]) -> None:
    plan, in_c = both
    signals = plan.problem.signals(in_c.x)
    count = len(signals.joints)
    q, qd, tau, zmp = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(2)
    for k, t in enumerate(signals["t"]):
        in_c.call("at_time", in_c.x, plan.problem.p, float(t), q, qd, tau, zmp)
        for name, value in (("q", q), ("qd", qd), ("tau", tau), ("zmp", zmp)):
            np.testing.assert_allclose(value, signals[name][k], rtol=1e-9, atol=1e-9, err_msg=name)
    in_c.call("at_time", in_c.x, plan.problem.p, 99.0, q, qd, tau, zmp)
    np.testing.assert_allclose(q, signals["q"][-1], atol=1e-9)


@pytest.mark.slow
def test_the_example_plans_recorded_values_of_a_users_problem(tmp_path: Path) -> None:
    """|x - 1| + 2 |y - 1| with min(x, y) >= limit is 0 at (1, 1) up to limit 1, then 3 (limit - 1); x <= 2."""
    problem = toy(corner, limit=0.5)
    solution = nlp_gait.solve(problem, starts=3)
    in_c = make_in_c(problem, min(solution.starts, key=lambda outcome: outcome.rank), tmp_path)
    limits = (1.5, 1.2, 0.7, 1.05, 5.0)
    (tmp_path / "states.csv").write_text("limit\n" + "".join(f"{limit}\n" for limit in limits), encoding="utf-8")
    run = [str(tmp_path / "plan"), str(tmp_path / "states.csv"), "0"]
    *lines, total = subprocess.run(run, check=True, capture_output=True, text=True, timeout=60).stdout.splitlines()
    for limit, line in zip(limits[:-1], lines, strict=False):
        status, _, _, cost, *x = line.split()
        assert status == "optimal" and float(cost) == pytest.approx(3.0 * max(limit - 1.0, 0.0), abs=1e-8)
        np.testing.assert_allclose([float(each) for each in x], max(1.0, limit), atol=1e-8)
    assert lines[-1].startswith("violated") and total.startswith(
        "5 instants, optimal 4, feasible 0, violated 1: median"
    )
    status, report = in_c.solve(problem.with_values(limit=5.0).p)
    assert status == "violated" and report.worst_row == 0 and report.worst >= 3.0 - 1e-6


def test_what_has_no_planner_in_c_is_refused(tmp_path: Path) -> None:
    message = one_sentence("export-solver", "stairs-ideal", "--to", tmp_path, "--planner")
    assert "1560 variables" in message and "at most 60" in message
    assert "give one of them" in one_sentence("export-solver", "walk12", "--to", tmp_path, "--planner", "--nl")
    problem = toy(corner)
    infeasible = nlp_gait.solve(problem.with_values(limit=5.0), starts=1).starts[0]
    with pytest.raises(InputError, match="begins from an optimum"):
        export_solver(problem, tmp_path, near=infeasible)
