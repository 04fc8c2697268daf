"""The simulated robot in MuJoCo's own window."""

from __future__ import annotations

import time
import warnings
from typing import Any

from nlp_gait.errors import OutputError
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.film.recording import Player
from nlp_gait.simulation.simulate import Simulation

AZIMUTH, ELEVATION, DISTANCE, LOOK_AT = 125.0, -12.0, 1.6, (0.06, 0.0, 0.24)  # it follows the torso


def show_in_window(player: Player) -> Simulation:
    """Play a gait at its own pace in MuJoCo's window.

    Raises:
        OutputError: there is no display.
    """
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
        if window.is_running():  # closed by the user, the simulation goes on without it
            window.cam.lookat[0] = data.qpos[0]
            window.sync()
            time.sleep(max(0.0, data.time - (time.monotonic() - began)))

    try:
        return player(on_step=follow)
    finally:
        if window is not None:
            window.close()


def _require_display() -> None:
    """Raise OutputError where no window can be opened: MuJoCo's viewer would end the whole process."""
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        ready = glfw.init()
    if not ready:
        raise OutputError("no window can be opened, for there is no display; use --video FILE.gif instead of --viewer")
