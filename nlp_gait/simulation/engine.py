"""The engine: import of MuJoCo, and indices in its arrays."""

import os
from types import ModuleType
from typing import Any

import numpy as np

from nlp_gait.errors import InputError, MissingExtraError, OutputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.plan import SIDES, Plan

DRIVER = "MUJOCO_GL"  # environment variable with MuJoCo's graphics driver, read when it is imported
LEAST_LOAD = 1.0  # [N]; below this total load there is no centre of pressure


def load_mujoco() -> ModuleType:
    """Import the engine; raises MissingExtraError, or OutputError if it does not load with the graphics driver ``MUJOCO_GL``."""
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
        self.root = np.arange(len(plan.root_axes))  # rates of the root are the engine's first
        self.torso = model.body(plan.robot.root).id
        self.soles = np.array([model.site(side).id for side in SIDES])
        # Where a foot that rolls touches the ground
        self.tips = np.array([model.site(f"{side} tip").id for side in SIDES]) if plan.robot.toes else self.soles
        self.foot_of_body = np.full(model.nbody, -1)
        for i, side in enumerate(SIDES):
            for contacts in (plan.robot.feet, plan.robot.toes):
                if side in contacts:
                    self.foot_of_body[model.body(contacts[side].link).id] = i


def place_root(positions: Array, plan: Plan, place: Array, attitude: Array) -> None:
    """Write the root's place (3,) [m] and attitude (4,) into the engine's coordinates, which begin with them."""
    if plan.planar:
        positions[:3] = place[0], place[2], 2.0 * np.arctan2(attitude[2], attitude[0])
    else:
        positions[:3], positions[3:7] = place, attitude


def measure_loads(data: Any, addresses: Addresses) -> Array:
    """Return the normal forces on both feet (2,), from all contacts with the ground [N]."""
    contact = data.contact
    active = contact.efc_address >= 0
    forces = data.efc_force[contact.efc_address[active]]  # the first row of an elliptic contact is along its normal
    # The ground's geometries come first
    feet = addresses.foot_of_body[data.model.geom_bodyid[contact.geom[active].max(axis=1)]]
    return np.array([forces[feet == i].sum() for i in range(len(SIDES))])


# Between two commands of a controller: NAO's has cycles of 10 ms, the engine steps of 0.5 ms.
PERIODS_S = (1e-4, 1.0)


def check_range(owner: str, name: str, value: float, least: float, most: float) -> None:
    """Check a setting; raises InputError."""
    if not least <= value <= most:  # NaN fails too
        raise InputError(f"{name} of a {owner} must be from {least:g} to {most:g}, got {value!r}")
