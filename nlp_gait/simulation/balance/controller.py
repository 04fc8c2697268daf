"""Balance of planned walks: ZMP, footholds and times of steps by the divergent component of motion, whole-body torques."""

import copy
import math
from collections import deque
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np

from nlp_gait.formulation import Array
from nlp_gait.simulation.balance.footholds import Step, StepLimits, choose_step, clip_to_soles
from nlp_gait.simulation.balance.reference import SupportPhase, WalkReference
from nlp_gait.simulation.balance.whole_body import Targets, WholeBodyQP
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import PERIODS_S, Addresses, check_range, load_mujoco, measure_loads
from nlp_gait.simulation.plan import Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Balance:
    """Settings for all robots: lengths in heights h of the centre of mass, times in sqrt(h / g) = 1 / w, loads in weights.

    Source:
        Gain: Caron, Kheddar, Tempier (2019). The others are choices; `python -m benchmarks.balance` shows what they reach.
    """

    period_s: float = 0.004  # between two measurements
    delay_s: float = 0.0  # from a measurement to the drives
    noise: float = 0.0  # factor of ``NOISE``
    seed: int = 0
    dcm_gain: float = 2.3  # of the ZMP by the error of the divergent component: 1 + k / w
    height_rate: float = 3.0  # natural frequencies [w], critically damped: of the height of the centre of mass,
    torso_rate: float = 4.0  # of the torso's attitude,
    lift: float = 0.3  # most upward acceleration of the centre of mass [g]
    swing_rate: float = 7.0  # of the swinging foot,
    joint_rate: float = 6.0  # of the joints
    friction: float = 0.5  # coefficient that contact forces may use
    edge: float = 0.9  # share of the sole that the ZMP may use
    reserve: float = 0.7  # share of the ankles' range that the choice of a foothold counts on
    fastest: float = 1.3  # least time of a whole swing [1 / w]
    slowest: float = 1.3  # longest time of a swing, relative to the planned one
    hurry: float = 0.25  # change of a foothold [h] that costs as much as a change of its time by 1 / w
    reach: float = 0.6  # farthest foothold from the standing foot, forward and sideways [h]
    gap: float = 0.1  # between soles that pass each other [widths of the sole]
    load_rate: float = 6.0  # of a foot's load after touch-down and before lift-off [weight w]
    # A robot at rest steps where the divergent component is outside the soles by more than this, and the foothold leaves less
    step_beyond: float = 0.01  # distance [h]
    step_error: float = 0.03  # error [h]
    touch: float = 0.05  # load of a foot that has landed
    # Share of the planned angles that drives hold besides the torques of balance, for each m g h of the ankles' stiffness: a
    # stiff robot tips as a block; a compliant one would be turned over by its planned angles where a sole lies tilted
    hold: float = 1 / 60
    damp: float = 0.5  # share of the planned rates that drives hold

    def __post_init__(self) -> None:
        limits = {"period_s": PERIODS_S, "delay_s": (0.0, 1.0), "seed": (0, 2**53)}
        for setting in fields(self):
            least, most = limits.get(setting.name, (0.0, 1e3))
            check_range("balance feedback", setting.name, getattr(self, setting.name), least, most)

    def make_corrector(self, plan: Plan, drive: Drive, model: Any) -> "WholeBodyBalance":
        """Return the controller of one simulation, whose nominal model this is; raises InputError for an unsuitable plan."""
        return WholeBodyBalance(self, plan, drive, model)


class RobotState(NamedTuple):
    """Measured state of the whole robot at one instant."""

    positions: Array  # (Q,) the engine's coordinates
    velocities: Array  # (V,)
    loads: Array  # (2,) normal forces on the feet [N]


# Standard deviations of the root's place [m] and attitude [rad], of joints' angles [rad], and of the rates of these.
NOISE = (5e-4, 1e-3, 3e-4)
RATE_NOISE = (0.012, 0.01, 0.02)
EARLY = 0.03  # height of a planned foot above its foothold [h], below which a contact is a landing
LANDING_SHARE = 0.85  # of a swing, at which the foot is above its foothold
TOGETHER = 0.03  # feet of a planar robot nearer than this [h] share the load as planned
LANDED_LOAD, EARLY_LOAD, MOST_LOAD = 0.1, 0.1, 3.0  # [weight]
SEARCH_SPEED, DEEPEST = 0.1, 0.15  # of a foot that is late [h w], [h]
GOAL_SPEED = 0.8  # of a foothold [h w]
LEAST_CARRY = 1e-3  # effect of a foothold on the divergent component, below which it is not changed
CLOCK_FILTER, SLOWEST_CLOCK, FASTEST_CLOCK = 0.2, 0.3, 4.0


