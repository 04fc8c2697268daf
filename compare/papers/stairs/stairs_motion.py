"""Motion of hip and both feet over a first step from standing, and over two steps on the stairs, for drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import MOVING, biped_dynamics, link_angles
from nlp_gait.gaits.stairs.planned_motion import Stair, ToeFoot, ankle, ankle_on_toe, foot_angles, hip, landed_angles
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import GOVERNING, GRAVITY, make_stair_plan


@dataclass(frozen=True, kw_only=True, eq=False)
class Leg:
    """Joints of a leg, (m, 2) each [m]; origin at the rear ankle of the first step."""

    hip: Array
    knee: Array
    ankle: Array
    sole: Array
    toe: Array

    @property
    def lines(self) -> Array:
        """(m, 5, 2): hip, knee, ankle, sole, toe at every instant."""
        return np.stack([self.hip, self.knee, self.ankle, self.sole, self.toe], axis=1)


def first_step(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> tuple[Leg, Leg]:
    """Swing and stance leg from standing to one step up, at a constant height of the hip; the feet start side by side."""
    found = _motion(plan, tread / 2, rise / 2, times)
    level = np.column_stack([found["hip"][:, 0] - found["hip"][0, 0], np.full(len(times), plan["hip_height_m"])])
    flat = np.zeros((len(times), 2))
    return _leg(level, found["ankle"], *found["angles"].T), _leg(level, flat, flat[:, 0], flat[:, 0])


def two_steps(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> tuple[Leg, Leg]:
    """The leg that swings first and the other one: a whole step, then the next one with legs exchanged."""
    size, duration = np.array([tread, rise]), plan["t3_s"]
    first = _motion(plan, tread, rise, times[times < duration])
    second = _motion(plan, tread, rise, times[times >= duration] - duration)
    flat = np.tile(size, (len(first["hip"]), 1))
    at_hip = np.vstack([first["hip"], second["hip"] + size])
    swinging = _leg(
        at_hip,
        np.vstack([first["ankle"], second["landed"] + 2 * size]),
        *np.vstack([first["angles"], second["landed_angles"]]).T,
    )
    other = _leg(
        at_hip,
        np.vstack([flat, second["ankle"] + size]),
        *np.vstack([np.zeros_like(flat), second["angles"]]).T,
    )
    return swinging, other


def swing_leg(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> tuple[Array, Array]:
    """Absolute angles (m, 2) of the swing thigh and shank [rad], and the vectors from hip to ankle (m, 2) [m]."""
    found = _motion(plan, tread, rise, times)
    leg = _leg(found["hip"], found["ankle"], *found["angles"].T)
    links = np.stack([leg.knee - leg.hip, leg.ankle - leg.knee], axis=1)
    return np.arctan2(-links[:, :, 1], links[:, :, 0]), leg.ankle - leg.hip


def _motion(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> dict[str, Array]:
    ends = np.array([0.0, *(plan[name] for name in ("t1_s", "t2_s", "t_bc_s", "t3_s"))])
    s = np.clip((times - ends[:-1, None]) / np.diff(ends)[:, None], 0.0, 1.0)
    given = np.array([*(plan[name] for name in GOVERNING), tread, rise])
    found = _function().map(len(times))(s, np.tile(given[:, None], len(times)))
    names = ("hip", "ankle", "angles", "landed", "landed_angles")
    return {name: np.array(part).T for name, part in zip(names, found, strict=True)}


@cache
def _function() -> ca.Function:
    s, given = SX.sym("s", 4), SX.sym("given", len(GOVERNING) + 2)
    plan, stair = make_stair_plan(given[:-2]), Stair(given[-2], given[-1])
    robot = toe_foot_biped()
    foot = ToeFoot(robot.sole_m, robot.toe_m)
    landed = landed_angles(plan, s)
    outputs = [
        hip(plan, stair, GRAVITY, s),
        ankle(plan, stair, foot, s),
        ca.vertcat(*foot_angles(plan, s)),
        ankle_on_toe(foot, *landed),
        ca.vertcat(*landed),
    ]
    return ca.Function("motion", [s, given], outputs)


def _leg(at_hip: Array, at_ankle: Array, sole: Array, toe: Array) -> Leg:
    """Knee by the law of cosines, bent forward; sole joint and tip of the toe from their angles."""
    robot = toe_foot_biped()
    thigh, shank = robot.link("HK").length_m, robot.link("KA").length_m
    reach = at_ankle - at_hip
    distance = np.linalg.norm(reach, axis=1)
    along = (distance**2 + thigh**2 - shank**2) / (2 * distance)
    aside = np.sqrt(np.maximum(thigh**2 - along**2, 0.0))
    unit = reach / distance[:, None]
    forward = np.column_stack([-unit[:, 1], unit[:, 0]])
    at_sole = at_ankle + robot.sole_m * np.column_stack([np.cos(sole), -np.sin(sole)])
    return Leg(
        hip=at_hip,
        knee=at_hip + along[:, None] * unit + aside[:, None] * forward,
        ankle=at_ankle,
        sole=at_sole,
        toe=at_sole + robot.toe_m * np.column_stack([np.cos(toe), -np.sin(toe)]),
    )


STEP_S = 1e-3
N = len(MOVING)
# Both gains are those of a joint with a natural frequency of 20 rad/s, critically damped [1/s^2], [1/s].
FEEDBACK, OPEN_LOOP = (400.0, 40.0), (0.0, 0.0)


def replay(arrays: Mapping[str, Array], gains: tuple[float, float]) -> tuple[Array, Array]:
    """Times (m,) [s] and errors (m, 7) of the link angles [rad] when the planned torques drive the robot.

    The planned generalised torques are those of the joints with the planned ground forces on the rear foot, as continuous
    functions of time: M a + C v + G along the planned motion, whose acceleration is constant within an interval.

    Args:
        arrays: signals of ``stairs-ideal``.
        gains: K_p and K_d of a feedback of the error, multiplied by M; ``OPEN_LOOP`` for none.
    """
    intervals = len(arrays["t"]) - 1
    steps = round(arrays["t"][1] / STEP_S)
    planned = np.hstack([arrays[name][:-1] for name in ("link_q", "link_qd", "link_qdd")])
    inputs = np.column_stack([np.repeat(planned, steps, axis=0), np.tile(np.arange(steps) * STEP_S, intervals)])
    start = np.concatenate([arrays["link_q"][0], arrays["link_qd"][0]])
    path = np.array(_step().mapaccum(len(inputs))(start, inputs.T, np.array(gains)))[:N].T
    since = (inputs[:, -1] + STEP_S)[:, None]
    q, v, a = np.split(inputs[:, :-1], 3, axis=1)
    times = np.asarray(np.arange(1, len(inputs) + 1) * STEP_S)
    return times, path - (q + v * since + a * since**2 / 2)


@cache
def _step() -> ca.Function:
    """(state, planned angles, rates and accelerations with the time since then, gains) to the state a step later."""
    q, v, planned, gains = SX.sym("q", N), SX.sym("v", N), SX.sym("planned", 3 * N + 1), SX.sym("gains", 2)
    motion = biped_dynamics(toe_foot_biped().rods, GRAVITY, q, v, link_angles(q))
    dynamics = ca.Function("dynamics", [q, v], ca.cse([motion.M, motion.C @ v + motion.G]))
    q0, v0, a, time = ca.vertsplit(planned, [0, N, 2 * N, 3 * N, 3 * N + 1])
    now_q, now_v = q0 + v0 * time + a * time**2 / 2, v0 + a * time
    M_planned, h_planned = dynamics(now_q, now_v)
    M, h = dynamics(q, v)
    torque = M_planned @ a + h_planned + M @ (gains[0] * (now_q - q) + gains[1] * (now_v - v))
    rate = ca.Function("rate", [ca.vertcat(q, v), planned, gains], [ca.vertcat(v, ca.solve(M, torque - h))])

    state, given, k, dt = MX.sym("state", 2 * N), MX.sym("given", 3 * N + 1), MX.sym("gains", 2), STEP_S
    half, whole = (ca.vertcat(given[:-1], given[-1] + share * dt) for share in (0.5, 1.0))
    k1 = rate(state, given, k)
    k2 = rate(state + dt / 2 * k1, half, k)
    k3 = rate(state + dt / 2 * k2, half, k)
    k4 = rate(state + dt * k3, whole, k)
    return ca.Function("step", [state, given, k], [state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
