"""Films of the simulated robot: recordings, captions and pictures."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.errors import InputError

pytest.importorskip("mujoco")

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.film import film  # noqa: E402
from nlp_gait.simulation.film.film import parse_picture_size  # noqa: E402
from nlp_gait.simulation.film.recording import record_film  # noqa: E402
from nlp_gait.simulation.measurements import measure  # noqa: E402
from nlp_gait.simulation.mjcf import make_plan_model  # noqa: E402
from nlp_gait.simulation.plan import make_plan  # noqa: E402
from nlp_gait.simulation.simulate import simulate_plan  # noqa: E402

ROOT = Path(__file__).parents[2]
# A gait, and two side by side, drawn in a separate process: the graphics driver is chosen when the engine is imported.
DRAW = """
import sys
import numpy as np
import nlp_gait
from dataclasses import replace
from functools import partial
from nlp_gait.formulation import Result
from nlp_gait.simulation.engine import load_mujoco
load_mujoco(pictures=True)
from nlp_gait.simulation.film.film import draw_pictures
from nlp_gait.simulation.film.recording import record_film
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

problem = nlp_gait.load("nao-dsp")
plan = make_plan(Result(problem=problem, x=problem.check_x((0.31, -0.0008, -0.0055, 0.052, 0.001, -0.0367, -0.0424, 0.4))))
shot = record_film("dsp", plan, partial(simulate_plan, plan), 0.8)
np.savez(sys.argv[1], one=list(draw_pictures([shot], (480, 360))), two=[next(draw_pictures([shot, shot], (640, 360), "slow"))])
"""


@pytest.fixture(scope="module")
def recording(gait):
    plan = make_plan(gait("dsp optimum"))
    return plan, record_film("a title", plan, partial(simulate_plan, plan), 0.25)


@pytest.mark.slow
def test_a_recording_has_a_state_and_numbers_at_every_picture(recording):
    plan, record = recording
    np.testing.assert_allclose(record.t, 0.25 * np.arange(len(record.t)), atol=1e-9)
    assert len(record.t) == round((plan.duration_s + 1.0) / 0.25)  # a second of settling
    assert record.states.shape == (len(record.t), record.model.nq)
    np.testing.assert_allclose(record.states[0, :3], plan.at("hip", np.zeros(1))[0])
    during = record.t < plan.duration_s
    mean_W = measure(plan, record.simulation, Drive()).measured.total_W
    assert record.power[during].mean() == pytest.approx(mean_W, rel=0.1)  # a few samples of what that averages
    planned_m_s = float(np.ptp(plan.signals.arrays["hip"][:, 0])) / plan.duration_s
    assert record.speed[during].mean() == pytest.approx(planned_m_s, rel=0.2)
    weight_N = record.model.body_mass.sum() * plan.gravity
    np.testing.assert_allclose(record.load[1:], weight_N, rtol=0.1)  # at first nothing has touched down
    assert np.linalg.norm(record.pressure - record.planned, axis=1)[during].max() < 0.03


class GreyScene:
    """Views without an engine."""

    drawn: list[object]

    def __init__(self, recording, views, width, height):
        self.size = (height, width, 3)
        type(self).drawn = []

    def draw(self, k):
        self.drawn.append(k)
        return np.full(self.size, 128, dtype=np.uint8)

    def close(self):
        self.drawn.append("closed")


@pytest.mark.slow
def test_ctrl_c_waits_for_the_end_of_a_picture(recording, monkeypatch):
    class Interrupted(GreyScene):
        def draw(self, k):
            signal.raise_signal(signal.SIGINT)
            return super().draw(k)

    monkeypatch.setattr(film, "Scene", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        list(film.draw_pictures([recording[1]], (320, 240)))
    assert Interrupted.drawn == [0, "closed"]


@pytest.mark.slow
def test_captions_show_time_speed_and_power_and_a_fall(recording, monkeypatch):
    monkeypatch.setattr(film, "Scene", GreyScene)
    plan, record = recording
    fallen = replace(record, simulation=replace(record.simulation, fell_at_s=0.5))
    up, down = (list(film.draw_pictures([each], (640, 480)))[1:6] for each in (record, fallen))
    top, strip = slice(0, 30), slice(480 - 66, 480)
    assert (up[0][top] < 100).any(), "the title"
    assert (up[0][top] == up[3][top]).all() and (up[0][strip] != up[3][strip]).any()

    def count_red(picture):
        return ((picture[strip, :, 0] > 150) & (picture[strip, :, 1] < 80)).sum()

    assert count_red(down[3]) > 20 and not count_red(up[3])


@pytest.mark.slow
def test_a_recording_stands_still_on_a_fall(gait):
    plan = make_plan(gait("ssp falling"))
    record = record_film("a fall", plan, partial(simulate_plan, plan), 0.25)
    fell_at_s = record.simulation.fell_at_s
    assert fell_at_s is not None
    assert (record.t == fell_at_s).sum() == 4  # a second
    assert record.t[-5] == pytest.approx(fell_at_s, abs=0.25) and record.t[-5] < fell_at_s
    assert len(record.states) == len(record.t) and (record.states[-1] == record.states[-5]).all()


def test_legs_have_a_colour_for_each_side(gait):
    from xml.etree import ElementTree as Xml

    plan = make_plan(gait("dsp optimum"))
    root = Xml.fromstring(make_plan_model(plan, Drive()))
    colours = {body.get("name"): {geom.get("rgba") for geom in body.findall("geom")} for body in root.iter("body")}
    left, right = colours["l_ankle"], colours["r_ankle"]
    assert colours["LThigh"] == left != right == colours["RTibia"]
    assert colours["torso"] == colours["LBicep"] and not colours["torso"] & (left | right)


@pytest.mark.slow
def test_pictures_show_both_legs_pressure_and_captions_of_one_gait_or_two(tmp_path):
    file = tmp_path / "pictures.npz"
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-P", "-c", DRAW, file],
        env=environment | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    if "cannot be drawn off the screen" in done.stderr or "MuJoCo does not load" in done.stderr:
        pytest.skip("no off-screen graphics here")
    assert done.returncode == 0, done.stderr
    with np.load(file) as found:
        one, two = found["one"].astype(int), found["two"].astype(int)
    assert one.shape[1:] == (360, 480, 3) and two.shape[1:] == (360, 640, 3)
    assert len(one) == 2 and len(two) == 1
    for area in (one[0], two[0][:, :318], two[0][:, 322:]):
        blue = (area[:, :, 2] > area[:, :, 0] + 90).sum()
        orange = (area[:, :, 0] > area[:, :, 2] + 90).sum()
        assert blue > 500 and orange > 500
    assert (one[0] != one[1]).any()
    text = one[0][312:, :70]
    assert (text < 100).any() and (text == 255).any()


@pytest.mark.parametrize("text", ["", "1280", "100x100", "1280x", "9999x9999", "-640x480", "640x480x3"])
def test_a_wrong_size_is_refused(text):
    with pytest.raises(InputError, match="size of a film is WIDTHxHEIGHT in pixels from 320x240 to 3840x2160"):
        parse_picture_size(text)


def test_a_size_is_read():
    assert parse_picture_size("1280x720") == (1280, 720) and parse_picture_size(" 640X360 ") == (640, 360)