class StepClock:
    """Where a walk is: the plan's time and phase, the feet's offsets from the plan, and the foothold that is aimed at."""

    def __init__(self, settings: Balance, reference: WalkReference, feet: Array | None = None) -> None:
        """Begin with the feet (2, 3) where they are planned, or at these places [m]."""
        self._settings, self.reference = settings, reference
        self.time_s, self.rate = 0.0, 1.0  # of the plan, and seconds of it per second
        self.ended_s = 0.0  # since the end of the plan
        self._number, self.touched = 0, False
        planned = reference.sample("feet", 0.0).reshape(2, 3)
        self.offsets = np.zeros((2, 3)) if feet is None else feet - planned  # of the feet from their planned places [m]
        self.goal, self.origin = np.zeros(2), np.zeros(2)  # of the swinging foot's offset, and where it began
        self.lowered_m = 0.0  # by a foot that searches the ground

    @property
    def phase(self) -> SupportPhase:
        """The present phase."""
        return self.reference.phases[self._number]

    @property
    def before(self) -> SupportPhase | None:
        """The phase before it."""
        return self.reference.phases[self._number - 1] if self._number else None

    @property
    def after(self) -> SupportPhase | None:
        """The phase after it."""
        later = self.reference.phases[self._number + 1 :]
        return later[0] if later else None

    @property
    def stands(self) -> tuple[bool, bool]:
        """Whether the feet are on the ground."""
        left, right = (i != self.phase.swing or self.touched for i in (0, 1))
        return left, right

    @property
    def rolls(self) -> tuple[bool, bool]:
        """Whether the feet are on the ground with the tips of their toes only."""
        left, right = self.reference.sample("rolls", self.time_s) > 0.5
        return bool(left), bool(right)

    def advance(self, loads: Array, feet: Array) -> None:
        """Go on by one period: loads (2,) on the feet in weights, feet (2, 3) their places [m]."""
        settings, reference, phase = self._settings, self.reference, self.phase
        time = self.time_s + self.rate * settings.period_s
        if phase.swing is None:
            if time >= phase.end_s and self.after is not None:
                self._number += 1
                swing = self.phase.swing or 0
                self.origin, self.goal = self.offsets[swing, :2].copy(), self.offsets[1 - swing, :2].copy()
                self.lowered_m = 0.0
        else:
            touches = bool(loads[phase.swing] > settings.touch)
            axis = 3 * phase.swing + 2
            down = reference.sample("feet_rate", time)[axis] < 0.0
            high = reference.sample("feet", time)[axis] - reference.sample("feet", phase.end_s)[axis]
            early = bool(down) and high < EARLY * reference.height
            self.touched = self.touched or (touches and early)  # it stands, and the clock continues
            if time >= phase.end_s and (self.touched or touches or self.lowered_m > DEEPEST * reference.height):
                self.rate, self.touched = 1.0, self.after is None  # the last foot stays
                self._number += self.after is not None
            elif time >= phase.end_s:  # late: it goes down until the ground is there
                time = phase.end_s - 1e-9
                self.lowered_m += SEARCH_SPEED * reference.height * reference.rate * settings.period_s
        self.time_s = min(time, reference.duration_s)
        self.ended_s += time - self.time_s
        planned = reference.sample("feet", self.time_s).reshape(2, 3)
        flat = np.logical_and(self.stands, np.logical_not(self.rolls))
        self.offsets[flat] = (feet - planned)[flat]

    def choose(self, dcm: Array) -> tuple[Step, Array]:
        """Return the step by the divergent component (2,) [m], and the rotation (2, 2) into the axes of the standing sole."""
        s, reference, phase = self._settings, self.reference, self.phase
        assert phase.swing is not None
        stance, left, total = 1 - phase.swing, phase.end_s - self.time_s, phase.end_s - phase.start_s
        yaw = float(reference.sample("yaw", self.time_s)[stance])
        to_sole = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        limits = self._find_limits(phase.swing, min(self.time_s + left / 2, phase.end_s), to_sole)
        fastest = left / total * min(s.fastest / reference.rate, total)
        error = to_sole @ (dcm - reference.sample("dcm", self.time_s) - self.offsets[stance, :2])
        return choose_step(error, left, fastest, s.slowest * left, limits, s.hurry * reference.height), to_sole

    def aim(self, dcm: Array) -> None:
        """Choose foothold and time of the swing by the divergent component (2,) [m]."""
        reference, phase = self.reference, self.phase
        assert phase.swing is not None
        stance, left = 1 - phase.swing, phase.end_s - self.time_s
        (time, shift, _), to_sole = self.choose(dcm)
        self.rate += CLOCK_FILTER * (float(np.clip(left / max(time, 1e-3), SLOWEST_CLOCK, FASTEST_CLOCK)) - self.rate)
        if left / self.rate > 0.1 / reference.rate:
            step = GOAL_SPEED * reference.height * reference.rate * self._settings.period_s
            self.goal += np.clip(self.offsets[stance, :2] + to_sole.T @ shift - self.goal, -step, step)

    def _find_limits(self, swing: int, time_s: float, to_sole: Array) -> StepLimits:
        """Return the limits of a step in the axes of the standing sole; the ankles' range is that at a time of the plan."""
        s, reference, stance, end = self._settings, self.reference, 1 - swing, self.phase.end_s
        plan = reference.plan
        feet = reference.sample("feet", time_s).reshape(2, 3)
        zmp = to_sole @ (reference.sample("zmp", time_s) - feet[stance, :2])
        front, back, left, right = s.edge * reference.zmp_reach[stance]
        landing = reference.sample("feet", end).reshape(2, 3)
        apart = to_sole @ (landing[swing, :2] - landing[stance, :2])
        far, side = s.reach * reference.height, 1.0 if swing == 0 else -1.0
        closest = (reference.soles[0, 3] + reference.soles[1, 2]) * (1.0 + s.gap) - side * apart[1]
        low, high = np.minimum(-far - apart, 0.0), np.maximum(far - apart, 0.0)
        if plan.planar:
            low[1] = high[1] = 0.0
        elif swing == 0:
            low[1] = min(closest, high[1])
        else:
            high[1] = max(-closest, low[1])
        if plan.ground:  # feet on stairs have no room for other footholds
            low[0] = high[0] = -self.offsets[stance, 0]
        carry = float(reference.sample("carry", end + 1e-6)[0])
        if carry < LEAST_CARRY:  # the landing foot bears no load, and none of its places helps
            carry, low, high = LEAST_CARRY, np.zeros(2), np.zeros(2)
        return StepLimits(
            rate=reference.rate,
            carry=carry,
            zmp_low=s.reserve * np.minimum(np.array([-back, -right]) - zmp, 0.0),
            zmp_high=s.reserve * np.maximum(np.array([front, left]) - zmp, 0.0),
            shift_low=low,
            shift_high=high,
        )

    def compute_offsets(self) -> tuple[Array, Array]:
        """Return the offsets (2,) of the divergent component and of the ZMP from the plan [m], by those of the feet."""
        reference, phase = self.reference, self.phase
        if phase.swing is not None:
            stance = self.offsets[1 - phase.swing, :2]
            carry = float(reference.sample("carry", phase.end_s)[0])
            carry *= math.exp(-reference.rate * (phase.end_s - self.time_s) / self.rate)
            return stance + carry * (self.goal - stance), stance
        landed = 0 if self.before is None or self.before.swing is None else self.before.swing
        carry = float(reference.sample("carry", self.time_s)[0])
        load = float(reference.sample("load_left", self.time_s)[0])
        dcm = (1.0 - carry) * self.offsets[1 - landed] + carry * self.offsets[landed]
        return dcm[:2], (load * self.offsets[0] + (1.0 - load) * self.offsets[1])[:2]

    def predict_error(self, dcm: Array) -> float:
        """Return the error [m] that the first swing leaves of a divergent component (2,), as if the swing began now."""
        clock, reference = copy.copy(self), self.reference
        clock._number, clock.time_s = 1, reference.phases[1].start_s
        moved = reference.sample("dcm", clock.time_s) - reference.sample("dcm", 0.0)
        return float(np.linalg.norm(clock.choose(dcm + moved)[0].left))

    def find_most_load(self, foot: int) -> float:
        """Return the largest load of a foot [weight]: it rises after touch-down and falls before lift-off."""
        phase, slope = self.phase, self._settings.load_rate * self.reference.rate
        if phase.swing is not None:
            return EARLY_LOAD if phase.swing == foot else MOST_LOAD
        most = MOST_LOAD
        if self.after is not None and self.after.swing == foot:
            most = min(most, self._settings.touch + slope * (phase.end_s - self.time_s))
        if self.before is not None and self.before.swing == foot:
            most = min(most, LANDED_LOAD + slope * (self.time_s - phase.start_s))
        return most


