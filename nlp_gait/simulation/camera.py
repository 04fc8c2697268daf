"""The simulated robot as pictures, and in MuJoCo's own window."""

from __future__ import annotations

import time
from typing import Any

from nlp_gait.errors import OutputError
from nlp_gait.export.video import Frame
from nlp_gait.simulation.conditions import Conditions
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import mujoco
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.playback import Trace, play

WIDTH, HEIGHT = 480, 480
AZIMUTH, ELEVATION, DISTANCE, LOOK_AT = 125.0, -12.0, 1.1, (0.06, 0.0, 0.24)


def filmed(
    plan: Plan, conditions: Conditions, drive: Drive, sole: str, frames_per_s: float
) -> tuple[Trace, list[Frame]]:
    """Play a gait and take pictures of it, without a window.

    Raises:
        OutputError: this machine has no way to draw off the screen.
    """
    engine = mujoco()
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
    import mujoco.viewer as viewer

    window: Any = None
    began = time.monotonic()

    def follow(model: Any, data: Any) -> None:
        nonlocal window
        if window is None:
            try:
                window = viewer.launch_passive(model, data)
            except Exception as error:  # whatever the window system raises
                raise OutputError(f"no window can be opened ({error}); use --video FILE.gif instead") from error
            _aimed(window.cam)
        window.sync()
        time.sleep(max(0.0, data.time - (time.monotonic() - began)))

    try:
        return play(plan, conditions, drive, sole=sole, observe=follow)
    finally:
        if window is not None:
            window.close()


def _aimed(camera: Any) -> Any:
    camera.azimuth, camera.elevation, camera.distance = AZIMUTH, ELEVATION, DISTANCE
    camera.lookat[:] = LOOK_AT
    return camera


def _renderer(engine: Any, model: Any) -> Any:
    try:
        return engine.Renderer(model, HEIGHT, WIDTH)
    except Exception as error:  # whatever the graphics driver raises
        raise OutputError(
            f"pictures cannot be drawn off the screen ({error}); set MUJOCO_GL=egl or MUJOCO_GL=osmesa, whichever is installed"
        ) from error
