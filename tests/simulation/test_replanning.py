"""Planning again in the engine: what is planned without disturbance, what the options free, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import Result

pytest.importorskip("mujoco")
pytest.importorskip("daqp")

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.plan import Plan, make_plan  # noqa: E402
from nlp_gait.simulation.replanning import Replanning, list_phases  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, Push, simulate_plan  # noqa: E402
from tests.simulation.test_walking import CHEAPEST  # noqa: E402

QUIET = replace(Replanning().with_noise(0.0), delay_s=0.0)


@pytest.fixture(scope="module")
def plan() -> Plan:
    problem = nlp_gait.load("nao-cycle")
    return make_plan(Result(problem=problem, x=problem.check_x(CHEAPEST)), 2)


def test_phases_are_seen_from_the_standing_foot(plan: Plan) -> None:
    """The second step is the mirror image of the first one."""
    phases = list_phases(plan, plan.body)
    assert [(phase.name, phase.stance) for phase in phases] == [("ssp", 0), ("dsp", 0), ("ssp", 1), ("dsp", 1)]
    np.testing.assert_allclose([phase.duration_s for phase in phases[:2]], CHEAPEST[17:19], atol=0.002)
    for first, second in zip(phases[:2], phases[2:], strict=True):
        for mine, other in zip((*first.start[:4], *first.end[:4]), (*second.start[:4], *second.end[:4]), strict=True):
            np.testing.assert_allclose(mine, other, atol=1e-4)


@pytest.fixture(scope="module")
def step() -> Plan:
    problem = nlp_gait.load("nao-cycle")
    return make_plan(Result(problem=problem, x=problem.check_x(CHEAPEST)), 1)


@pytest.mark.slow
def test_without_disturbance_the_plan_is_that_of_the_walk(step: Plan) -> None:
    found = simulate_plan(step, None, Drive(feedback=QUIET))
    assert found.fell_at_s is None and found.plans is not None
    _, wall, converged, followed = found.plans.T
    assert len(wall) > 80 and converged.mean() > 0.99 and followed.mean() > 0.99
    during = found.t < step.duration_s - 0.05
    planned = step.at("hip", found.t[during])
    assert np.abs(found.torso[during] - planned).max() < 0.01
    assert np.abs(found.set_points[during] - step.at("q", found.t[during])).max() < 0.2


@pytest.mark.slow
def test_a_push_moves_the_next_foothold_only_if_that_is_free(step: Plan) -> None:
    def land(free: str) -> float:
        pushed = Conditions(push=Push(impulse_Ns=(0.8, 0.0), start_s=0.05))
        short = replace(QUIET, free=free)
        found = simulate_plan(step, pushed, Drive(feedback=short))
        at = int(np.searchsorted(found.t, 0.5))
        return float(found.feet[at, 1, 0] - found.feet[at, 0, 0])

    assert land("length,width,time") > land("") + 0.01


@pytest.mark.slow
@pytest.mark.parametrize("push", [(1.8, 0.0), (0.0, -1.8)], ids=["forward", "right"])
def test_a_push_under_which_open_loop_falls_is_survived(step: Plan, push: tuple[float, float]) -> None:
    pushed = Conditions(push=Push(impulse_Ns=push, start_s=0.05))
    assert simulate_plan(step, pushed).fell_at_s is not None
    assert simulate_plan(step, pushed, Drive(feedback=QUIET)).fell_at_s is None


def test_what_cannot_be_planned_again_is_refused(plan: Plan) -> None:
    with pytest.raises(InputError, match="free must be some of length,width,time"):
        Replanning(free="height")
    with pytest.raises(InputError, match="period_s of a feedback must be"):
        Replanning(period_s=0.0)
    with pytest.raises(InputError, match="planning again is for walks on the flat whose torso stays upright"):
        simulate_plan(replace(plan, body=None), None, Drive(feedback=QUIET))
