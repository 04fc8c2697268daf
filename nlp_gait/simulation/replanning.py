"""Feedback by planning again: the rest of each phase, with the place and the time of the next foothold.

At each measurement the replanner solves the rest of the present phase (``gaits.biped.rest_of_phase``). The motion continues from
the commanded state, so that the drives keep their stiffness; the distance from there to the measured divergent component of
motion (DCM), of a pendulum under the torso, decides where and when the foot lands, and when it lifts off. Where the robot leans,
the swinging foot is turned and raised to the floor as it is under the leaning robot. At touch-down and lift-off the next phase
begins at the last plan's end.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.onboard.replanner import Replanner, make_replanner
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, InstantPoint
from nlp_gait.gaits.biped import rest_of_phase as rest
from nlp_gait.gaits.biped.body import TIMES, Body, PhaseName
from nlp_gait.gaits.biped.footholds import Foothold, find_support_sides
from nlp_gait.robots import Joint
from nlp_gait.simulation.engine import Sensing, SensorValues, TorsoSensor
from nlp_gait.simulation.feedback import to_rotation_vector
from nlp_gait.simulation.plan import SIDES, STANDING, Plan
from nlp_gait.symbolic.trajectories import cubic

FREE = ("length", "width", "time")
LAST_S = 0.04  # a phase with less left is not planned again: its state at the end is fixed by then
# Whole phases, where times are free: double support may last longer but not end before the load has passed.
FASTEST_S: dict[PhaseName, float] = {"ssp": 0.2, "dsp": math.inf}
SLOWEST = 1.5  # longest phase, relative to the planned one
NOTICED = 3.0  # standard deviations of the sensors' noise; a smaller distance of the DCM is ignored
UPRIGHT_AGAIN_S = 0.15  # after touch-down, until the foot is placed as under an upright robot
STEPS, TIME_LIMIT_S = 10, 3600.0  # of each plan; the limit of time only keeps the replanner from using IPOPT
MOST_OUTSIDE_M, MOST_BEYOND = 0.05, 0.1  # of the ZMP and the joints: a worse plan is not followed
SAFETY_M = 0.005  # from the soles' edges, within which the ZMP is planned


@dataclass(frozen=True, slots=True, kw_only=True)
class Replanning(Sensing):
    """Planning again after each measurement."""

    free: str = "length,width,time"  # what of the next step may change, separated by commas
    speed_factor: float = 1.0  # on the length of the steps in the second half of the walk

    def __post_init__(self) -> None:
        Sensing.__post_init__(self)
        if not set(self.free.split(",")) <= {*FREE, ""}:
            raise InputError(f"free must be some of {','.join(FREE)}, separated by commas, got {self.free!r}")


class PlanState(NamedTuple):
    """State of a plan in the axes of the standing foot: places [m] with velocities [m/s], angles [rad] with rates [rad/s]."""

    hip: Array  # (3,)
    hip_rate: Array
    foot: Array  # (2,) the other ankle
    foot_rate: Array
    arms: Array  # (k,)
    arms_rate: Array


class PlannedPhase(NamedTuple):
    """A phase of the planned walk, seen from the foot that stands at its start: mirrored where that is the right one."""

    name: PhaseName
    stance: int  # number of this foot in ``SIDES``
    duration_s: float
    start: PlanState
    end: PlanState
    height: float  # of the swing [m]


class Pursuit(NamedTuple):
    """The plan that the drives follow: the rest of a phase."""

    phase: PlannedPhase
    began_s: float
    share: float  # of the phase that is done where it begins
    duration_s: float
    start: PlanState
    end: PlanState
    values: dict[str, float]  # parameters of the problem
    x: Array  # (n,) its variables

    def share_at(self, t: float) -> float:
        """Return the share of the phase that is done at a time of the walk [s]."""
        return self.share + (1.0 - self.share) * min(max((t - self.began_s) / self.duration_s, 0.0), 1.0)

    def at(self, t: float) -> PlanState:
        """Return the state at a time of the walk [s]: cubics, as in the problem."""
        s, found = min(max((t - self.began_s) / self.duration_s, 0.0), 1.0), list[Any]()
        for k in range(0, len(self.start), 2):
            ends: list[Any] = [self.start[k], self.end[k], self.start[k + 1], self.end[k + 1], self.duration_s, s]
            found += cubic(*ends)[:2]  # of numbers
        return PlanState(*found)


class RestPlanner:
    """Planner of the rest of one kind of phase of a robot; its replanner is built when it is first used."""

    def __init__(self, body: Body, name: PhaseName) -> None:
        self.problem = rest.make_rest_of_phase(body, name)
        self.names = self.problem.names
        self._own = [parameter.name for parameter in self.problem.own_parameters]
        x, p, t = SX.sym("x", len(self.names)), SX.sym("p", len(self._own)), SX.sym("t")
        at_time = self.problem.display.at_time
        assert at_time is not None  # phases have it
        found = at_time(InstantPoint.of(x, p, self.names, self._own), t)
        self._at_time = ca.Function("now", [x, p, t], [found[each] for each in ("q", "qd", "tau")])
        self._replanner: Replanner | None = None

    def prepare(self, plan: Pursuit) -> Replanner:
        """Return the replanner, built from the optimum of a plan; raises InputError without DAQP."""
        if self._replanner is None:
            problem = self.problem.with_values(**plan.values)
            self._replanner = make_replanner(problem, near=solve(problem, x0=plan.x, workers=1))
        return self._replanner

    def evaluate(self, plan: Pursuit, t: float, rise: dict[str, float]) -> list[Array]:
        """Return q [rad], qd [rad/s] and tau [Nm], (J,) each, at a time of the walk [s], on a floor that rises."""
        values = plan.values | rise
        p = [values.get(name, self.problem.value(name)) for name in self._own]
        return [np.asarray(part).ravel() for part in self._at_time(plan.x, p, t - plan.began_s)]


@lru_cache(maxsize=4)
def make_planners(body: Body) -> dict[PhaseName, RestPlanner]:
    """Return the planners of both kinds of phases; one robot's are made once."""
    return {name: RestPlanner(body, name) for name in TIMES}


