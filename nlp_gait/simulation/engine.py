"""The engine: import of MuJoCo, indices in its arrays, and sensors of the torso with noise and delay."""

import math
import os
import sys
from collections import deque
from dataclasses import dataclass, fields, replace
from types import ModuleType
from typing import Any, NamedTuple, Self

import numpy as np

from nlp_gait.errors import InputError, MissingExtraError, OutputError
from nlp_gait.formulation import Array
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
            for part in (plan.robot.feet, plan.robot.toes):
                if side in part:
                    self.foot_of_geometry[model.geom_bodyid == model.body(part[side].link).id] = i


NOISES = ("position_noise_m", "velocity_noise_m_s", "tilt_noise_rad", "rate_noise_rad_s")

# Between two commands of a controller: NAO's has cycles of 10 ms, the engine steps of 0.5 ms.
SHORTEST_PERIOD_S, LONGEST_PERIOD_S = 1e-4, 1.0


def check_period(owner: str, period_s: float) -> None:
    """Check the time between two commands of a controller; raises InputError."""
    if not SHORTEST_PERIOD_S <= period_s <= LONGEST_PERIOD_S:
        raise InputError(
            f"period_s of a {owner} must be from {SHORTEST_PERIOD_S:g} to {LONGEST_PERIOD_S:g} s, got {period_s!r}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Times and noise of a controller's measurements.

    Source:
        Noise: joint sensors that round to 0.1 degrees (data sheet), three in a row, over 0.3 m of leg and over 30 ms; the
        gyrometer's 10 mrad/s are an assumption.
    """

    period_s: float = 0.01  # between two measurements, each of which acts until the next
    delay_s: float = 0.01  # from a measurement to the drives: one more cycle of the controller
    position_noise_m: float = 2.5e-4  # standard deviation of the measured place of the torso over the feet
    velocity_noise_m_s: float = 0.012  # of its velocity
    tilt_noise_rad: float = 1e-3  # of its attitude about each axis
    rate_noise_rad_s: float = 0.01  # of its rates
    seed: int = 0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            least = "> 0" if each.name == "period_s" else ">= 0"
            if isinstance(value, bool | str):
                continue
            if not (math.isfinite(value) and (value > 0.0 or (value == 0.0 and least == ">= 0"))):
                raise InputError(f"{each.name} of a feedback must be {least}, got {value!r}")
        check_period("feedback", self.period_s)

    def with_noise(self, factor: float) -> Self:
        """Return the same with the noise times a factor."""
        return replace(self, **{name: factor * getattr(self, name) for name in NOISES})


class SensorValues(NamedTuple):
    """Sensor values of the torso at one instant."""

    step: int  # number of the engine's step
    places: Array  # (2, 3) of its origin from the left and the right sole [m]
    velocity: Array  # (3,) [m/s]
    attitude: Array  # (3, 3) rotation from its axes to those of the floor
    tilt_error: Array  # (3,) error of the attitude, about the axes of the floor [rad]
    rate: Array  # (3,) about the axes of the floor [rad/s]


class TorsoSensor:
    """Sensors of one simulation."""

    def __init__(self, sensing: Sensing, plan: Plan, model: Any) -> None:
        self._sensing, self._model, self._engine = sensing, model, load_mujoco()
        self._at = Addresses(model, plan)
        self.step_s = float(model.opt.timestep)
        self._every = max(1, round(sensing.period_s / self.step_s))
        self._late = round(sensing.delay_s / self.step_s)
        self._noise = np.random.default_rng(sensing.seed)
        self._waiting: deque[SensorValues] = deque()
        self._steps = 0

    def read(self, data: Any) -> SensorValues | None:
        """Return values that arrive at this step of the engine, None if there are none; call it once in each step."""
        if self._steps % self._every == 0:
            self._waiting.append(self._measure(data))
        arrived = bool(self._waiting) and self._waiting[0].step + self._late <= self._steps
        self._steps += 1
        return self._waiting.popleft() if arrived else None

    def _measure(self, data: Any) -> SensorValues:
        settings, noise = self._sensing, self._noise.standard_normal((4, 3))
        turning = np.zeros(6)  # rates, then velocity, along the floor's axes
        body = self._engine.mjtObj.mjOBJ_XBODY
        self._engine.mj_objectVelocity(self._model, data, body, self._at.torso, turning, 0)
        return SensorValues(
            step=self._steps,
            places=data.xpos[self._at.torso] - data.site_xpos[self._at.soles] + settings.position_noise_m * noise[0],
            velocity=turning[3:] + settings.velocity_noise_m_s * noise[1],
            attitude=data.xmat[self._at.torso].reshape(3, 3).copy(),
            tilt_error=settings.tilt_noise_rad * noise[2],
            rate=turning[:3] + settings.rate_noise_rad_s * noise[3],
        )
