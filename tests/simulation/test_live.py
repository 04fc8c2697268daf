"""Simulations in MuJoCo's viewer: the same run, pushed by keys, and what happens without a display."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import nlp_gait
from nlp_gait.errors import OutputError
from nlp_gait.formulation import Result
from tests.compare.cli.calls import as_json, process
from tests.compare.cli.calls import nlp_gait as call

pytest.importorskip("mujoco")
pytest.importorskip("glfw")

from nlp_gait.simulation import live  # noqa: E402
from nlp_gait.simulation.engine import DISPLAYS  # noqa: E402
from nlp_gait.simulation.plan import Plan, make_plan  # noqa: E402
from nlp_gait.simulation.simulate import SimulationRun, simulate_plan  # noqa: E402

UP, LEFT, OTHER = 265, 263, 32


@pytest.fixture(scope="module")
def plan() -> Plan:
    problem = nlp_gait.load("nao-ssp")
    return make_plan(Result(problem=problem, x=problem.start_point(np.random.default_rng(0))))


class Window:
    """MuJoCo's window without a display: keys are pressed at its pictures, and it is closed after the last of them."""

    def __init__(self, keys: list[int], press: Callable[[int], None], pictures: int) -> None:
        self.cam = SimpleNamespace()
        self._keys, self._press, self._left = iter(keys), press, pictures

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def is_running(self) -> bool:
        return self._left > 0

    def sync(self) -> None:
        self._left -= 1
        if (key := next(self._keys, None)) is not None:
            self._press(key)


@pytest.fixture
def open_window(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Replace the viewer by a window in which these keys are pressed, one at each picture."""

    def replace(*keys: int, pictures: int = 10**6) -> None:
        import mujoco

        def launch(model: Any, data: Any, *, key_callback: Callable[[int], None], **_: bool) -> Window:
            return Window(list(keys), key_callback, pictures)

        viewer = SimpleNamespace(launch_passive=launch)
        calls = dict.fromkeys(("window_hint", "default_window_hints", "destroy_window"), lambda *_: None)
        monkeypatch.setenv("DISPLAY", ":0")
        monkeypatch.setitem(
            sys.modules, "glfw", SimpleNamespace(init=lambda: True, create_window=lambda *_: True, VISIBLE=0, **calls)
        )
        monkeypatch.setitem(sys.modules, "mujoco.viewer", viewer)
        monkeypatch.setattr(mujoco, "viewer", viewer, raising=False)
        monkeypatch.setattr("time.sleep", lambda seconds: None)

    return replace


def test_a_watched_simulation_is_the_same(plan: Plan, open_window: Callable[..., None]) -> None:
    expected = simulate_plan(plan)
    for pictures in (10**6, 3):  # to the end, or until the window is closed
        open_window(OTHER, pictures=pictures)
        run = SimulationRun(plan)
        assert live.watch(run) == []
        np.testing.assert_array_equal(run.finish().states, expected.states)


def test_arrow_keys_push_forward_and_to_the_left(plan: Plan, open_window: Callable[..., None]) -> None:
    unpushed = simulate_plan(plan)
    for key, axis in ((UP, 0), (LEFT, 1)):
        open_window(OTHER, key)
        run = SimulationRun(plan)
        (push,) = live.watch(run)
        impulse = live.PUSH_SHARE * plan.robot.mass_kg * np.sqrt(9.8 * plan.at("hip", np.zeros(1))[0, 2])
        assert push.impulse_Ns[axis] == pytest.approx(impulse) and push.impulse_Ns[1 - axis] == 0.0
        assert push.start_s == pytest.approx(3 * live.FRAME_S, abs=3e-3)
        states = run.finish().states
        before = int(push.start_s / 0.0005) - 1
        np.testing.assert_array_equal(states[:before], unpushed.states[:before])
        after = before + 200
        assert states[after, axis] - unpushed.states[after, axis] > 1e-4


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    path = tmp_path / "gait.json"
    as_json("solve", "nao-ssp", "--starts", "1", "--out", path)
    return path


def test_without_a_display_it_is_simulated_and_the_command_fails_with_one_sentence(
    stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    result = call("simulate", stored, "--live", "--out", tmp_path / "out", status=1)
    assert result.stderr.count("\n") == 1 and "cannot open a window: no display" in result.stderr
    assert "The robot stays up" in result.stdout and (tmp_path / "out" / "simulation.npz").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="X11")
def test_a_display_that_does_not_answer_is_named(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":987")
    with pytest.raises(OutputError, match=r"cannot open a window on the display \(DISPLAY=:987\)"):
        live.watch(SimulationRun(plan))


@pytest.fixture
def display() -> Iterator[str]:
    if (program := shutil.which("Xvfb")) is None:
        pytest.skip("needs Xvfb")
    with subprocess.Popen([program, "-displayfd", "1", "-screen", "0", "640x480x24"], stdout=subprocess.PIPE) as server:
        assert server.stdout is not None
        yield f":{server.stdout.readline().decode().strip()}"
        server.terminate()


def test_the_window_opens_on_a_display(stored: Path, display: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", display)
    watched = process("simulate", stored, "--live", "--json")
    assert watched.returncode == 0, watched.stderr
    assert watched.stdout == call("simulate", stored, "--json").stdout