class StepPlanner:
    """Controller of one simulation; ``shift`` gives the set-points (J,) from q, qd and tau (J,)."""

    def __init__(self, settings: Replanning, plan: Plan, shift: Callable[..., Array], model: Any) -> None:
        """Raise InputError for a plan whose phases cannot be planned again."""
        body = plan.body
        if body is None or plan.planar or plan.ground or plan.slope_rad or "attitude" in plan.signals.arrays:
            raise InputError(
                "planning again is for walks on the flat whose torso stays upright, such as those of nao-cycle; "
                "use --feedback torso-spring"
            )
        self._body, self._shift, self._settings = body, shift, settings
        self._sensor = TorsoSensor(settings, plan, model)
        self._tick = max(1, round(settings.period_s / self._sensor.step_s))
        self._steps, self._k = 0, 0
        self._planners, self._phases = make_planners(body), list_phases(plan, body)
        self._used: set[PhaseName] = set()
        #: of each plan: time, wall time [s], whether it converged and whether it was followed
        self.plans: list[tuple[float, float, bool, bool]] = []
        self._lean = np.zeros(3)  # of the torso, about the axes of the floor [rad]
        self._began_s = 0.0  # the present phase
        # Heights at the start [m]; that of the centre of mass is known when the engine has begun.
        self._torso_height, self._mass_height = float(plan.at("hip", np.zeros(1))[0, 2]), 1.0
        self._ankles = [find_ankle_joints(body, side) for side in SIDES]
        pitch_Nm = min(sum(abs(each.axis[1]) * each.torque_limit_Nm for each in ankle) for ankle in self._ankles)
        self._reach_m = pitch_Nm / body.weight  # of the ZMP from an ankle under the whole weight
        self._now = self._make(0.0, 0.0, self._phases[0].start)
        self._guess, self._guess_s = self._now.x, 0.0  # where the next plan starts
        self._from = self._to = self._find_set_points(0.0)

    def correct(self, command: Array, data: Any) -> Array:
        """Return the set-points (J,) [rad] instead of the planned ones; call it once in each step of the engine."""
        if self._steps == 0:
            self._mass_height = float(data.subtree_com[0][2])
        t, seen, into = self._steps * self._sensor.step_s, self._sensor.read(data), self._steps % self._tick
        if into == 0:
            self._change_phase(t)
        if seen is not None:
            self._plan_again(seen)
        if into == 0:
            self._from, self._to = self._to, self._find_set_points(t + self._tick * self._sensor.step_s)
        self._steps += 1
        return self._from + into / self._tick * (self._to - self._from)

    def _change_phase(self, t: float) -> None:
        """Go to the next phase where the present one ends; the last one's end is held."""
        now, left_y = self._now, self._body.feet_y[0]
        end_s = now.began_s + now.duration_s
        if t < end_s or self._k + 1 == len(self._phases):
            return
        self._k, self._began_s = self._k + 1, end_s
        state, phase = now.at(end_s), self._phases[self._k]
        if phase.stance != now.phase.stance:  # seen from the other foot
            mirror, (x, y) = np.array([1.0, -1.0, 1.0]), state.foot
            hip = mirror * state.hip + [-x, y + left_y, 0.0]
            state = PlanState(hip, mirror * state.hip_rate, np.array([-x, y]), -state.foot_rate, *phase.start[4:])
        self._now = self._make(end_s, 0.0, state)
        self._guess, self._guess_s = self._now.x, end_s

    def _plan_again(self, seen: SensorValues) -> None:
        now, t = self._now, seen.step * self._sensor.step_s
        if t < now.began_s:
            return
        if now.phase.name == "ssp":
            self._lean = to_rotation_vector(seen.attitude) + seen.tilt_error
        if now.began_s + now.duration_s - t < LAST_S:
            return
        name, stance, commanded = now.phase.name, now.phase.stance, now.at(t)
        (x, y, _), (vx, vy, _) = seen.places[stance], seen.velocity
        side = 1.0 - 2.0 * stance
        place, rate = np.array([x, side * y + self._body.feet_y[0]]), np.array([vx, side * vy])
        growth = math.sqrt(self._body.gravity / self._mass_height)
        # The robot turns about its ankles, so its mass is displaced by less than its torso.
        miss = (
            self._mass_height
            / self._torso_height
            * (place - commanded.hip[:2] + (rate - commanded.hip_rate[:2]) / growth)
        )
        noise = math.hypot(self._settings.position_noise_m, self._settings.velocity_noise_m_s / growth)
        miss -= np.clip(miss, -NOTICED * noise, NOTICED * noise)
        trial, planner = self._make(t, now.share_at(t), commanded), self._planners[name]
        trial = trial._replace(
            values=trial.values
            | {**_name_numbers(rest.MISS, miss), rest.RATE: growth, rest.REACH: self._reach_m, **self._find_rise(t)}
        )
        solver = planner.prepare(trial)
        if name not in self._used:
            solver.restart()
            self._used.add(name)
        problem, x0 = planner.problem.with_values(**trial.values), self._guess.copy()
        x0[planner.names.index(TIMES[name])] -= t - self._guess_s
        started = time.perf_counter()
        found = solver.solve(
            trial.values, np.clip(x0, problem.lower, problem.upper), iterations=STEPS, time_limit_s=TIME_LIMIT_S
        )
        at = dict(zip(planner.names, found.x.tolist(), strict=True))
        is_followed = found.feasible and at[rest.OUTSIDE] <= MOST_OUTSIDE_M and at[rest.BEYOND] <= MOST_BEYOND
        self.plans.append((t, time.perf_counter() - started, found.converged, is_followed))
        self._guess, self._guess_s = (found.x, t) if is_followed else (trial.x, t)
        if is_followed:
            hip, rate = (np.array([at[each] for each in names]) for names in (rest.HIP_PLACES, rest.HIP_RATES))
            foot = np.array([at.get(each, value) for each, value in zip(rest.FOOT, trial.end.foot, strict=True)])
            end = trial.end._replace(hip=hip, hip_rate=rate, foot=foot)
            self._now = trial._replace(x=found.x, end=end, duration_s=at[TIMES[name]])

    def _make(self, t: float, share: float, state: PlanState) -> Pursuit:
        """Return the rest of the present phase to its planned end, from a state at a time [s]."""
        phase, left_y = self._phases[self._k], self._body.feet_y[0]
        name, end, duration = phase.name, phase.end, TIMES[phase.name]
        factor = self._settings.speed_factor if self._k >= len(self._phases) / 2 else 1.0
        faster = np.array([factor, 1.0, 1.0])
        left = (1.0 - share) * phase.duration_s
        rate, foot = faster * end.hip_rate, faster[:2] * end.foot if name == "ssp" else state.foot
        place = faster * end.hip + [*foot, 0.0]
        ends = {**_name_numbers(rest.HIP_PLACES, place), **_name_numbers(rest.HIP_RATES, rate), duration: left}
        if name == "ssp":
            ends |= _name_numbers(rest.FOOT, foot)
        values = {f"{each}.planned": value for each, value in ends.items()}
        values |= _name_numbers("xyz", state.hip, "_start_m", "hip_")
        values |= _name_numbers("xyz", state.hip_rate, "_start_m_s", "hip_v")
        arms = {"start": state.arms, "end": end.arms, "start_rate": state.arms_rate, "end_rate": end.arms_rate}
        for kind, numbers in arms.items():
            values |= _name_numbers(self._body.angle_names(name), numbers, f"_{kind}")
        values[f"{duration}.lower"] = min(FASTEST_S[name] * (1.0 - share), left)
        values[f"{duration}.upper"] = SLOWEST * left
        for each, what in zip((*rest.FOOT, duration), FREE, strict=True):
            if each in ends and what not in self._settings.free.split(","):
                values |= {f"{each}.lower": ends[each], f"{each}.upper": ends[each]}
        if name == "ssp":
            values["swing_share_start"] = share
            values["swing_height_m"] = phase.height
            values |= _name_numbers("xy", state.foot, "_start_m", "foot_")
            values |= _name_numbers("xy", state.foot_rate, "_start_m_s", "foot_v")
        else:
            values |= _name_numbers(rest.FOOT, foot)
        values |= self._list_edges([np.array([0.0, left_y])] + [foot] * (name == "dsp"))
        x = np.array([ends.get(each, 0.0) for each in self._planners[name].names])
        planned = PlanState(place, rate, foot, np.zeros(2), end.arms, end.arms_rate)
        return Pursuit(phase, t, share, left, state, planned, values, x)

    def _find_lean(self, t: float) -> Array:
        """Return the lean (3,) of the torso for which the swinging foot, or the one that has landed, is placed [rad]."""
        since = 0.0 if self._now.phase.name == "ssp" else t - self._began_s
        return self._lean * max(0.0, 1.0 - since / UPRIGHT_AGAIN_S)

    def _find_rise(self, t: float) -> dict[str, float]:
        """Return how the floor rises under the leaning robot."""
        x, y, _ = self._find_lean(t).tolist()
        return {rest.RISE[0]: y, rest.RISE[1]: -x * (1.0 - 2.0 * self._now.phase.stance)}

    def _list_edges(self, ankles: list[Array]) -> dict[str, float]:
        """Return the edges of the hull of soles, whose ankles (2,) are given; edges that are left over are far away."""
        feet = (self._body.robot.feet[side] for side in SIDES)
        soles = [Foothold(x, y, 0.0).outline(foot) for (x, y), foot in zip(ankles, feet, strict=False)]
        sides = find_support_sides(soles) - [0.0, 0.0, SAFETY_M]
        rows = [*sides.tolist(), *[(1.0, 0.0, 1.0)] * (rest.EDGES - len(sides))]
        return {f"edge_{k}_{what}": value for k, row in enumerate(rows) for what, value in zip("xym", row, strict=True)}

    def _find_set_points(self, t: float) -> Array:
        now = self._now
        parts = self._planners[now.phase.name].evaluate(now, t, self._find_rise(t))
        if now.phase.stance:
            columns, signs = self._body.mirror
            parts = [signs * part[columns] for part in parts]
        lean = self._find_lean(t) * (min(1.0, 2.0 * now.share_at(t)) if now.phase.name == "ssp" else 1.0)
        for joint in self._ankles[1 - now.phase.stance]:
            parts[0][self._body.joints.index(joint.name)] -= np.dot(joint.axis, lean)
        return self._shift(*parts)


