"""Recorded simulations: states at the times of pictures, and the robot as a skeleton."""

from functools import partial

import numpy as np
import pytest

from nlp_gait.errors import OutputError

pytest.importorskip("mujoco")

from nlp_gait.simulation.engine import load_mujoco  # noqa: E402
from nlp_gait.simulation.plan import make_plan  # noqa: E402
from nlp_gait.simulation.replay import FRAMES_PER_S, draw_pictures, make_skeleton, record_states  # noqa: E402
from nlp_gait.simulation.simulate import simulate_plan  # noqa: E402


@pytest.fixture(scope="module")
def recording(gait):
    plan = make_plan(gait("dsp optimum"))
    return record_states(plan, partial(simulate_plan, plan))


@pytest.mark.slow
def test_states_are_those_at_the_times_of_pictures(recording):
    times = recording.simulation.t[recording.steps]
    np.testing.assert_allclose(times, np.arange(len(times)) / FRAMES_PER_S, atol=5e-4)
    assert len(times) == round((recording.plan.duration_s + 1.0) * FRAMES_PER_S)  # a second of settling
    assert recording.states.shape == (len(times), recording.model.nq)
    np.testing.assert_allclose(recording.states[:, :3], recording.simulation.torso[recording.steps], atol=1e-12)


@pytest.mark.slow
def test_the_skeleton_is_where_the_engine_has_the_robot(recording):
    skeleton = make_skeleton(recording, "rectangle", "a title")
    feet = recording.simulation.feet[recording.steps]  # soles under the ankles
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


@pytest.mark.slow
def test_without_opengl_the_error_names_the_page(recording, monkeypatch):
    def refuse(*_):
        raise RuntimeError("no context")

    monkeypatch.setattr(load_mujoco(), "Renderer", refuse)
    with pytest.raises(OutputError, match=r"a video needs OpenGL \(no context\).* or write a page by --page FILE.html"):
        next(draw_pictures(recording))
