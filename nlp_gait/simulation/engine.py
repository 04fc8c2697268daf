"""Import of MuJoCo, with messages on how to install it."""

from __future__ import annotations

import os
import sys
from types import ModuleType

from nlp_gait.errors import MissingExtraError, OutputError

DRIVER = "MUJOCO_GL"  # environment variable with MuJoCo's graphics driver, read when it is imported
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def load_mujoco(*, pictures: bool = False) -> ModuleType:
    """Import the engine; with pictures, it will draw: without a display and without another choice, through EGL.

    Raises:
        MissingExtraError: it is not installed.
        OutputError: it does not load with the graphics driver ``MUJOCO_GL``.
    """
    if pictures and sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAYS):
        os.environ.setdefault(DRIVER, "egl")
    try:
        import mujoco as module
    except ImportError as error:
        raise MissingExtraError(
            f"simulation needs MuJoCo ({error}); install it with pip install 'nlp-gait[sim]'"
        ) from error
    except Exception as error:  # any error of a driver that is not installed
        raise OutputError(
            f"MuJoCo does not load with {DRIVER}={os.environ.get(DRIVER)!r} ({error}); unset it or name another driver"
        ) from error
    # Otherwise warnings go to a log file in the user's folder; a divergence shows as a fall.
    module.set_mju_user_warning(lambda message: None)
    return module
