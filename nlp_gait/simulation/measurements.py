"""Simulations in numbers, with the model's predictions; and walks of several steps."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from nlp_gait.formulation import Array
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import LEAST_LOAD
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import ON_GROUND, SIDES, Plan
from nlp_gait.simulation.simulate import Simulation

AT_LIMIT = 1.0 - 1e-9  # share of a torque limit from which a drive counts as saturated
SHORTEST_CONTACT = 0.003  # [s]; a shorter one is ignored
LEAST_RISE = 0.9  # of the hip in a climb, as a share of the planned rise
MIDDLE = (0.2, 0.8)  # of the phase, undisturbed by the start from unloaded drives and by the landing


@dataclass(frozen=True, slots=True, kw_only=True)
class Power:
    """Mean power over the phase [W]."""

    mechanical_W: float  # |torque rate|, summed over the joints
    # torque times rate: work of the drives minus work on them. If set-points jump, |torque rate| depends on the
    # engine's step and this does not
    signed_W: float
    heat_W: float  # K torque^2

    @classmethod
    def compute(cls, torque: Array, rate: Array, heat_loss: float, mean: Callable[[Array], float]) -> Self:
        """Compute it from torques [Nm] and rates [rad/s] (T, J), K [W/(Nm)^2], and a function for the mean of samples (T,)."""
        work = torque * rate
        return cls(
            mechanical_W=float(mean(np.abs(work).sum(axis=1))),
            signed_W=float(mean(work.sum(axis=1))),
            heat_W=heat_loss * float(mean((torque**2).sum(axis=1))),
        )

    @property
    def total_W(self) -> float:
        """Mechanical and heat."""
        return self.mechanical_W + self.heat_W


@dataclass(frozen=True, slots=True, kw_only=True)
class Touchdown:
    """First contact of a swinging foot that lasts 3 ms, in the second half of its swing."""

    side: str
    planned_s: float
    measured_s: float  # begin of the contact
    speed_m_s: float  # of the sole under the ankle towards the ground just before; 0 if it moved away


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurements:
    """A simulation in numbers; those over time are for the phase, without the settling after it."""

    fallen: bool  #: the torso tilted by more than 45 degrees or sank below 60 % of its height, then or while settling
    fell_at_s: float | None  #: time of the fall; None if it stayed up
    stepped_at_s: float | None  #: time of a step that balance feedback took at rest; None without one
    largest_tilt_deg: float  #: of the torso, settling included
    tracking_rms_rad: float  #: planned minus measured angle, over all joints
    tracking_max_rad: float  #: largest
    #: largest distance of a supporting sole from its place at the begin of its support, until a step at rest
    slip_m: float
    landing_errors_m: Mapping[str, float]  #: by side, from the final to the planned place of the swinging sole
    #: distance of the centre of pressure, averaged over one set-point period, from the planned ZMP
    pressure_rms_m: float | None
    pressure_middle_rms_m: float | None  #: over the middle 60 % of the phase
    touchdowns: tuple[Touchdown, ...]  #: of the swinging feet, in order of time
    #: largest time by which a foot touched the ground too early; negative if all were late
    earliest_landing_s: float | None
    landing_speed_m_s: float | None  #: largest of the touchdowns; None without any
    predicted: Power  #: power by the rigid model
    measured: Power  #: power of the drives
    saturated: Mapping[str, float]  #: share of time at the torque limit, by joint, where not zero
    #: ratio of the largest planned torque to the torque limit, by joint, where above 1: no drive can follow
    beyond_limit: Mapping[str, float]
    joint_limits: tuple[str, ...]  #: joints that left their mechanical range


def measure(plan: Plan, simulation: Simulation, drive: Drive) -> Measurements:
    """Compute the numbers of a simulation."""
    during, end = simulation.plan_t <= plan.duration_s, np.array([plan.duration_s])
    error = plan.at("q", simulation.plan_t[during]) - simulation.q[during]
    torque = simulation.torque[during]
    joints = [plan.robot.joint(name) for name in plan.joints]
    limits = np.array([drive.torque_limit(joint) for joint in joints])
    low, high = np.array([joint.limits_rad for joint in joints]).T
    outside = (simulation.q[during] < low) | (simulation.q[during] > high)
    pressure = average_pressure(simulation, drive.period_s)
    deviation = np.linalg.norm(pressure - plan.at("zmp", simulation.plan_t), axis=1)[during]
    touchdowns = _find_touchdowns(plan, simulation)
    share = simulation.plan_t[during] / plan.duration_s
    middle = deviation[(share >= MIDDLE[0]) & (share <= MIDDLE[1])]
    return Measurements(
        fallen=simulation.fell_at_s is not None,
        fell_at_s=simulation.fell_at_s,
        stepped_at_s=simulation.stepped_at_s,
        largest_tilt_deg=math.degrees(float(simulation.tilt.max())),
        tracking_rms_rad=_compute_rms(error),
        tracking_max_rad=float(np.abs(error).max()),
        slip_m=_measure_slip(plan, simulation),
        landing_errors_m={
            side: float(np.linalg.norm(simulation.feet[-1, i, :2] - plan.at(f"{side}_foot", end)[0, :2]))
            for i, side in enumerate(SIDES)
            if side not in plan.supports
        },
        pressure_rms_m=_rms_if_any(deviation),
        pressure_middle_rms_m=_rms_if_any(middle),
        touchdowns=touchdowns,
        earliest_landing_s=max((landing.planned_s - landing.measured_s for landing in touchdowns), default=None),
        landing_speed_m_s=max((landing.speed_m_s for landing in touchdowns), default=None),
        predicted=predict_power(plan),
        measured=Power.compute(torque, simulation.qd[during], plan.heat_loss, np.mean),
        saturated=_select_joints(plan, (np.abs(torque) >= AT_LIMIT * limits).mean(axis=0), above=0.0),
        beyond_limit=_select_joints(plan, np.abs(plan.signals.arrays["tau"]).max(axis=0) / limits, above=1.0),
        joint_limits=tuple(_select_joints(plan, outside.any(axis=0), above=0)),
    )


def predict_power(plan: Plan) -> Power:
    """Compute the power of the planned motion by the rigid model."""
    from scipy.integrate import trapezoid

    arrays = plan.signals.arrays

    def mean(samples: Array) -> float:
        return float(trapezoid(samples, arrays["t"]) / plan.duration_s)

    return Power.compute(arrays["tau"], arrays["qd"], plan.heat_loss, mean)


def average_pressure(simulation: Simulation, period_s: float) -> Array:
    """Return the centre of pressure (T, 2), averaged over a moving period with the loads as weights [m]; NaN in flight."""
    from scipy.ndimage import uniform_filter1d  # long to import, for a function that few commands call

    width = max(1, round(period_s / TIME_STEP))
    load = simulation.loads.sum(axis=1)
    moment = np.nan_to_num(simulation.pressure) * load[:, None]
    mean_load = uniform_filter1d(load, width)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = uniform_filter1d(moment, width, axis=0) / mean_load[:, None]
    return np.asarray(np.where(mean_load[:, None] > LEAST_LOAD, centre, np.nan))


def _measure_slip(plan: Plan, simulation: Simulation) -> float:
    planned = simulation.t < (simulation.stepped_at_s or math.inf)
    feet = {side: simulation.feet[planned, SIDES.index(side), :2] for side in SIDES}
    moved = [feet[side] for side in plan.supports]
    if not moved:  # both feet swing: their supports begin and end
        for side, path in feet.items():
            standing = np.concatenate([[0], plan.stands(side, simulation.plan_t[planned]), [0]])
            starts, ends = (np.flatnonzero(np.diff(standing) == change) for change in (1, -1))
            moved += [path[start:end] for start, end in zip(starts, ends, strict=True)]
    return max((float(np.linalg.norm(path - path[0], axis=1).max()) for path in moved), default=0.0)


def _find_touchdowns(plan: Plan, simulation: Simulation) -> tuple[Touchdown, ...]:
    touchdowns, lasting = [], round(SHORTEST_CONTACT / TIME_STEP)
    for i, side in enumerate(SIDES):
        swings = np.diff(np.concatenate([[1.0], plan.bears(side, simulation.plan_t), [1.0]]))
        for lifted, set_down in zip(np.flatnonzero(swings < 0), np.flatnonzero(swings > 0), strict=True):
            planned = min(int(set_down), len(simulation.t) - 1)
            middle = (int(lifted) + planned) // 2
            loaded = (simulation.loads[middle:, i] > LEAST_LOAD).astype(float)
            # The contact must last: a toe that brushes an edge has not landed.
            lasting_from = np.flatnonzero(np.convolve(loaded, np.ones(lasting), "valid") == lasting)
            if middle > 0 and lasting_from.size:
                first = middle + int(lasting_from[0])
                speed = max(0.0, float(simulation.feet[first - 1, i, 2] - simulation.feet[first, i, 2]) / TIME_STEP)
                times = {"planned_s": float(simulation.t[planned]), "measured_s": float(simulation.t[first])}
                touchdowns.append(Touchdown(side=side, **times, speed_m_s=speed))
    return tuple(sorted(touchdowns, key=lambda touchdown: touchdown.planned_s))


def _select_joints(plan: Plan, shares: Array, above: float) -> dict[str, float]:
    return {name: share for name, share in zip(plan.joints, shares.tolist(), strict=True) if share > above}


def _compute_rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rms_if_any(values: Array) -> float | None:
    numbers = values[np.isfinite(values)]
    return _compute_rms(numbers) if numbers.size else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """A walk in numbers, of the point between the feet from start to rest; forward is from planned start to planned end."""

    steps: int
    steps_done: int  # whole steps before a fall; all if it fell later or not at all
    planned_m: float
    walked_m: float | None  # distance forward; None after a fall
    drift_m: float | None  # distance to the left; None after a fall
    heading_deg: float | None  # direction of the torso at the end, positive to the left; None after a fall
    planned_heading_deg: float
    # energy by the model, mechanical and heat, per planned metre; infinite for a turn in one place
    model_J_per_m: float
    engine_J_per_planned_m: float | None  # energy of the drives; None after a fall
    engine_J: float | None  # energy of the drives; None after a fall
    engine_J_per_m: float | None  # per metre walked; None after a fall or without progress
    measurements: Measurements

    def course(self) -> dict[str, Any]:
        """Return it as plain data, without the measurements."""
        return {name: value for name, value in asdict(self).items() if name != "measurements"}


def measure_walk(plan: Plan, simulation: Simulation, drive: Drive, steps: int) -> Walk:
    """Compute the numbers of a simulated walk."""
    measurements = measure(plan, simulation, drive)
    way = _find_planned_way(plan)
    planned, (walked, drift) = math.hypot(*way), _measure_walked_distance(simulation, way)
    during = simulation.plan_t <= plan.duration_s
    late_s = float((simulation.t - simulation.plan_t)[during][-1])  # by which feedback delayed the end
    energy = measurements.measured.total_W * (plan.duration_s + late_s)
    fell = simulation.fell_at_s
    return Walk(
        steps=steps,
        steps_done=steps
        if fell is None
        else min(steps, math.floor(steps * float(simulation.plan_t[-1]) / plan.duration_s)),
        planned_m=planned,
        walked_m=walked if fell is None else None,
        drift_m=drift if fell is None else None,
        heading_deg=math.degrees(float(np.unwrap(simulation.heading)[-1])) if fell is None else None,
        planned_heading_deg=math.degrees(float(plan.heading(simulation.plan_t)[-1])),
        model_J_per_m=measurements.predicted.total_W * plan.duration_s / planned if planned > 0.0 else math.inf,
        engine_J_per_planned_m=energy / planned if fell is None and planned > 0.0 else None,
        engine_J=energy if fell is None else None,
        engine_J_per_m=energy / walked if fell is None and walked > 0.0 else None,
        measurements=measurements,
    )


def _find_planned_way(plan: Plan) -> tuple[float, float]:
    """Return the planned way (x, y) of the point halfway between the feet [m]; zero if it is shorter than a micrometre."""
    feet = plan.signals.arrays["left_foot"] + plan.signals.arrays["right_foot"]
    x, y = ((feet[-1] - feet[0])[:2] / 2).tolist()
    return (x, y) if math.hypot(x, y) > ON_GROUND else (0.0, 0.0)


def _measure_walked_distance(simulation: Simulation, way: tuple[float, float]) -> tuple[float, float]:
    """Return the distances of the point halfway between the feet along a way (x, y) and to its left, from start to rest [m]."""
    middle = simulation.feet.mean(axis=1)
    x, y = (middle[-1] - middle[0])[:2].tolist()
    cos, sin = (component / math.hypot(*way) for component in way) if any(way) else (1.0, 0.0)
    return cos * x + sin * y, cos * y - sin * x


@dataclass(frozen=True, slots=True, kw_only=True)
class RiserHit:
    """Contact of a swinging foot with a riser, the face of a step, during one swing."""

    side: str
    at_s: float  # begin
    contact_s: float  # time in contact
    force_N: float  # largest, along the contact's normal
    impulse_Ns: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimbMeasurements:
    """A climb on stairs in numbers: one value for each time that a foot is planned to land, until a fall."""

    stairs: int  # planned: levels on which feet land
    climbed: int  # of these before the first landing that is half a tread or more off; all if the hip rises with them
    half_tread_m: float
    landing_errors_m: tuple[float, ...]  # distances from the planned footholds, in x and z
    hip_rises_m: tuple[float, ...]  # of the torso's origin since the last landing
    planned_rises_m: tuple[float, ...]
    riser_hits: tuple[RiserHit, ...]  # at most one for each swing


def measure_climb(plan: Plan, simulation: Simulation) -> ClimbMeasurements:
    """Compute the numbers of a simulation on stairs."""
    feet = {side: plan.at(f"{side}_foot", simulation.plan_t) for side in SIDES}
    bears = {side: np.diff(plan.bears(side, simulation.plan_t), prepend=1.0) > 0.0 for side in SIDES}
    landings = sorted((int(k), side) for side in SIDES for k in np.flatnonzero(bears[side]))
    instants = [k for k, _ in landings]
    errors = [float(np.linalg.norm(simulation.feet[k, SIDES.index(side)] - feet[side][k])) for k, side in landings]
    levels = [float(feet[side][k, 2]) for k, side in landings]
    higher = np.diff(levels, prepend=max(float(path[0, 2]) for path in feet.values())) > ON_GROUND
    hips = plan.at("hip", simulation.plan_t)[:, 2], simulation.torso[:, 2]
    planned, measured = (np.diff(hip[[0, *instants]]) for hip in hips)
    half_tread = (plan.ground[1].edge_m - plan.ground[0].edge_m) / 2
    good = np.cumprod([error < half_tread for error in errors])
    risen = measured.sum() > LEAST_RISE * planned.sum()
    return ClimbMeasurements(
        stairs=_count_levels(plan),
        climbed=int((higher & (good > 0)).sum()) if risen else 0,
        half_tread_m=half_tread,
        landing_errors_m=tuple(errors),
        hip_rises_m=tuple(measured.tolist()),
        planned_rises_m=tuple(planned.tolist()),
        riser_hits=_find_riser_hits(plan, simulation),
    )


def _find_riser_hits(plan: Plan, simulation: Simulation) -> tuple[RiserHit, ...]:
    hits = []
    for i, side in enumerate(SIDES):
        swings = np.diff(np.concatenate([[1.0], plan.bears(side, simulation.plan_t), [1.0]]))
        for begin, end in zip(np.flatnonzero(swings < 0), np.flatnonzero(swings > 0), strict=True):
            forces = simulation.risers[begin:end, i]
            touching = np.flatnonzero(forces > LEAST_LOAD)
            if touching.size:
                hit = RiserHit(
                    side=side,
                    at_s=float(simulation.t[begin + touching[0]]),
                    contact_s=TIME_STEP * touching.size,
                    force_N=float(forces.max()),
                    impulse_Ns=TIME_STEP * float(forces.sum()),
                )
                hits.append(hit)
    return tuple(sorted(hits, key=lambda hit: hit.at_s))


def _count_levels(plan: Plan) -> int:
    """Return the number of steps up of the feet that are planned."""
    treads = np.array([0.0, *(tread.height_m for tread in plan.ground)])
    first, last = (max(plan.at(f"{side}_foot", np.array([t]))[0, 2] for side in SIDES) for t in (0.0, plan.duration_s))
    return int(((treads > first + ON_GROUND) & (treads < last + ON_GROUND)).sum())
