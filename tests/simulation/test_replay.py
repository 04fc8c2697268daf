"""Simulations to look at: states at the times of pictures, and the robot as a skeleton."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.plan import make_plan  # noqa: E402
from nlp_gait.simulation.replay import FRAMES_PER_S, list_frames, make_skeleton  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, prepare, simulate_plan  # noqa: E402


@pytest.fixture(scope="module")
def simulated(gait):
    plan = make_plan(gait("dsp optimum"))
    model, _ = prepare(plan, Conditions(), Drive())
    return plan, simulate_plan(plan), model


def test_frames_are_equally_long_and_states_those_of_the_torso(simulated):
    plan, trace, model = simulated
    frames = list_frames(trace)
    np.testing.assert_allclose(trace.t[frames], np.arange(len(frames)) / FRAMES_PER_S, atol=5e-4)
    assert len(frames) == round((plan.duration_s + 1.0) * FRAMES_PER_S)  # a second of settling
    assert trace.states.shape == (len(trace.t), model.nq)
    np.testing.assert_allclose(trace.states[:, :3], trace.torso, atol=1e-12)


def test_the_skeleton_is_where_the_engine_has_the_robot(simulated):
    skeleton = make_skeleton(*simulated, "a title")
    feet = simulated[1].feet[list_frames(simulated[1])]  # soles under the ankles
    for i, side in enumerate(("left", "right")):
        (sole,) = (part for part in skeleton.soles if part.side == side)
        middle = sole.corners.mean(axis=1)
        assert np.linalg.norm(middle - feet[:, i], axis=1).max() < 0.06  # the ankle is not in the middle of the sole
        assert np.abs(sole.corners[:, :, 2]).max() < 0.005
        assert sole.supports[5:].all()
        assert any(limb.side == side for limb in skeleton.limbs)
    assert skeleton.com is not None and skeleton.zmp is not None
    assert np.abs(skeleton.com[-1, :2] - skeleton.zmp[-1, :2]).max() < 0.005  # at rest
    assert (skeleton.margin()[5:] > 0.0).all()
    np.testing.assert_array_equal(skeleton.ground[:, 1], 0.0)
