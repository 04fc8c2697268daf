"""Tables about the engine, on a few gaits."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

import nlp_gait  # noqa: E402
from benchmarks.engine import agreement, gaits, other_robots  # noqa: E402
from compare.judge import evaluate  # noqa: E402
from compare.papers.walk12.walk12_paper import find_row  # noqa: E402
from nlp_gait.errors import InputError  # noqa: E402
from nlp_gait.formulation import Result  # noqa: E402
from nlp_gait.gaits.walk12.walk12_display import make_rigid_bodies  # noqa: E402
from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped  # noqa: E402


@pytest.mark.slow
def test_random_gaits_are_feasible_and_seeded():
    problem = nlp_gait.load("nao-dsp")
    found = gaits.random_gaits(problem, 3, seed=3)
    assert [evaluate(problem, gait.x).feasible for gait in found] == [True] * 3
    again = gaits.random_gaits(problem, 3, seed=3)
    np.testing.assert_array_equal([gait.x for gait in found], [gait.x for gait in again])


@pytest.mark.slow
def test_too_few_feasible_gaits_are_an_error(monkeypatch):
    monkeypatch.setattr(gaits, "DRAWS", 1)
    monkeypatch.setattr(gaits, "BATCH", 10)
    with pytest.raises(InputError, match=r"of 10 random gaits of 'nao-dsp' are feasible, of 30 required"):
        gaits.random_gaits(nlp_gait.load("nao-dsp"), 30)


@pytest.mark.slow
def test_the_engine_ranks_random_gaits_of_double_support_as_the_model_does(monkeypatch):
    monkeypatch.setattr(agreement, "RANDOM", 3)
    monkeypatch.setattr(agreement, "RANKED", {"feed-forward": agreement.RANKED["feed-forward"]})
    monkeypatch.setattr(agreement, "KINDS", {"nao-dsp": {}})
    row = list(agreement.ranking())[-1].split(" | ")
    assert row[2:5] == ["0", "0", "1.0000"]
    assert abs(float(row[6].rstrip("%"))) < 5.0


def test_point_masses_are_built_otherwise_only_within_the_block():
    def inertia() -> float:
        robot = make_rigid_bodies(load_point_mass_biped())
        return float(robot.links["left foot"].inertia_com_kgm2[0])

    usual = inertia()
    with other_robots.spheres("SPHERE_RADIUS", 0.03):
        assert inertia() == pytest.approx(usual * (0.03 / 0.02) ** 2)
    assert inertia() == usual


@pytest.mark.slow
def test_a_row_of_the_walk_says_share_fate_and_steps(monkeypatch):
    problem = nlp_gait.load("walk12")
    gait = Result(problem=problem, x=problem.check_x(find_row(1.0).x))
    monkeypatch.setattr(other_robots, "walks", lambda: {"paper, lambda 1": gait})
    monkeypatch.setattr(other_robots, "STEPS", 5)
    cells = list(other_robots.walk12())[-1].strip("| ").split(" | ")
    assert cells[:2] == ["paper, lambda 1", "0.45"]
    assert cells[2].startswith("falls at") and int(cells[3]) < 5 and cells[4] == "-"
