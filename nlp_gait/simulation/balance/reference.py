"""A planned walk as balance feedback follows it: phases, divergent component of motion, loads, on one even grid of times."""

import copy
import itertools
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import Addresses, load_mujoco, place_root
from nlp_gait.simulation.plan import SIDES, Plan

STEP_S = 0.002  # of the grid
SMOOTHING = 11  # samples over which the accelerations of the centre of mass are averaged

# Steps from rest: times of the first double support, a swing, and the double supports after swings [1 / w], height of the
# swinging foot [h], and share of the swing after which it is down.
PUSH_OFF, SWING, SUPPORT, LAST_SUPPORT = 0.4, 1.4, 0.5, 2.0
LIFT, DOWN = 0.06, 0.9
TOGETHER_M = 1e-3  # feet of a planar robot nearer than this share the load equally


@dataclass(frozen=True, slots=True)
class SupportPhase:
    """Double support, or single support with the number of the swinging foot in ``SIDES``."""

    start_s: float
    end_s: float
    swing: int | None = None


class WalkReference:
    """Reference of one walk; places are in the floor's axes [m], and ``sample`` interpolates linearly.

    Names are ``q``, ``qd``, ``zmp`` (2,), ``com``, ``com_rate``, ``com_acceleration`` (3,), ``dcm`` (2,), ``lever`` (2,) what the
    pendulum leaves of the horizontal acceleration, ``load_left`` (1,), ``carry`` (1,) effect of the next foothold on the
    divergent component, ``feet``, ``feet_rate`` (6,), ``yaw``, ``yaw_rate``, ``pitch``, ``pitch_rate`` (2,) of the soles,
    ``rolls`` (2,) whether a foot is on the tip of its toe, ``attitude`` (4,) of the torso.
    """

    def __init__(self, plan: Plan, model: Any, torque_limits: Array) -> None:
        self.plan, self.duration_s = plan, plan.duration_s
        self.mass = float(model.body_subtreemass[0])
        count = int(np.ceil(plan.duration_s / STEP_S)) + 2
        times = np.linspace(0.0, count * STEP_S, count, endpoint=False)
        com, tips, pitch = _follow_joints(plan, model, times)
        self.height = float(com[0, 2] - min(plan.at(f"{side}_foot", times[:1])[0, 2] for side in SIDES))
        self.rate = float(np.sqrt(plan.gravity / self.height))  # of the pendulum [1/s]
        self.soles = np.array([[f.front_m, f.back_m, f.left_m, f.right_m] for f in (plan.robot.feet[s] for s in SIDES)])
        self.zmp_reach = np.minimum(self.soles, _find_ankle_reach(plan, model, torque_limits))
        stands, bears = (
            np.stack([on(side, times) for side in SIDES], axis=1) > 0.5 for on in (plan.stands, plan.bears)
        )
        self.phases, rolls = _split(times, bears), bears & ~stands
        left, right = (plan.at(f"{side}_foot", times) for side in SIDES)
        places = np.where(rolls.T[:, :, None], tips, np.stack([left, right])[:, :, :2])
        feet = np.hstack([left, right])
        yaw = np.stack([np.arctan2(*plan.direction(i, times).T[::-1]) for i in range(2)], axis=1)
        velocity = np.gradient(com, STEP_S, axis=0)
        velocity[[0, -1]] = 0.0
        kernel, pad = np.ones(SMOOTHING) / SMOOTHING, SMOOTHING // 2
        acceleration = np.gradient(velocity, STEP_S, axis=0)
        acceleration = np.stack(
            [np.convolve(np.pad(a, pad, mode="edge"), kernel, "valid") for a in acceleration.T], axis=1
        )
        zmp, load = plan.at("zmp", times), compute_left_load(plan, times, places)
        arrays = {
            "q": plan.at("q", times),
            "qd": plan.rate("q", times),
            "zmp": zmp,
            "com": com,
            "com_rate": velocity,
            "com_acceleration": acceleration,
            "dcm": com[:, :2] + velocity[:, :2] / self.rate,
            "lever": acceleration[:, :2] - self.rate**2 * (com[:, :2] - zmp),
            "load_left": load[:, None],
            "carry": _integrate_carry(self.phases, load, self.rate)[:, None],
            "feet": feet,
            "feet_rate": np.gradient(feet, STEP_S, axis=0),
            "yaw": yaw,
            "yaw_rate": np.gradient(np.unwrap(yaw, axis=0), STEP_S, axis=0),
            "pitch": pitch,
            "pitch_rate": np.gradient(pitch, STEP_S, axis=0),
            "rolls": rolls.astype(float),
            "attitude": plan.attitude(times),
        }
        self._store(arrays)

    def check_support(self) -> None:
        """Raise InputError for a plan whose ZMP is on a toe in single support: balance does not control the toe's torque."""
        for phase in self.phases:
            if self.plan.robot.toes and phase.swing is not None:
                times = np.arange(phase.start_s, phase.end_s, STEP_S)
                zmp, foot = (
                    self._rows[np.round(times / STEP_S).astype(int), self._columns[n]] for n in ("zmp", "feet")
                )
                on_toe = (zmp[:, 0] - foot[:, 3 * (1 - phase.swing)]).max() - self.soles[1 - phase.swing, 0]
                if on_toe > 0.0:
                    raise InputError(
                        "balance feedback needs the ZMP on the sole in single support; this plan's is "
                        f"{1e3 * on_toe:.0f} mm ahead of it, on the toe; simulate it without feedback"
                    )

    def _store(self, arrays: dict[str, Array]) -> None:
        self._rows, self._columns, end = np.hstack(list(arrays.values())), dict[str, slice](), 0
        for name, array in arrays.items():
            self._columns[name] = slice(end, end + array.shape[1])
            end += array.shape[1]
        self._last: tuple[float, Array] = (-1.0, self._rows[0])

    def make_steps_from_rest(self, first: int) -> Self:
        """Return a reference that begins and ends at the end of this one: a step in place of one foot, then of the other.

        The centre of mass moves as a pendulum at constant height. Its ZMP is under the foot that will swing first, which pushes
        it to the other one, then under the standing foot, and at last where it was.
        """
        other, swings = copy.copy(self), (None, first, None, 1 - first, None)
        ends = np.round(np.cumsum([PUSH_OFF, SWING, SUPPORT, SWING, LAST_SUPPORT]) / self.rate / STEP_S) * STEP_S
        other.phases = [
            SupportPhase(*times, swing) for times, swing in zip(itertools.pairwise([0.0, *ends]), swings, strict=True)
        ]
        other.duration_s = float(ends[-1])
        times = np.arange(round(other.duration_s / STEP_S) + 2) * STEP_S
        arrays = {name: np.tile(self._rows[-1, columns], (len(times), 1)) for name, columns in self._columns.items()}
        for name in ("qd", "com_rate", "com_acceleration", "lever", "yaw_rate"):
            arrays[name][:] = 0.0
        rest, left = arrays["load_left"][-1, 0], float(first == 0)
        knots = [0.0, ends[0], ends[0] + STEP_S, *ends[1:]]
        load = np.interp(times, knots, [left, left, 1.0 - left, 1.0 - left, left, left, rest])
        feet = arrays["feet"].reshape(-1, 2, 3)
        zmp = arrays["zmp"] + (load - rest)[:, None] * (feet[:, 0, :2] - feet[:, 1, :2])
        dcm, decay = arrays["zmp"].copy(), np.exp(-self.rate * STEP_S)
        for k in range(len(times) - 2, -1, -1):
            dcm[k] = zmp[k] + (dcm[k + 1] - zmp[k]) * decay
        for phase in (other.phases[1], other.phases[3]):
            done = np.clip((times - phase.start_s) / (DOWN * (phase.end_s - phase.start_s)), 0.0, 1.0)
            feet[:, phase.swing, 2] += LIFT * self.height * np.sin(np.pi * done) ** 2
        arrays["feet_rate"] = np.gradient(arrays["feet"], STEP_S, axis=0)
        arrays |= {"zmp": zmp, "dcm": dcm, "load_left": load[:, None]}
        arrays["carry"] = _integrate_carry(other.phases, load, self.rate)[:, None]
        other._store(arrays)
        return other

    def sample(self, name: str, time_s: float) -> Array:
        """Return a quantity at a time of the plan."""
        if time_s != self._last[0]:
            place = min(max(time_s / STEP_S, 0.0), len(self._rows) - 1.0)
            k = min(int(place), len(self._rows) - 2)
            self._last = time_s, self._rows[k] + (place - k) * (self._rows[k + 1] - self._rows[k])
        return np.asarray(self._last[1][self._columns[name]])


