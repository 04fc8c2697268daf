"""Whole-body control: joint torques whose accelerations and contact forces are nearest to what balance asks for."""

import itertools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.errors import MissingExtraError
from nlp_gait.formulation import Array
from nlp_gait.simulation.balance.reference import WalkReference
from nlp_gait.simulation.engine import load_mujoco

UNBOUNDED = 1e9
REGULARISATION = 1e-8
EQUAL, INEQUALITY = 5, 0  # DAQP's kinds of rows
WRENCH = 6  # force and moment on a sole, in its axes


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Weights of squared accelerations, angular ones times the height of the centre of mass."""

    mass: float = 40.0  # horizontally
    height: float = 10.0
    torso: float = 2.0
    turn: float = 0.02  # of the torso about the vertical: it turns before a sole does, whose friction is small
    swing: float = 1.0
    swing_attitude: float = 0.3
    stance: float = 100.0
    joints: float = 1e-3
    loads: float = 0.01  # of forces over the mass


@dataclass(frozen=True, slots=True, kw_only=True)
class Targets:
    """Accelerations and loads at one instant, in the floor's axes."""

    mass: Array  #: (3,) of the centre of mass [m/s^2]
    torso: Array  #: (3,) angular [rad/s^2]
    feet: Array  #: (2, 6) of the soles, linear [m/s^2] and angular [rad/s^2]
    stands: tuple[bool, bool]  #: whether a foot is on the ground
    rolls: tuple[bool, bool]  #: with the tip of its toe only
    joints: Array  #: (J,) [rad/s^2]
    load_left: float  #: planned share of the weight on the left foot
    most_load: tuple[float, float]  #: largest normal forces [N]


class Torques(NamedTuple):
    """Solution of one instant."""

    torques: Array  # (J,) of the joints [Nm]
    accelerations: Array  # (J,) of the joints [rad/s^2]
    wrenches: Array  # (12,) force [N] and moment [Nm] on each sole, in its axes


