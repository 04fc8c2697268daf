"""A simulation in MuJoCo's viewer, in real time; arrow keys push the robot."""

import math
import os
import sys
import time
import warnings
from collections import deque
from collections.abc import Mapping
from typing import Any

from nlp_gait.errors import MissingExtraError, OutputError
from nlp_gait.simulation.engine import DISPLAYS
from nlp_gait.simulation.simulate import Push, SimulationRun

FRAME_S = 1 / 60  # between two pictures
PUSH_SHARE = 0.03  # impulse of a key, of mass sqrt(gravity height)
# Codes of GLFW's keys, and the directions forward and to the left into which they push.
KEYS: Mapping[int, tuple[int, int]] = {265: (1, 0), 264: (-1, 0), 263: (0, 1), 262: (0, -1)}


def watch(run: SimulationRun) -> list[Push]:
    """Show a simulation in real time until it ends or the window is closed, and return the pushes of the arrow keys.

    Raises MissingExtraError without GLFW, and OutputError, before anything is simulated, where no window can be opened.
    """
    _check_display()
    from mujoco import mjtCamera, viewer

    plan, pressed = run.plan, deque[int]()
    height = float(plan.signals.arrays["hip"][0, 2])
    impulse = PUSH_SHARE * plan.robot.mass_kg * math.sqrt(plan.gravity * height)
    pushes: list[Push] = []
    try:
        window = viewer.launch_passive(
            run.model, run.data, key_callback=pressed.append, show_left_ui=False, show_right_ui=False
        )
    except RuntimeError as error:  # macOS has windows on its first thread only
        raise OutputError(f"cannot open a window: {error}") from error
    with window:
        window.cam.type, window.cam.trackbodyid = mjtCamera.mjCAMERA_TRACKING, run.data.body(plan.robot.root).id
        window.cam.distance = 4.0 * height
        begin = time.perf_counter() - run.time_s
        while window.is_running() and run.advance(run.time_s + FRAME_S):
            while pressed:
                if direction := KEYS.get(pressed.popleft()):
                    x, y = (impulse * share for share in direction)
                    pushes.append(Push(impulse_Ns=(x, y), start_s=run.time_s))
                    run.push(pushes[-1])
            window.sync()
            time.sleep(max(0.0, begin + run.time_s - time.perf_counter()))
    return pushes


def _check_display() -> None:
    """Raise an error where MuJoCo's viewer, which would wait for a window forever, cannot open one."""
    if sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAYS):
        raise OutputError(f"cannot open a window: no display ({' and '.join(DISPLAYS)} are not set)")
    try:
        import glfw
    except ImportError as error:
        raise MissingExtraError(f"--live needs GLFW ({error}); install it with pip install 'nlp-gait[sim]'") from error
    window: Any = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the error says the same
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, False)
            window = glfw.create_window(64, 64, "", None, None)
            glfw.default_window_hints()
    if not window:
        names = ", ".join(f"{name}={os.environ[name]}" for name in DISPLAYS if name in os.environ)
        raise OutputError(f"cannot open a window on the display{f' ({names})' if names else ''}")
    glfw.destroy_window(window)
