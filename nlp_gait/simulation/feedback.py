"""Balance feedback: a virtual spring between the torso and its planned place, with sensor noise and delay."""

import copy
import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import Addresses, check_period, load_mujoco
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.sampler import Sampler

TOGETHER_M = 1e-3  # feet of a planar robot nearer than this share the load equally


@dataclass(frozen=True, slots=True, kw_only=True)
class Feedback:
    """A spring and a damper between the torso and its planned place over the feet, and between both attitudes.

    Force and moment act on the ground through the legs that are planned to stand, each with its planned share of the load, and
    are added to the set-points as torque / stiffness. Gains are in units of a pendulum with the robot's mass m, the height h of
    its torso at the start and w^2 = g / h, so that all robots share them: for NAO the springs are 504 N/m and 31 Nm/rad.
    Horizontally they control the divergent component of motion x + v / w: gain k corresponds to a spring and a damper of k.

    Source:
        Virtual model control: Pratt, Chew, Torres, Dilworth, Pratt (2001). Gain k: Caron, Kheddar, Tempier (2019), whose
        controller of HRP-4 has 1 + 5 / w with w = 3.55 / s, and an integral, whose gain is
        an assumption. `python -m benchmarks.engine feedback` shows their effects.
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
    spring: float = 3.0  # towards the planned place [m w^2]
    damper: float = 1.7  # towards the planned velocity [m w]
    tilt_spring: float = 1.9  # towards the planned attitude [m g h]
    tilt_damper: float = 0.7  # against turning [m g h / w]
    growth_per_s: float = 2.0  # integral gain: share of force and moment by which they grow per second
    # of the integral, along each axis: of the force as a share of the weight, of the moment as that share of the weight
    # at the height of the torso; 0.05 compensates a slope of 3 degrees
    growth_limit: float = 0.05

    def __post_init__(self) -> None:
        for setting in fields(self):
            value = getattr(self, setting.name)
            if not 0.0 <= value < math.inf:
                raise InputError(f"{setting.name} of a feedback must be >= 0, got {value!r}")
        check_period("feedback", self.period_s)


class SensorValues(NamedTuple):
    """Sensor values of the torso at one instant."""

    time_s: float  # of the simulation
    places: Array  # (2, 3) of its origin from the left and the right sole [m]
    velocity: Array  # (3,) [m/s]
    attitude: Array  # (3, 3) rotation from its axes to those of the floor
    tilt_error: Array  # (3,) error of the attitude, about the axes of the floor [rad]
    rate: Array  # (3,) about the axes of the floor [rad/s]


class BalanceController:
    """Controller of one simulation; ``stiffness`` (J,) is that of the drives as their driver assumes it [Nm/rad]."""

    def __init__(self, feedback: Feedback, plan: Plan, stiffness: Array, model: Any) -> None:
        self._feedback, self._plan, self._stiffness, self._model = feedback, plan, stiffness, model
        self._engine = load_mujoco()
        self._posture = self._engine.MjData(model)  # planned angles under an upright torso at the origin
        self._at = Addresses(model, plan)
        self._sampler = Sampler[SensorValues](
            feedback.period_s, feedback.delay_s, feedback.seed, float(model.opt.timestep)
        )
        self._shift = np.zeros(len(plan.joints))
        self._integral = np.zeros(6)  # force [N] and moment [Nm]
        mass, height = plan.robot.mass_kg, float(plan.at("hip", np.zeros(1))[0, 2])
        weight, rate = mass * plan.gravity, math.sqrt(plan.gravity / height)
        self._spring, self._damper = feedback.spring * mass * rate**2, feedback.damper * mass * rate
        self._tilt_spring = feedback.tilt_spring * weight * height
        self._tilt_damper = feedback.tilt_damper * weight * height / rate
        self._most = feedback.growth_limit * weight * np.repeat([1.0, height], 3)

    def fork(self) -> Self:
        """Return a copy for a simulation that begins in the middle of this one."""
        other = copy.copy(self)
        other._sampler = self._sampler.fork()
        return other

    def find_plan_time(self, time_s: float) -> float:
        """Return the time of the plan at a time of the simulation: the same [s]."""
        return time_s

    def correct(self, command: Array, data: Any) -> Array:
        """Return the set-points (J,) [rad] instead of the planned ones; call it once in each step of the engine."""
        measured = self._sampler.sample(lambda: self._measure(data))
        if measured is not None:
            self._shift = self._torques(measured) / self._stiffness
        return command + self._shift

    def _measure(self, data: Any) -> SensorValues:
        settings, noise = self._feedback, self._sampler.random.standard_normal((4, 3))
        turning = np.zeros(6)  # rates, then velocity, along the floor's axes
        body = self._engine.mjtObj.mjOBJ_XBODY
        self._engine.mj_objectVelocity(self._model, data, body, self._at.torso, turning, 0)
        return SensorValues(
            time_s=self._sampler.time_s,
            places=data.xpos[self._at.torso] - data.site_xpos[self._at.soles] + settings.position_noise_m * noise[0],
            velocity=turning[3:] + settings.velocity_noise_m_s * noise[1],
            attitude=data.xmat[self._at.torso].reshape(3, 3).copy(),
            tilt_error=settings.tilt_noise_rad * noise[2],
            rate=turning[:3] + settings.rate_noise_rad_s * noise[3],
        )

    def _torques(self, measured: SensorValues) -> Array:
        """Return the joint torques (J,) of the springs' force and moment [Nm]."""
        settings, plan, time = self._feedback, self._plan, np.array([measured.time_s])
        share = compute_load_shares(plan, time)[0]
        planned, soles = self._planned_posture(time, int(share[1] > share[0]))
        feet = np.stack([plan.at(f"{side}_foot", time)[0] for side in SIDES])
        place = plan.at("hip", time)[0] - share @ feet
        force = self._spring * (place - share @ measured.places)
        force += self._damper * (plan.rate("hip", time)[0] - measured.velocity)
        tilt = to_rotation_vector(planned @ measured.attitude.T) - measured.tilt_error
        moment = self._tilt_spring * tilt
        moment -= self._tilt_damper * measured.rate
        wrench = np.concatenate([force, moment])
        integral = self._integral + settings.growth_per_s * settings.period_s * wrench
        self._integral = np.clip(integral, -self._most, self._most)
        wrench += self._integral
        force, moment = planned.T @ wrench[:3], planned.T @ wrench[3:]  # in the torso's planned axes
        torques = np.zeros(len(self._at.rates))
        moving, turning = np.zeros((3, self._model.nv)), np.zeros((3, self._model.nv))
        for load_share, sole, foot in zip(share, self._at.soles, soles, strict=True):
            if load_share > 0.0:  # with a fixed foot, the torso moves opposite to the foot under a fixed torso
                self._engine.mj_jacSite(self._model, self._posture, moving, turning, sole)
                at_foot = moment - np.cross(foot, force)
                torques -= load_share * (moving[:, self._at.rates].T @ force + turning[:, self._at.rates].T @ at_foot)
        return torques

    def _planned_posture(self, time: Array, standing: int) -> tuple[Array, Array]:
        """Return the planned attitude (3, 3) of the torso, by the flat supporting sole, and the soles (2, 3) in its axes [m]."""
        posture = self._posture
        posture.qpos[:] = self._model.qpos0
        posture.qpos[self._at.angles] = self._plan.at("q", time)[0]
        self._engine.mj_kinematics(self._model, posture)
        self._engine.mj_comPos(self._model, posture)
        attitude = posture.site_xmat[self._at.soles[standing]].reshape(3, 3).T
        (x, y, z), (cos, sin) = attitude, self._plan.direction(standing, time)[0]
        attitude = np.stack([cos * x - sin * y, sin * x + cos * y, z])
        return attitude, posture.site_xpos[self._at.soles] - posture.xpos[self._at.torso]


def compute_load_shares(plan: Plan, times: Array, places: Array | None = None) -> Array:
    """Return the planned shares of the load on the left and right foot (T, 2): the ZMP between two that bear divides it.

    They bear at the soles, or at places (2, T, 2) [m].
    """
    left, right = (plan.at(f"{side}_foot", times)[:, :2] for side in SIDES) if places is None else places
    on_left, on_right = (plan.bears(side, times) for side in SIDES)
    apart = left - right
    ahead, squared = ((plan.at("zmp", times) - right) * apart).sum(axis=1), (apart**2).sum(axis=1)
    between = np.divide(ahead, squared, out=np.full(len(times), 0.5), where=squared > TOGETHER_M**2)
    share = np.where(on_right == 0.0, 1.0, np.where(on_left == 0.0, 0.0, np.clip(between, 0.0, 1.0)))
    return np.stack([share, 1.0 - share], axis=1)


def to_rotation_vector(turn: Array) -> Array:
    """Return axis times angle (3,) of a small rotation matrix (3, 3), to first order [rad]."""
    return np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
