"""The engine: import of MuJoCo, and indices in its arrays."""

import os
import sys
from types import ModuleType
from typing import Any

import numpy as np

from nlp_gait.errors import InputError, MissingExtraError, OutputError
from nlp_gait.simulation.plan import SIDES, Plan

DRIVER = "MUJOCO_GL"  # environment variable with MuJoCo's graphics driver, read when it is imported
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def load_mujoco(*, pictures: bool = False) -> ModuleType:
    """Import the engine; with pictures, it will draw: without a display and without another choice, through EGL.

    Raises MissingExtraError, or OutputError if it does not load with the graphics driver ``MUJOCO_GL``.
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


class Addresses:
    """Indices of the joints, actuators, bodies and sites in the engine's arrays."""

    def __init__(self, model: Any, plan: Plan) -> None:
        joints = [model.joint(name) for name in plan.joints]
        self.angles = np.array([joint.qposadr[0] for joint in joints])
        self.rates = np.array([joint.dofadr[0] for joint in joints])
        self.actuators = np.array([model.actuator(name).id for name in plan.joints])
        self.torso = model.body(plan.robot.root).id
        self.soles = np.array([model.site(side).id for side in SIDES])
        self.foot_of_geometry = np.full(model.ngeom, -1)
        for i, side in enumerate(SIDES):
            for contacts in (plan.robot.feet, plan.robot.toes):
                if side in contacts:
                    self.foot_of_geometry[model.geom_bodyid == model.body(contacts[side].link).id] = i


# Between two commands of a controller: NAO's has cycles of 10 ms, the engine steps of 0.5 ms.
SHORTEST_PERIOD_S, LONGEST_PERIOD_S = 1e-4, 1.0


def check_period(owner: str, period_s: float) -> None:
    """Check the time between two commands of a controller; raises InputError."""
    if not SHORTEST_PERIOD_S <= period_s <= LONGEST_PERIOD_S:
        raise InputError(
            f"period_s of a {owner} must be from {SHORTEST_PERIOD_S:g} to {LONGEST_PERIOD_S:g} s, got {period_s!r}"
        )