class WholeBodyQP:
    """Quadratic program of one robot in accelerations and contact wrenches; torque limits are hard.

    Minimises the weighted squares of the errors of mass, torso, feet, joints and loads subject to the equations of motion of the
    root, friction at the corners of the soles, load limits, and torque limits. Joints that the plan never moves follow their own
    target and are no variables.

    Source:
        Kuindersma et al. (2016); solved by DAQP, Arnstroem, Bemporad, Axehill (2022).
    """

    def __init__(
        self, reference: WalkReference, model: Any, addresses: Any, torque_limits: Array, friction: float
    ) -> None:
        try:
            import daqp
        except ImportError as error:
            raise MissingExtraError(
                f"balance feedback needs DAQP ({error}); install it with pip install 'nlp-gait[sim]'"
            ) from error
        self._solver, self._engine, self.weights = daqp, load_mujoco(), Weights()
        self._model, self._limits, self._at = model, torque_limits, addresses
        self._height, self._gravity, self._mass = reference.height, model.opt.gravity.copy(), reference.mass
        angles = reference.plan.signals.arrays["q"]
        held = np.ptp(angles, axis=0) < 1e-6
        self._free = np.concatenate([addresses.root, addresses.rates[~held]])
        self._free_joints = np.flatnonzero(~held)
        self._load_tasks = np.diag([1.0, 1.0, 1.0, *[2.0 / self._height] * 3] * 2) / self._mass
        self.cone = _make_cone(reference.soles, friction)
        self.failures = 0

    def solve(self, data: Any, targets: Targets) -> Torques | None:
        """Return the torques of least cost, None where DAQP finds no solution.

        ``data`` has the measured positions and velocities, with positions and velocities computed.
        """
        engine, model, free, count = self._engine, self._model, self._free, len(self._free)
        joints, root = self._at.rates, len(self._at.root)
        inertia, acceleration = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
        engine.mj_fullM(model, data, inertia)
        acceleration[joints] = targets.joints
        acceleration[free] = 0.0
        jacobians, drift = self._differentiate_soles(data, targets.rolls)
        axes = data.site_xmat[self._at.soles].reshape(2, 3, 3)
        axes[list(targets.rolls)] = np.eye(3)
        contact = np.hstack([part.T @ axes[i] for i in (0, 1) for part in (jacobians[i, :3], jacobians[i, 3:])])
        known = drift + jacobians @ acceleration
        tasks, goals, weights = self._collect_tasks(data, targets, jacobians, known, axes)
        weighted = tasks * weights[:, None]
        hessian, linear = weighted.T @ tasks, -(goals @ weighted)
        hessian[np.diag_indices(len(hessian))] += REGULARISATION
        # Torques of all coordinates: motion @ x + rest; those of the root are zero.
        motion = np.hstack([inertia[:, free], -contact])
        bias = data.qfrc_bias - data.qfrc_passive + inertia @ acceleration
        rows = np.vstack([motion[:root], motion[joints], np.hstack([np.zeros((len(self.cone), count)), self.cone])])
        low = np.concatenate([-bias[:root], -self._limits - bias[joints], np.zeros(len(self.cone))])
        high = np.concatenate([-bias[:root], self._limits - bias[joints], np.full(len(self.cone), UNBOUNDED)])
        least, most, kind = self._bound_wrenches(targets)
        low = np.concatenate([np.full(count, -UNBOUNDED), least, low])
        high = np.concatenate([np.full(count, UNBOUNDED), most, high])
        sense = np.zeros(len(low), dtype=np.int32)
        sense[count : count + 2 * WRENCH] = kind
        sense[count + 2 * WRENCH : count + 2 * WRENCH + root] = EQUAL
        x, _, flag, _ = self._solver.solve(hessian, linear, rows, high, low, sense)
        if flag <= 0:
            self.failures += 1
            return None
        acceleration[free] = x[:count]
        torques = np.clip((motion @ x + bias)[joints], -self._limits, self._limits)
        return Torques(torques, acceleration[joints], x[count:])

    def _differentiate_soles(self, data: Any, rolls: tuple[bool, bool]) -> tuple[Array, Array]:
        """Return the soles' Jacobians (2, 6, V), and their accelerations (2, 6) at constant velocities.

        Of a foot that rolls, the linear ones are those of the tip of its toe.
        """
        engine, model = self._engine, self._model
        jacobians, rates = np.zeros((2, 6, model.nv)), np.zeros((2, 6, model.nv))
        for i, sole in enumerate(self._at.soles):
            engine.mj_jacSite(model, data, jacobians[i, :3], jacobians[i, 3:], sole)
            engine.mj_jacDot(model, data, rates[i, :3], rates[i, 3:], data.site_xpos[sole], model.site_bodyid[sole])
            if rolls[i]:
                tip = self._at.tips[i]
                engine.mj_jacSite(model, data, jacobians[i, :3], None, tip)
                engine.mj_jacDot(model, data, rates[i, :3], None, data.site_xpos[tip], model.site_bodyid[tip])
        return jacobians, rates @ data.qvel

    def _collect_tasks(
        self, data: Any, targets: Targets, jacobians: Array, known: Array, axes: Array
    ) -> tuple[Array, Array, Array]:
        """Return matrix, goals and weights of all tasks: feet, mass, torso, joints, loads; ``known`` (2, 6) is not variable."""
        w, free, count, root = self.weights, self._free, len(self._free), len(self._at.root)
        moving = len(self._free_joints)
        ends = np.cumsum([0, 12, 3, 3, moving, 12]).tolist()
        feet, mass, torso, joints, loads = map(slice, ends[:-1], ends[1:])
        tasks, goals, weights = (np.zeros(shape) for shape in ((ends[-1], count + 12), ends[-1], ends[-1]))
        tasks[feet, :count], goals[feet] = jacobians[:, :, free].reshape(12, -1), (targets.feet - known).ravel()
        for i, (stands, rolls) in enumerate(zip(targets.stands, targets.rolls, strict=True)):
            weights[6 * i : 6 * i + 3] = w.stance if stands else w.swing
            weights[6 * i + 3 : 6 * i + 6] = w.stance if stands and not rolls else w.swing_attitude * self._height**2
        for i in (0, 1):  # contact forces alone move the mass
            tasks[mass, count + WRENCH * i : count + WRENCH * i + 3] = axes[i] / self._mass
        goals[mass], weights[mass] = targets.mass - self._gravity, (w.mass, w.mass, w.height)
        turning = np.zeros((3, self._model.nv))
        self._engine.mj_jacBody(self._model, data, None, turning, self._at.torso)
        tasks[torso, :root] = turning[:, self._at.root]
        goals[torso], weights[torso] = targets.torso, np.array([w.torso, w.torso, w.turn]) * self._height**2
        tasks[joints, root:count] = np.eye(moving)
        goals[joints], weights[joints] = targets.joints[self._free_joints], w.joints * self._height**2
        tasks[loads, count:] = self._load_tasks
        weight = -self._gravity[2]
        goals[loads.start + 2], goals[loads.start + 8] = targets.load_left * weight, (1.0 - targets.load_left) * weight
        weights[loads] = w.loads
        return tasks, goals, weights

    def _bound_wrenches(self, targets: Targets) -> tuple[Array, Array, Array]:
        """Return lower and upper bounds and kinds (12,) of the wrenches: zero for a foot in the air, no moments at a tip."""
        low, high, kind = np.zeros(12), np.zeros(12), np.full(12, float(EQUAL))
        for i, (stands, rolls) in enumerate(zip(targets.stands, targets.rolls, strict=True)):
            if stands:
                wrench = slice(WRENCH * i, WRENCH * i + (3 if rolls else WRENCH))
                low[wrench], high[wrench], kind[wrench] = -UNBOUNDED, UNBOUNDED, INEQUALITY
                high[WRENCH * i + 2] = targets.most_load[i]
        return low, high, kind


def _make_cone(soles: Array, friction: float) -> Array:
    """Return rows (32, 12) that are >= 0 for wrenches of forces at the corners of the soles, each within a friction pyramid.

    A sole bears less moment about its normal, the nearer its pressure is to an edge.

    Source:
        Caron, Pham, Nakamura (2015), the wrench cone of a rectangle.
    """
    mu, cones = friction / np.sqrt(2.0), list[Array]()
    for front, back, left, right in 0.95 * soles:
        x, y, ahead, aside = (front + back) / 2, (left + right) / 2, (front - back) / 2, (left - right) / 2
        fx, fy, fz, roll, pitch, yaw = np.eye(WRENCH)
        # Moments about the centre of the sole.
        roll, pitch, yaw = roll - aside * fz, pitch + ahead * fz, yaw - ahead * fy + aside * fx
        rows = [arm * fz + sign * part for part, arm in ((fx, mu), (fy, mu), (roll, y), (pitch, x)) for sign in (1, -1)]
        for turn, a, b in itertools.product((1, -1), repeat=3):
            rows.append(
                mu * (x + y) * fz - turn * yaw + a * (y * fx + turn * mu * roll) + b * (x * fy + turn * mu * pitch)
            )
        cones.append(np.array(rows))
    return np.block([[cones[0], np.zeros_like(cones[0])], [np.zeros_like(cones[1]), cones[1]]])
