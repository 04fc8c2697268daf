"""The simulated robot as pictures, and in MuJoCo's own window."""

from __future__ import annotations

import time
import warnings
from typing import Any

from nlp_gait.errors import OutputError
from nlp_gait.simulation.conditions import Conditions
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import mujoco
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.playback import Trace, play
from nlp_gait.simulation.video import Frame

WIDTH, HEIGHT = 480, 480
AZIMUTH, ELEVATION, DISTANCE, LOOK_AT = 125.0, -12.0, 1.1, (0.06, 0.0, 0.24)  # it follows the torso


def filmed(
    plan: Plan, conditions: Conditions, drive: Drive, sole: str, frames_per_s: float
) -> tuple[Trace, list[Frame]]:
    """Play a gait and take pictures of it, without a window.

    Raises:
        OutputError: this machine has no way to draw off the screen.
    """
    engine = mujoco(pictures=True)
    steps_per_frame = max(1, round(1.0 / (frames_per_s * TIME_STEP)))
    frames: list[Frame] = []
    camera = _aimed(engine.MjvCamera())
    renderer: Any = None
    count = 0

    def take(model: Any, data: Any) -> None:
        nonlocal renderer, count
        if renderer is None:
            renderer = _renderer(engine, model)
        if count % steps_per_frame == 0:
            camera.lookat[0] = data.qpos[0]
            renderer.update_scene(data, camera)
            frames.append(renderer.render().copy())
        count += 1

    try:
        trace = play(plan, conditions, drive, sole=sole, observe=take)
    finally:
        if renderer is not None:
            renderer.close()
    return trace, frames


def shown(plan: Plan, conditions: Conditions, drive: Drive, sole: str) -> Trace:
    """Play a gait at its own pace in MuJoCo's window.

    Raises:
        OutputError: there is no display.
    """
    mujoco()
    _require_display()
    from mujoco import viewer

    window: Any = None
    began = 0.0

    def follow(model: Any, data: Any) -> None:
        nonlocal window, began
        if window is None:
            window, began = viewer.launch_passive(model, data), time.monotonic()
            _aimed(window.cam)
        if window.is_running():  # closed by the user, the simulation goes on without it
            window.cam.lookat[0] = data.qpos[0]
            window.sync()
            time.sleep(max(0.0, data.time - (time.monotonic() - began)))

    try:
        return play(plan, conditions, drive, sole=sole, observe=follow)
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


def _aimed(camera: Any) -> Any:
    camera.azimuth, camera.elevation, camera.distance = AZIMUTH, ELEVATION, DISTANCE
    camera.lookat[:] = LOOK_AT
    return camera


def _renderer(engine: Any, model: Any) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the failure itself says enough
            return engine.Renderer(model, HEIGHT, WIDTH)
    except Exception as error:  # whatever the graphics driver raises
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise OutputError(
            f"pictures cannot be drawn off the screen ({reason}); set MUJOCO_GL=egl or MUJOCO_GL=osmesa, if installed"
        ) from error
