"""A gait in the engine: its simulation, and the disturbances that it survives."""

import copy
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Columns, Signals, make_vector_columns
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import Addresses, check_range, load_mujoco, place_root
from nlp_gait.simulation.mjcf import FRICTION, TIME_STEP, Bumps, make_plan_model
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.sensors import HEIGHT, UPWARD, list_sensors, read_sensors

CHUNK = 500  # steps of the engine without a look at the robot
LONGEST_WALK = 3  # simulated times the planned duration, where feedback delays the plan
SETTLE_TIME = 1.0  # [s] after the phase with the last set-point held: a robot that has lost its balance falls within it
FALLEN_TILT = math.radians(45.0)
FALLEN_HEIGHT = 0.6  # of the torso's planned height at the start; sinking by the rest below the plan is a fall
COLUMNS = {
    "plan_t": Columns(unit="s"),
    "torso": make_vector_columns("m"),
    "tilt": Columns(unit="rad"),
    "heading": Columns(unit="rad"),
    "feet": Columns(unit="m", labels=SIDES),
    "loads": Columns(unit="N", labels=SIDES),
    "risers": Columns(unit="N", labels=SIDES),
    "pressure": make_vector_columns("m", "xy"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """Impulse on the torso's centre of mass."""

    impulse_Ns: tuple[float, float]  # (x, y) [N s]
    start_s: float | None = None  # of the force; None for the middle of the motion
    duration_s: float = 0.05  # of the constant force

    def __post_init__(self) -> None:
        for impulse in self.impulse_Ns:
            check_range("push", "impulse_Ns", impulse, -1e6, 1e6)
        check_range("push", "start_s", self.start_s or 0.0, 0.0, 1e6)

    def force(self, since_s: float) -> tuple[float, float]:
        """Return the force (x, y) at a time since its begin [N]."""
        if not 0.0 <= since_s < self.duration_s:
            return (0.0, 0.0)
        return (self.impulse_Ns[0] / self.duration_s, self.impulse_Ns[1] / self.duration_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """Differences of the simulated world and robot from the plan's."""

    friction: float = FRICTION  # coefficient of sliding friction
    mass_factor: float = 1.0  # on masses and inertias of all links; the gait was planned for 1
    stiffness_factor: float = 1.0  # on the stiffness of the joints' drives; their damping stays
    # (x, y) slope of the floor, besides the plan's: positive rises forward or to the left
    slope_rad: tuple[float, float] = (0.0, 0.0)
    push: Push | None = None
    bumps: Bumps | None = None

    def __post_init__(self) -> None:
        for name in ("friction", "mass_factor", "stiffness_factor"):
            check_range("simulation", name, getattr(self, name), 1e-6, 1e6)
        if not all(abs(slope) < math.pi / 4 for slope in self.slope_rad):
            raise InputError(f"slope_rad must be within +-pi/4, got {self.slope_rad}")

    def gravity(self, magnitude: float, planned_rad: float = 0.0) -> tuple[float, float, float]:
        """Return gravity in the axes of the sloping floor [m/s^2]; the planned slope rises forward."""
        x, y = (math.tan(slope + planned) for slope, planned in zip(self.slope_rad, (planned_rad, 0.0), strict=True))
        scale = magnitude / math.sqrt(1.0 + x * x + y * y)
        return (-x * scale, -y * scale, -scale)


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulation:
    """Measurements at every step of the engine; the first axis is time, axes are those of the floor."""

    t: Array  #: (T,) [s]
    plan_t: Array  #: (T,) time of the plan that the robot follows, which feedback delays or hastens [s]
    states: Array  #: (T, Q) the engine's coordinates: place [m] and attitude of the root, angles of the joints [rad]
    q: Array  #: (T, J) joint angles, columns as in the plan [rad]
    qd: Array  #: (T, J) [rad/s]
    torque: Array  #: (T, J) of the drives [Nm]
    set_points: Array  #: (T, J) of the drives, including the feed-forward [rad]
    torso: Array  #: (T, 3) its origin [m]
    tilt: Array  #: (T,) angle between the torso's axis and its planned direction [rad]
    heading: Array  #: (T,) angle of the torso's forward axis about the floor's normal, positive to the left [rad]
    feet: Array  #: (T, 2, 3) soles under the ankles, left and right [m]
    loads: Array  #: (T, 2) force of the floor on the left and right foot, along its normal [N]
    risers: Array  #: (T, 2) of these, forces of risers and other steep faces [N]
    pressure: Array  #: (T, 2) centre of pressure of both feet [m]; NaN in flight
    fell_at_s: float | None  #: None if the robot stayed up
    stepped_at_s: float | None = None  #: begin of a step that balance feedback took at rest

    def signals(self, joints: tuple[str, ...]) -> Signals:
        """Return the time histories, for an archive."""
        arrays = {name: getattr(self, name) for name in ("t", "q", "qd", "torque", "set_points", *COLUMNS)}
        driven = {"torque": Columns(unit="Nm", labels=joints), "set_points": Columns(unit="rad", labels=joints)}
        return Signals(joints=joints, arrays=arrays, columns=COLUMNS | driven)


class SimulationRun:
    """A simulation in progress; ``data`` is the engine's present state."""

    def __init__(
        self,
        plan: Plan,
        conditions: Conditions | None = None,
        drive: Drive | None = None,
        settle_s: float = SETTLE_TIME,
        model: Any = None,
    ) -> None:
        """Begin at the planned state, to end some time after the plan, in this world of ``prepare``; MissingExtraError."""
        self._engine, self.plan = load_mujoco(), plan
        drive, self._conditions = drive or Drive(), conditions or Conditions()
        push, end_s = self._conditions.push, plan.duration_s + settle_s
        if push is not None and not 0.0 <= (push.start_s or 0.0) < end_s:
            raise InputError(
                f"a push must begin from 0 s to the end of the simulation, {end_s:.4g} s, got {push.start_s:g} s"
            )
        self.model, self.data = prepare(plan, self._conditions, drive, model)
        self._addresses = Addresses(self.model, plan)
        steps = round((plan.duration_s + settle_s) / TIME_STEP)
        times = np.linspace(0.0, steps * TIME_STEP, steps, endpoint=False)
        self._commands = drive.set_points(plan.at, times, [plan.robot.joint(name) for name in plan.joints])
        heights, self._axes = plan.at("hip", times)[:, 2], plan.torso_axis(times)
        self._least_heights = heights - (1.0 - FALLEN_HEIGHT) * heights[0]
        self._corrector = drive.make_corrector(plan, lambda: prepare(plan, Conditions(), drive)[0])
        self._latest: list[dict[str, Array]] = []  # whose sensors are not read yet
        self._parts: list[dict[str, Array]] = []
        self._step = 0
        self.fell_at_s: float | None = None

    @property
    def time_s(self) -> float:
        """Simulated time [s]."""
        return self._step * TIME_STEP

    def advance(self, until_s: float = math.inf) -> bool:
        """Simulate until a time, the end of the walk or a fall; return whether the robot is still up and on its way."""
        while self.time_s < until_s and self.fell_at_s is None:
            left = LONGEST_WALK * len(self._commands) - self._step
            steps = math.ceil(min(CHUNK, left, (until_s - self.time_s) / TIME_STEP - 1e-6))
            commands, plan_times = self._command(steps)
            if not len(commands):
                return False
            self._advance_engine(commands, plan_times)
        return self.fell_at_s is None

    def _command(self, steps: int) -> tuple[Array, Array]:
        """Return set-points (T, J) of at most so many next steps and their times of the plan (T,); none after the end."""
        corrector, planned = self._corrector, self._commands
        if corrector is None:
            commands = planned[self._step : self._step + steps]
            return commands, np.array(TIME_STEP * np.arange(self._step, self._step + len(commands)))
        plan_times = [corrector.find_plan_time(self.time_s)]
        if steps < 1 or (k := round(plan_times[0] / TIME_STEP)) >= len(planned):
            return planned[:0], np.zeros(0)
        command, valid = corrector.correct(planned[k], self.data, self._step)
        times = self.time_s + TIME_STEP * np.arange(1, min(steps, valid))
        plan_times += [
            time for t in times.tolist() if round((time := corrector.find_plan_time(t)) / TIME_STEP) < len(planned)
        ]
        return np.tile(command, (len(plan_times), 1)), np.array(plan_times)

    def _advance_engine(self, commands: Array, plan_times: Array) -> None:
        from mujoco import rollout

        model, data, addresses, count = self.model, self.data, self._addresses, len(commands)
        kinds, spec = self._engine.mjtState, self._engine.mjtState.mjSTATE_FULLPHYSICS
        controls, times = np.zeros((count, model.nu)), TIME_STEP * np.arange(self._step, self._step + count)
        controls[:, addresses.actuators] = commands
        kind, push = kinds.mjSTATE_CTRL, self._conditions.push
        if push is not None:
            start = self.plan.duration_s / 2 if push.start_s is None else push.start_s
            forces = np.zeros((count, model.nbody, 6))
            forces[:, addresses.torso, :2] = [push.force(time - start) for time in times.tolist()]
            controls = np.hstack([controls, forces.reshape(count, -1)])
            kind |= kinds.mjSTATE_XFRC_APPLIED
        state, warm = np.empty(self._engine.mj_stateSize(model, spec)), data.qacc_warmstart.copy()
        self._engine.mj_getState(model, data, state, spec)
        states, sensors = rollout.rollout(
            model, data, state[None], controls[None], control_spec=int(kind), initial_warmstart=warm[None]
        )
        # A step leaves positions, forces and contacts of the instant at which it began
        before = np.concatenate([state[None], states[0, :-1]])
        k = np.rint(plan_times / TIME_STEP).astype(int)
        upright = np.einsum("ti,ti->t", sensors[0, :, UPWARD], self._axes[k])
        diverged = ~np.isfinite(states[0]).all(axis=1) | (np.abs(states[0, :, 0] - times - TIME_STEP) > TIME_STEP / 2)
        fallen = diverged | (upright < math.cos(FALLEN_TILT)) | (sensors[0, :, HEIGHT] < self._least_heights[k])
        if fallen.any():
            count = int(fallen.argmax()) + 1
            self.fell_at_s = float(times[count - 1])
        part = {
            "t": times,
            "plan_t": plan_times,
            "set_points": commands,
            "tilt": np.arccos(np.clip(upright, -1.0, 1.0)),
            "states": before,
            "sensors": sensors[0],
        }
        self._latest.append({name: values[:count] for name, values in part.items()})
        self._step += count
        if sum(len(part["t"]) for part in self._latest) >= CHUNK:
            self._record()

    def _record(self) -> None:
        """Read the sensors of the latest steps."""
        part = {name: np.concatenate([latest[name] for latest in self._latest]) for name in self._latest[0]}
        self._latest = []
        readings, model = read_sensors(self.plan, part.pop("sensors")), self.model
        positions, velocities = np.split(part["states"][:, 1 : 1 + model.nq + model.nv], [model.nq], axis=1)
        measured = {
            "states": positions,
            "q": positions[:, self._addresses.angles],
            "qd": velocities[:, self._addresses.rates],
            "heading": np.arctan2(readings.forward[:, 1], readings.forward[:, 0]),
            **{name: getattr(readings, name) for name in ("torque", "torso", "feet", "loads", "risers", "pressure")},
        }
        self._parts.append(part | measured)

    def push(self, push: Push) -> None:
        """Push the robot from now on by this push instead of an earlier one."""
        self._conditions = replace(self._conditions, push=push)

    def fork(self, push: Push) -> "SimulationRun":
        """Return a copy that is pushed; its trace begins here."""
        other = copy.copy(self)
        other.data, other._latest, other._parts = copy.copy(self.data), [], []
        other._corrector = None if self._corrector is None else self._corrector.fork()
        other.push(push)
        return other

    def finish(self) -> Simulation:
        """Simulate to the end and return the measurements."""
        self.advance()
        if self._latest:
            self._record()
        measured = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        stepped_at_s = None if self._corrector is None else self._corrector.stepped_at_s
        return Simulation(**measured, fell_at_s=self.fell_at_s, stepped_at_s=stepped_at_s)


def simulate_plan(plan: Plan, conditions: Conditions | None = None, drive: Drive | None = None) -> Simulation:
    """Simulate a gait from its planned state until it has settled or fallen, deterministically; raises MissingExtraError."""
    return SimulationRun(plan, conditions, drive).finish()


def prepare(plan: Plan, conditions: Conditions, drive: Drive, model: Any = None) -> tuple[Any, Any]:
    """Return the engine's model, or that of an earlier call, and its data, with the robot in its planned state at time zero."""
    engine = load_mujoco()
    if model is None:
        xml = make_plan_model(
            plan, drive, conditions.friction, conditions.bumps, list_sensors(plan, conditions.bumps is not None)
        )
        model = engine.MjModel.from_xml_string(xml)
        model.body_mass *= conditions.mass_factor
        model.body_inertia *= conditions.mass_factor
        model.actuator_gainprm[:, 0] *= conditions.stiffness_factor
        model.actuator_biasprm[:, 1] *= conditions.stiffness_factor
        model.opt.gravity[:] = conditions.gravity(plan.gravity, plan.slope_rad)
        engine.mj_setConst(model, engine.MjData(model))
    data = engine.MjData(model)
    addresses, start = Addresses(model, plan), np.zeros(1)
    data.qvel[:] = 0.0
    place_root(data.qpos, plan, plan.at("hip", start)[0], plan.attitude(start)[0])
    data.qvel[addresses.root] = np.append(plan.rate("hip", start)[0], plan.spin_at_start)[plan.root_axes]
    data.qpos[addresses.angles], data.qvel[addresses.rates] = plan.at("q", start)[0], plan.rate("q", start)[0]
    engine.mj_forward(model, data)
    return model, data
