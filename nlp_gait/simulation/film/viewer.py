"""The simulated robot in MuJoCo's own window."""

from __future__ import annotations

import time
import warnings
from typing import Any

from nlp_gait.errors import OutputError
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.film.recording import Simulator
from nlp_gait.simulation.simulate import Simulation

AZIMUTH, ELEVATION, DISTANCE, LOOK_AT = 125.0, -12.0, 1.6, (0.06, 0.0, 0.24)  # it follows the torso


def show_in_window(simulate: Simulator) -> Simulation:
    """Simulate a gait in real time in MuJoCo's window; raises OutputError without a display."""
    load_mujoco()
    _require_display()
    from mujoco import viewer

    window: Any = None
    began = 0.0

    def follow(model: Any, data: Any) -> None:
        nonlocal window, began
        if window is None:
            window, began = viewer.launch_passive(model, data), time.monotonic()
            window.cam.azimuth, window.cam.elevation, window.cam.distance = AZIMUTH, ELEVATION, DISTANCE
            window.cam.lookat[:] = LOOK_AT
        if window.is_running():  # if the user closes it, the simulation continues
            window.cam.lookat[0] = data.qpos[0]
            window.sync()
            time.sleep(max(0.0, data.time - (time.monotonic() - began)))

    try:
        return simulate(on_step=follow)
    finally:
        if window is not None:
            window.close()


def _require_display() -> None:
    """Raise OutputError without a display: MuJoCo's viewer would end the whole process."""
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        ready = glfw.init()
    if not ready:
        raise OutputError("cannot open a window: no display; use --video FILE.gif instead of --viewer")