def _follow_joints(plan: Plan, model: Any, times: Array) -> tuple[Array, Array, Array]:
    """Return the planned centre of mass (T, 3), tips of the toes (2, T, 2) [m], and pitch of the soles (T, 2) [rad].

    Soles without toes stay level.
    """
    engine, addresses = load_mujoco(), Addresses(model, plan)
    data, com, tips, pitch = engine.MjData(model), *(np.zeros((len(times), *shape)) for shape in ((3,), (2, 2), (2,)))
    for k, (place, attitude, q) in enumerate(
        zip(plan.at("hip", times), plan.attitude(times), plan.at("q", times), strict=True)
    ):
        place_root(data.qpos, plan, place, attitude)
        data.qpos[addresses.angles] = q
        engine.mj_kinematics(model, data)
        engine.mj_comPos(model, data)
        com[k], tips[k] = data.subtree_com[0], data.site_xpos[addresses.tips, :2]
        if plan.robot.toes:
            pitch[k] = np.arctan2(-data.site_xmat[addresses.soles, 6], data.site_xmat[addresses.soles, 8])
    return com, tips.swapaxes(0, 1), pitch


def _find_ankle_reach(plan: Plan, model: Any, torque_limits: Array) -> Array:
    """Return how far (2 feet; front, back, left, right) the ankles' torques hold the weight from the ankle [m].

    The ankle has the joints of the foot and, where the two joints are no farther apart than the ankle is high, of its parent.
    """
    engine, addresses, reach = load_mujoco(), Addresses(model, plan), np.zeros((2, 4))
    data, limit_of = engine.MjData(model), dict(zip(addresses.rates.tolist(), torque_limits, strict=True))
    engine.mj_kinematics(model, data)
    for i, side in enumerate(SIDES):
        foot = plan.robot.feet[side]
        body = model.body(foot.link).id
        joints = [model.body_jntadr[body]]
        if np.linalg.norm(model.body_pos[body]) <= foot.ankle_height_m:
            joints.append(model.body_jntadr[model.body_parentid[body]])
        limits = np.array([limit_of[int(model.jnt_dofadr[joint])] for joint in joints])
        roll, pitch, _ = np.abs(data.xaxis[joints]).T @ limits / (model.body_subtreemass[0] * plan.gravity)
        reach[i] = pitch, pitch, roll, roll
    return reach