def find_ankle_joints(body: Body, side: str) -> list[Joint]:
    """Return the last two joints of a leg."""
    below = {joint.child: joint for joint in body.robot.joints.values()}
    last = below[body.robot.feet[side].link]
    return [below[last.parent], last]


def _name_numbers(names: Sequence[str], numbers: Array, after: str = "", before: str = "") -> dict[str, float]:
    return {f"{before}{name}{after}": value for name, value in zip(names, numbers.tolist(), strict=True)}


def list_phases(plan: Plan, body: Body) -> list[PlannedPhase]:
    """Return the phases of a planned walk on the flat; the hip's place at the end is that over the other foot."""
    t = plan.signals.arrays["t"]
    moved = np.stack([np.abs(np.diff(plan.signals.arrays[f"{side}_foot"], axis=0)).max(axis=1) for side in SIDES])
    lifted = np.where(moved.max(axis=0) > STANDING, moved.argmax(axis=0), -1)  # between two samples
    switches = [0, *(np.flatnonzero(np.diff(lifted)) + 1).tolist(), len(t) - 1]
    found = []
    for first, last in zip(switches[:-1], switches[1:], strict=True):
        swings, feet = int(lifted[first]), [plan.at(f"{side}_foot", t[[first, last]]) for side in SIDES]
        stance = 1 - swings if swings >= 0 else int(feet[1][0, 0] < feet[0][0, 0])
        name: PhaseName = "ssp" if swings >= 0 else "dsp"
        mirror, origin = np.array([1.0, 1.0 - 2.0 * stance, 1.0]), np.array([0.0, body.feet_y[0], 0.0])
        height = float(plan.signals.arrays[f"{SIDES[swings]}_foot"][first:last, 2].max()) if swings >= 0 else 0.0
        arms = [body.joints.index(angle) for angle in body.angle_names(name)]
        columns, signs = body.mirror if stance else (list(range(len(body.joints))), np.ones(len(body.joints)))
        states = []
        for i, at in enumerate((t[[first]], t[[last]])):
            other, hip = (mirror * (place - feet[stance][i]) for place in (feet[1 - stance][i], plan.at("hip", at)[0]))
            q, qd = ((signs * plan.at(kind, at)[0][columns])[arms] for kind in ("q", "qd"))
            other, hip = (other + origin)[:2], hip + origin
            states.append(PlanState(hip, mirror * plan.rate("hip", at)[0], other, np.zeros(2), q, qd))
        start, end = states
        end = end._replace(hip=end.hip - [*end.foot, 0.0])
        found.append(PlannedPhase(name, stance, float(t[last] - t[first]), start, end, height))
    return found