class WholeBodyBalance:
    """Controller of one simulation: corrects the set-points of a drive whose stiffness, damping and limits it knows."""

    def __init__(self, settings: Balance, plan: Plan, drive: Drive, model: Any) -> None:
        self._settings, self._engine = settings, load_mujoco()
        joints = [plan.robot.joint(name) for name in plan.joints]
        self._stiffness = np.array([drive.stiffness(joint) for joint in joints])
        self._damping = np.array([drive.damping(joint) for joint in joints])
        torque_limits = np.array([drive.torque_limit(joint) for joint in joints])
        self._model = copy.deepcopy(model)
        self._model.opt.disableflags |= int(self._engine.mjtDisableBit.mjDSBL_CONTACT)
        self._data = self._engine.MjData(self._model)
        self._addresses = Addresses(self._model, plan)
        reference = WalkReference(plan, self._model, torque_limits)
        reference.check_support()
        self._steps_from_rest = reference.make_steps_from_rest(0), reference.make_steps_from_rest(1)
        self._qp = WholeBodyQP(reference, self._model, self._addresses, torque_limits, settings.friction)
        ankles = [plan.joints.index(plan.robot.path_to_root(foot.link)[0].name) for foot in plan.robot.feet.values()]
        stiffest = float(self._stiffness[ankles].max())
        self._hold = min(1.0, settings.hold * stiffest / (reference.mass * plan.gravity * reference.height))
        self._random, step_s = np.random.default_rng(settings.seed), float(model.opt.timestep)
        self._every, self._late = max(1, round(settings.period_s / step_s)), round(settings.delay_s / step_s)
        self._waiting: deque[tuple[int, RobotState]] = deque()  # measurements, and the steps at which they arrive
        deviations = [
            np.append(np.repeat(sizes[:2], 3)[plan.root_axes], np.full(len(joints), sizes[2]))
            for sizes in (NOISE, RATE_NOISE)
        ]
        self._noise = settings.noise * np.array(deviations)
        self.clock, self._plan_s = StepClock(settings, reference), reference.duration_s
        self._command: Array | None = None
        self.stepped_at_s: float | None = None  # begin of the first step from rest

    def fork(self) -> Self:
        """Return a copy for a simulation that begins in the middle of this one."""
        other = copy.copy(self)
        other._random, other._waiting = copy.deepcopy(self._random), self._waiting.copy()
        other.clock = clock = copy.copy(self.clock)
        clock.offsets, clock.goal, clock.origin = clock.offsets.copy(), clock.goal.copy(), clock.origin.copy()
        return other

    def find_plan_time(self, time_s: float) -> float:
        """Return the time of the plan that the robot has reached, and the time since the plan's end [s]."""
        return (self.clock.time_s if self.stepped_at_s is None else self._plan_s) + self.clock.ended_s

    def correct(self, command: Array, data: Any, step: int) -> tuple[Array, int]:
        """Return the set-points (J,) [rad] instead of the planned ones, and for how many steps of the engine."""
        if step % self._every == 0:
            self._waiting.append((step + self._late, self._measure(data)))
        if self._waiting and self._waiting[0][0] <= step:
            self._command = self._update(self._waiting.popleft()[1], step)
        arrival = self._waiting[0][0] if self._waiting else step + self._every
        wait = min(arrival - step, self._every - step % self._every)
        return command if self._command is None else self._command, wait

    def _measure(self, data: Any) -> RobotState:
        positions, noise = data.qpos.copy(), self._noise * self._random.standard_normal(self._noise.shape)
        self._engine.mj_integratePos(self._model, positions, noise[0], 1.0)
        return RobotState(positions, data.qvel + noise[1], measure_loads(data, self._addresses))

    def _update(self, state: RobotState, step: int) -> Array:
        """Return the set-points (J,) [rad] that give the torques of balance, damped towards planned rates."""
        s, data, engine, joints = self._settings, self._data, self._engine, self._addresses
        data.qpos[:], data.qvel[:] = state.positions, state.velocities
        engine.mj_fwdPosition(self._model, data)
        engine.mj_fwdVelocity(self._model, data)
        engine.mj_subtreeVel(self._model, data)
        feet = data.site_xpos[joints.soles].copy()
        weight = self.clock.reference.mass * -float(self._model.opt.gravity[2])
        self.clock.advance(state.loads / weight, feet)
        dcm = data.subtree_com[0, :2] + data.subtree_linvel[0, :2] / self.clock.reference.rate
        if self.clock.after is None and self.clock.phase.swing is None:
            self._step_if_needed(dcm, feet, step * float(self._model.opt.timestep))
        solution = self._qp.solve(data, self._collect_targets(data, dcm, feet, weight))
        q, qd = data.qpos[joints.angles], data.qvel[joints.rates]
        if solution is None:
            return q.copy() if self._command is None else self._command
        soon = qd + solution.accelerations * s.period_s
        planned, rate = (self.clock.reference.sample(name, self.clock.time_s) for name in ("q", "qd"))
        hold = self._hold if self.stepped_at_s is None else 0.0
        q = q + qd * (s.period_s / 2 + s.delay_s)  # in the middle of the period in which the command acts
        held, held_rate = q + hold * (planned - q), soon + s.damp * (self.clock.rate * rate - soon)
        return np.asarray(held + (solution.torques + self._damping * held_rate) / self._stiffness)

    def _step_if_needed(self, dcm: Array, feet: Array, time_s: float) -> None:
        """Begin a step from rest where the divergent component has left the soles (2, 3), and a foothold brings it back."""
        s, reference = self._settings, self.clock.reference
        nearest = clip_to_soles(dcm, feet[:, :2], reference.sample("yaw", self.clock.time_s), reference.soles)
        if np.linalg.norm(dcm - nearest) > s.step_beyond * reference.height:
            clocks = [StepClock(s, steps, feet) for steps in self._steps_from_rest]
            errors = [clock.predict_error(dcm) for clock in clocks]
            if min(errors) < s.step_error * reference.height:
                self.clock = clocks[errors.index(min(errors))]
                self.stepped_at_s = self.stepped_at_s or time_s

    def _collect_targets(self, data: Any, dcm: Array, feet: Array, weight: float) -> Targets:
        """Return the accelerations and loads that lead back to the plan."""
        s, clock = self._settings, self.clock
        reference = clock.reference
        rate = reference.rate

        def sample(name: str) -> Array:
            return reference.sample(name, clock.time_s)

        com, velocity = data.subtree_com[0], data.subtree_linvel[0]
        if clock.phase.swing is not None:
            clock.aim(dcm)
        dcm_offset, zmp_offset = clock.compute_offsets()
        standing = [i for i, stands in enumerate(clock.stands) if stands]
        planned_zmp = sample("zmp") + zmp_offset
        zmp = planned_zmp + s.dcm_gain * (dcm - sample("dcm") - dcm_offset)
        zmp = self._clip_to_support(zmp, data)
        ended = clock.time_s >= reference.duration_s
        mass = np.empty(3)
        mass[:2] = rate**2 * (com[:2] - zmp) + (0.0 if ended else sample("lever"))
        height = sample("com")[2] + np.mean([clock.offsets[i, 2] for i in standing])
        rising, acceleration = clock.rate * sample("com_rate")[2], clock.rate**2 * sample("com_acceleration")[2]
        mass[2] = _track(s.height_rate * rate, height - com[2], rising - velocity[2], acceleration)
        mass[2] = np.clip(mass[2], -0.6 * reference.plan.gravity, s.lift * reference.plan.gravity)
        joints = self._addresses
        q_error, qd_error = sample("q") - data.qpos[joints.angles], clock.rate * sample("qd") - data.qvel[joints.rates]
        load = float(sample("load_left")[0])
        apart = feet[0, :2] - feet[1, :2]
        if len(standing) == 2 and np.linalg.norm(apart) > TOGETHER * reference.height:
            # The load is divided as the commanded ZMP divides it
            load = float(np.clip(load + (zmp - planned_zmp) @ apart / (apart @ apart), 0.0, 1.0))
        left, right = (weight * clock.find_most_load(i) for i in (0, 1))
        return Targets(
            mass=mass,
            torso=self._turn_torso(data),
            feet=np.stack([self._move_foot(i, data, feet) for i in (0, 1)]),
            stands=clock.stands,
            rolls=clock.rolls,
            joints=_track(s.joint_rate * rate, q_error, qd_error),
            load_left=load,
            most_load=(left, right),
        )

    def _clip_to_support(self, zmp: Array, data: Any) -> Array:
        """Return the nearest point (2,) of the support [m], a foot that rolls has the tip of its toe."""
        clock, reference, joints = self.clock, self.clock.reference, self._addresses
        standing, rolls = np.flatnonzero(clock.stands), np.array(clock.rolls)[:, None]
        places = np.where(rolls, data.site_xpos[joints.tips], data.site_xpos[joints.soles])[standing, :2]
        reach = np.where(rolls, 0.0, self._settings.edge * reference.zmp_reach)[standing]
        return clip_to_soles(zmp, places, reference.sample("yaw", clock.time_s)[standing], reach)

    def _turn_torso(self, data: Any) -> Array:
        """Return the angular acceleration (3,) that leads the torso back to its planned attitude [rad/s^2]."""
        time, ahead, engine = self.clock.time_s, 0.01, self._engine
        rotation, matrices = data.xmat[self._addresses.torso].reshape(3, 3), np.zeros((2, 9))
        for matrix, at_time in zip(matrices, (time, time + ahead), strict=True):
            quaternion = self.clock.reference.sample("attitude", at_time)
            engine.mju_quat2Mat(matrix, quaternion / np.linalg.norm(quaternion))
        planned, soon = matrices.reshape(2, 3, 3)
        rate = to_rotation_vector(soon @ planned.T) / ahead * self.clock.rate
        error = to_rotation_vector(planned @ rotation.T)
        rate -= self._measure_velocity(data, engine.mjtObj.mjOBJ_XBODY, self._addresses.torso)[3:]
        return _track(self._settings.torso_rate * self.clock.reference.rate, error, rate)

    def _move_foot(self, foot: int, data: Any, feet: Array) -> Array:
        """Return the acceleration (6,) of a sole: none where it touches the ground, else along the path to the new foothold.

        A foot that rolls keeps the tip of its toe in place and turns as planned.
        """
        clock, reference, joints = self.clock, self.clock.reference, self._addresses
        rate, rolls = self._settings.swing_rate * reference.rate, clock.rolls[foot]
        kind = self._engine.mjtObj.mjOBJ_SITE
        velocity = self._measure_velocity(data, kind, joints.soles[foot])
        if rolls:
            velocity[:3] = self._measure_velocity(data, kind, joints.tips[foot])[:3]
        still = -2.0 * rate * velocity
        if clock.stands[foot] and not rolls:
            return still
        yaw, pitch, yaw_rate, pitch_rate = (
            float(reference.sample(name, clock.time_s)[foot]) for name in ("yaw", "pitch", "yaw_rate", "pitch_rate")
        )
        (c, s), (cp, sp) = ((math.cos(angle), math.sin(angle)) for angle in (yaw, pitch))
        planned = np.array([[c * cp, -s, c * sp], [s * cp, c, s * sp], [-sp, 0.0, cp]])
        tilt = to_rotation_vector(planned @ data.site_xmat[joints.soles[foot]].reshape(3, 3).T)
        planned_rate = clock.rate * np.array([-s * pitch_rate, c * pitch_rate, yaw_rate])
        turn = _track(rate, tilt, planned_rate - velocity[3:])
        if rolls:
            return np.concatenate([still[:3], turn])
        phase = clock.phase
        span = LANDING_SHARE * (phase.end_s - phase.start_s)
        done = min(max((clock.time_s - phase.start_s) / span, 0.0), 1.0)
        moved = clock.goal - clock.origin
        offset = np.append(
            clock.origin + done * done * (3.0 - 2.0 * done) * moved, clock.offsets[1 - foot, 2] - clock.lowered_m
        )
        place = reference.sample("feet", clock.time_s)[3 * foot : 3 * foot + 3] + offset
        planned_rate = reference.sample("feet_rate", clock.time_s)[3 * foot : 3 * foot + 3].copy()
        planned_rate[:2] += 6.0 * done * (1.0 - done) / span * moved
        return np.concatenate([_track(rate, place - feet[foot], clock.rate * planned_rate - velocity[:3]), turn])

    def _measure_velocity(self, data: Any, kind: Any, number: int) -> Array:
        """Return the velocity (6,) of a site or body, linear [m/s] and angular [rad/s], along the floor's axes."""
        velocity = np.zeros(6)
        self._engine.mj_objectVelocity(self._model, data, kind, number, velocity, 0)
        return velocity[[3, 4, 5, 0, 1, 2]]


def _track(rate: float, error: Any, rate_error: Any, acceleration: Any = 0.0) -> Any:
    """Return the acceleration of critically damped tracking with a natural frequency [1/s]."""
    return acceleration + rate**2 * error + 2.0 * rate * rate_error


def to_rotation_vector(turn: Array) -> Array:
    """Return axis times angle (3,) of a small rotation matrix (3, 3), to first order [rad]."""
    return np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
