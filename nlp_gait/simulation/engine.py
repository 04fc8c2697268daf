"""MuJoCo, or one sentence that says how to get it."""

from __future__ import annotations

from types import ModuleType

from nlp_gait.errors import MissingExtraError


def mujoco() -> ModuleType:
    """The engine's module.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import mujoco as module
    except ImportError as error:
        raise MissingExtraError(
            f"simulation needs MuJoCo ({error}); install it with pip install 'nlp-gait[sim]'"
        ) from error
    return module
