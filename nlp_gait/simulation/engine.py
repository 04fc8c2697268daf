"""MuJoCo, or one sentence that says how to get it."""

from __future__ import annotations

import os
import sys
from types import ModuleType

from nlp_gait.errors import MissingExtraError, OutputError

DRIVER = "MUJOCO_GL"  # environment variable by which MuJoCo chooses how to draw, read when it is imported
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def mujoco(*, pictures: bool = False) -> ModuleType:
    """The engine's module.

    Args:
        pictures: they will be drawn. Where there is no display, and nothing else was asked for, that goes through EGL.

    Raises:
        MissingExtraError: it is not installed.
        OutputError: it does not load with the graphics driver that ``MUJOCO_GL`` names.
    """
    if pictures and sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAYS):
        os.environ.setdefault(DRIVER, "egl")
    try:
        import mujoco as module
    except ImportError as error:
        raise MissingExtraError(
            f"simulation needs MuJoCo ({error}); install it with pip install 'nlp-gait[sim]'"
        ) from error
    except Exception as error:  # whatever a graphics driver raises that is named but not installed
        raise OutputError(
            f"MuJoCo does not load with {DRIVER}={os.environ.get(DRIVER)!r} ({error}); unset it or name another driver"
        ) from error
    module.set_mju_user_warning(_ignore)
    return module


def _ignore(message: str) -> None:
    """Take the engine's warnings, which would else go to a log file in the user's folder; a divergence shows as a fall."""