def compute_left_load(plan: Plan, times: Array, places: Array) -> Array:
    """Return the planned share of the load on the left foot (T,): the ZMP divides it between two that bear, at (2, T, 2) [m]."""
    (left, right), (on_left, on_right) = places, (plan.bears(side, times) for side in SIDES)
    apart = left - right
    ahead, squared = ((plan.at("zmp", times) - right) * apart).sum(axis=1), (apart**2).sum(axis=1)
    between = np.divide(ahead, squared, out=np.full(len(times), 0.5), where=squared > TOGETHER_M**2)
    return np.where(on_right == 0.0, 1.0, np.where(on_left == 0.0, 0.0, np.clip(between, 0.0, 1.0)))


def _split(times: Array, bears: Any) -> list[SupportPhase]:
    """Return the phases of a walk from the times (T,) at which the feet (T, 2) bear."""
    swing = np.where(bears.all(axis=1), -1, np.where(bears[:, 0], 1, 0))
    cuts = [0, *(np.flatnonzero(np.diff(swing)) + 1).tolist(), len(swing) - 1]
    return [
        SupportPhase(float(times[a]), float(times[b]), None if swing[a] < 0 else int(swing[a]))
        for a, b in zip(cuts[:-1], cuts[1:], strict=True)
    ]


def _integrate_carry(phases: list[SupportPhase], load_left: Array, rate: float) -> Array:
    """Return the share w (T,) of the landing foot's offset in the offset of the divergent component: w' = rate (w - its load).

    It is integrated backward: from 1 at the end of each double support, from the load at the end of the walk, where the robot
    rests; in the swing before, the foot bears no load. Before the first step it is the load of the left foot.
    """
    carry, decay = load_left.copy(), np.exp(-rate * STEP_S)
    for before, phase in zip([None, *phases[:-1]][::-1], phases[::-1], strict=True):
        a, b = round(phase.start_s / STEP_S), round(phase.end_s / STEP_S)
        load = np.zeros(len(load_left))
        if phase.swing is None:
            if before is None:
                break
            load = load_left if before.swing == 0 else 1.0 - load_left
            value = 1.0
            if phase is phases[-1]:
                value = load[-1]
                carry[b:] = value
        elif phase is phases[-1]:
            value = 1.0
            carry[b:] = value
        for k in range(b - 1, a - 1, -1):
            value = carry[k] = load[k] + (value - load[k]) * decay
    return carry
