"""What a simulation showed, beside what the model had predicted."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import trapezoid
from scipy.ndimage import uniform_filter1d

from nlp_gait.formulation import Array
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.playback import LEAST_LOAD, Trace

AT_LIMIT = 1.0 - 1e-9  # share of a torque limit from which a servo counts as saturated
LASTING = 0.003  # [s] of a load that is no brush
MIDDLE = (0.2, 0.8)  # part of the phase that neither the start from unloaded servos nor the landing disturbs


@dataclass(frozen=True, slots=True, kw_only=True)
class Power:
    """Mean power over the phase [W].

    Attributes:
        mechanical_W: |torque rate|, summed over the joints.
        signed_W: torque times rate: what the servos do less what they take back. Where set-points jump, |torque rate|
            depends on the engine's step and this does not.
        heat_W: K torque^2.
    """

    mechanical_W: float
    signed_W: float
    heat_W: float

    @classmethod
    def of(cls, torque: Array, rate: Array, heat_loss: float, mean: Callable[[Array], float]) -> Power:
        """From torques [Nm] and rates [rad/s] (T, J), K [W/(Nm)^2], and how a time mean is taken of samples (T,)."""
        work = torque * rate
        return cls(
            mechanical_W=mean(np.abs(work).sum(axis=1)),
            signed_W=mean(work.sum(axis=1)),
            heat_W=heat_loss * mean((torque**2).sum(axis=1)),
        )

    @property
    def total_W(self) -> float:
        """Mechanical and heat."""
        return self.mechanical_W + self.heat_W


@dataclass(frozen=True, slots=True, kw_only=True)
class Landing:
    """Where a swinging sole stood at the end, against the plan; (x, y) under the ankle [m]."""

    planned_m: tuple[float, float]
    measured_m: tuple[float, float]
    error_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Touchdown:
    """Where the ground first carried a swinging foot for 3 ms on end, in the second half of its swing.

    Attributes:
        side: of the foot.
        planned_s: when the plan sets it down.
        measured_s: when that began.
        speed_m_s: of the sole under the ankle towards the ground just before; 0 if it moved away from it.
    """

    side: str
    planned_s: float
    measured_s: float
    speed_m_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurements:
    """One simulation in numbers; those over time belong to the phase, not to the settling after it.

    Attributes:
        fallen: the torso tilted by more than 45 degrees or sank below 60 % of its height, then or while settling.
        fell_at_s: when; None if it stayed up.
        largest_tilt_deg: of the torso, settling included.
        tracking_rms_rad: planned minus measured angle, over all joints.
        tracking_max_rad: largest.
        slip_m: largest distance of a supporting sole from where it stood when its support began.
        landings: by side, of the swinging feet.
        pressure_rms_m: distance of the centre of pressure, averaged over one set-point period, from the planned ZMP.
        pressure_max_m: largest.
        pressure_middle_rms_m: over the middle 60 % of the phase.
        pressure_raw_rms_m: without averaging; contact forces ring at every new set-point.
        pressure_in_feet_rms_m: both relative to the supporting feet, where they were and where they were planned.
        touchdowns: of the swinging feet, in order of time.
        earliest_landing_s: by how much a foot touched the ground before the plan, at most; negative if all were late.
        landing_speed_m_s: largest of the touchdowns; None without any.
        predicted: power by the rigid model.
        measured: power of the servos.
        saturated: share of time at the torque limit, by joint, where not zero.
        beyond_limit: largest planned torque over the torque limit, by joint, where above 1: no drive can follow that.
        joint_limits: joints that went beyond their mechanical range.
    """

    fallen: bool
    fell_at_s: float | None
    largest_tilt_deg: float
    tracking_rms_rad: float
    tracking_max_rad: float
    slip_m: float
    landings: Mapping[str, Landing]
    pressure_rms_m: float | None
    pressure_max_m: float | None
    pressure_middle_rms_m: float | None
    pressure_raw_rms_m: float | None
    pressure_in_feet_rms_m: float | None
    touchdowns: tuple[Touchdown, ...]
    earliest_landing_s: float | None
    landing_speed_m_s: float | None
    predicted: Power
    measured: Power
    saturated: Mapping[str, float]
    beyond_limit: Mapping[str, float]
    joint_limits: tuple[str, ...]


def measure(plan: Plan, trace: Trace, drive: Drive) -> Measurements:
    """Numbers of one simulation."""
    during = trace.t <= plan.duration_s
    error = plan.at("q", trace.t[during]) - trace.q[during]
    torque, rate = trace.torque[during], trace.qd[during]
    limits = np.array([drive.torque_limit(plan.robot.joint(name)) for name in plan.joints])
    pressure, planned = averaged_pressure(trace, drive.period_s), plan.at("zmp", trace.t)
    raw = np.linalg.norm(trace.pressure - planned, axis=1)[during]
    deviation = np.linalg.norm(pressure - planned, axis=1)[during]
    in_feet = np.linalg.norm(pressure - planned - _feet_moved(plan, trace), axis=1)[during]
    landed = _touchdowns(plan, trace)
    share = trace.t[during] / plan.duration_s
    middle = deviation[(share >= MIDDLE[0]) & (share <= MIDDLE[1])]
    return Measurements(
        fallen=trace.fell_at_s is not None,
        fell_at_s=trace.fell_at_s,
        largest_tilt_deg=math.degrees(float(trace.tilt.max())),
        tracking_rms_rad=_rms(error),
        tracking_max_rad=float(np.abs(error).max()),
        slip_m=_slip(plan, trace),
        landings={side: _landing(plan, trace, side) for side in SIDES if side not in plan.supports},
        pressure_rms_m=_if_any(_rms, deviation),
        pressure_max_m=_if_any(np.max, deviation),
        pressure_middle_rms_m=_if_any(_rms, middle),
        pressure_raw_rms_m=_if_any(_rms, raw),
        pressure_in_feet_rms_m=_if_any(_rms, in_feet),
        touchdowns=landed,
        earliest_landing_s=max((at.planned_s - at.measured_s for at in landed), default=None),
        landing_speed_m_s=max((at.speed_m_s for at in landed), default=None),
        predicted=predicted(plan),
        measured=Power.of(torque, rate, plan.heat_loss, lambda samples: float(samples.mean())),
        saturated=_by_joint(plan, (np.abs(torque) >= AT_LIMIT * limits).mean(axis=0), above=0.0),
        beyond_limit=_by_joint(plan, np.abs(plan.signals.arrays["tau"]).max(axis=0) / limits, above=1.0),
        joint_limits=_beyond_range(plan, trace.q[during]),
    )


def predicted(plan: Plan) -> Power:
    """What the rigid model says of the planned motion."""
    arrays, duration = plan.signals.arrays, plan.duration_s
    mean = lambda samples: float(trapezoid(samples, arrays["t"]) / duration)  # noqa: E731
    return Power.of(arrays["tau"], arrays["qd"], plan.heat_loss, mean)


def averaged_pressure(trace: Trace, period_s: float) -> Array:
    """Centre of pressure (T, 2) averaged over a moving period, each instant weighted by its load [m]; NaN in flight."""
    width = max(1, round(period_s / TIME_STEP))
    load = trace.loads.sum(axis=1)
    moment = np.nan_to_num(trace.pressure) * load[:, None]
    mean_load = uniform_filter1d(load, width)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = uniform_filter1d(moment, width, axis=0) / mean_load[:, None]
    return np.asarray(np.where(mean_load[:, None] > LEAST_LOAD, centre, np.nan))


def _slip(plan: Plan, trace: Trace) -> float:
    feet = {side: trace.feet[:, SIDES.index(side), :2] for side in SIDES}
    moved = [feet[side] for side in plan.supports]
    if not moved:  # both feet swing: a support begins and ends
        for side, path in feet.items():
            resting_point = np.concatenate([[0], plan.stands(side, trace.t), [0]])
            starts, ends = (np.flatnonzero(np.diff(resting_point) == change) for change in (1, -1))
            moved += [path[start:end] for start, end in zip(starts, ends, strict=True)]
    return max((float(np.linalg.norm(path - path[0], axis=1).max()) for path in moved), default=0.0)


def _feet_moved(plan: Plan, trace: Trace) -> Array:
    """How far the feet that should stand are from where they should (T, 2) [m], averaged over these feet."""
    weights = np.stack([plan.stands(side, trace.t) for side in SIDES], axis=1)
    moved = np.stack(
        [trace.feet[:, i, :2] - plan.at(f"{side}_foot", trace.t)[:, :2] for i, side in enumerate(SIDES)], axis=1
    )
    with np.errstate(invalid="ignore"):
        return np.asarray((weights[:, :, None] * moved).sum(axis=1) / weights.sum(axis=1)[:, None])


def _touchdowns(plan: Plan, trace: Trace) -> tuple[Touchdown, ...]:
    found, lasting = [], round(LASTING / TIME_STEP)
    for i, side in enumerate(SIDES):
        swings = np.diff(np.concatenate([[1.0], plan.bears(side, trace.t), [1.0]]))
        for lifted, set_down in zip(np.flatnonzero(swings < 0), np.flatnonzero(swings > 0), strict=True):
            planned = min(int(set_down), len(trace.t) - 1)
            middle = (int(lifted) + planned) // 2
            loaded = (trace.loads[middle:, i] > LEAST_LOAD).astype(float)
            # From here on the ground carries for a while: a toe that brushes an edge has not landed.
            carried = np.flatnonzero(np.convolve(loaded, np.ones(lasting), "valid") == lasting)
            if middle > 0 and carried.size:
                first = middle + int(carried[0])
                speed = max(0.0, float(trace.feet[first - 1, i, 2] - trace.feet[first, i, 2]) / TIME_STEP)
                found.append(
                    Touchdown(
                        side=side,
                        planned_s=float(trace.t[planned]),
                        measured_s=float(trace.t[first]),
                        speed_m_s=speed,
                    )
                )
    return tuple(sorted(found, key=lambda at: at.planned_s))


def _landing(plan: Plan, trace: Trace, side: str) -> Landing:
    planned = plan.at(f"{side}_foot", np.array([plan.duration_s]))[0, :2]
    measured = trace.feet[-1, SIDES.index(side), :2]
    return Landing(
        planned_m=(float(planned[0]), float(planned[1])),
        measured_m=(float(measured[0]), float(measured[1])),
        error_m=float(np.linalg.norm(measured - planned)),
    )


def _by_joint(plan: Plan, shares: Array, above: float) -> dict[str, float]:
    return {name: share for name, share in zip(plan.joints, shares.tolist(), strict=True) if share > above}


def _beyond_range(plan: Plan, q: Array) -> tuple[str, ...]:
    ranges = np.array([plan.robot.joint(name).limits_rad for name in plan.joints])
    beyond = np.any((q < ranges[:, 0]) | (q > ranges[:, 1]), axis=0).tolist()
    return tuple(name for name, hit in zip(plan.joints, beyond, strict=True) if hit)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _if_any(statistic: Any, values: Array) -> float | None:
    """A statistic of the values that are numbers; None if none is."""
    numbers = values[np.isfinite(values)]
    return float(statistic(numbers)) if numbers.size else None
