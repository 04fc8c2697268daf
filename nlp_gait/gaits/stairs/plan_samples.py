"""A planned step, sampled phase by phase: posture, torques, ground force, balance as the paper checks it, and clearance."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Array, Grid, Point
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs import planned_motion as planned
from nlp_gait.gaits.stairs.planned_motion import PHASES, Posture, Stair, StairPlan
from nlp_gait.gaits.stairs.stair import EDGE_WIDTH, GOVERNING, SETBACK, collect_governing, make_stair_plan, read_stair
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

# Checks of the swing foot against the stair per interval; none while the toe leaves or meets the ground.
CLEARANCE_DENSITY = 4
GROUND_SHARE = 0.1
_SWING = ("HK", "KA", "AS", "ST")
# Of each joint: its point, the links on the side away from the stance toe, whether its torque turns these clockwise, and the two
# links between which it is: its rate is the difference of theirs, or their sum for the torso, which turns counter-clockwise.
JOINT_SIDES = {
    "ankle'": ("A'", ("K'A'", "HK'", "UH", *_SWING), 1, ("K'A'", "A'S'")),
    "knee'": ("K'", ("HK'", "UH", *_SWING), 1, ("HK'", "K'A'")),
    "hip'": ("H", ("UH", *_SWING), -1, ("HK'", "UH")),
    "hip": ("H", _SWING, 1, ("HK", "UH")),
    "knee": ("K", ("KA", "AS", "ST"), 1, ("KA", "HK")),
    "ankle": ("A", ("AS", "ST"), 1, ("AS", "KA")),
    "toe": ("S", ("ST",), 1, ("ST", "AS")),
    "toe'": ("S'", ("A'S'", "K'A'", "HK'", "UH", *_SWING), 1, ("A'S'", "S'T'")),
}
LEAST_ARM = 1.0  # of the force on the rear foot about the centre of pressure of the other one [N m]
BalanceRule = Literal["feet", "polygon"]
"""What keeps a planned step upright: ``feet``, the centre of pressure below the stance foot, with a variable share of the load
on the rear toe; ``polygon``, as printed, the ZMP of (49) in the convex hull of all contact points."""


class PlanSamples(NamedTuple):
    """A step at its samples; columns are samples, both ends of each phase included."""

    time: MX  # (1, m) [s]
    q: MX  # (7, m) link angles in the order of MOVING [rad], qd and qdd their derivatives
    qd: MX  # (7, m) [rad/s]
    qdd: MX  # (7, m) [rad/s^2]
    reach: MX  # (2, m) cosines of swing and stance knee
    torque: MX  # (7, m) of the joints [Nm], in the order of JOINTS
    power: MX  # (7, m) of the joints [W], signed; with ``polygon`` an eighth row for the standing toe
    stance_force: MX  # (2, m) of the ground on the stance foot [N]
    stance_pressure: MX  # (1, m) its centre ahead of the stance ankle [m]
    zmp: MX  # (1, m) of the whole robot on the virtual slope, ahead of the stance ankle [m]
    hip: MX  # (2, m) [m]
    ankle: MX  # (2, m) of the swing leg [m]
    support: MX  # (2, m) rear and front end of the contact points; with ``feet`` both are zero [m]


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedStep:
    """Per-sample functions of a planned step and their grid."""

    phase_grid: Grid  # of each phase
    balance: BalanceRule = "feet"
    angle_limits: bool = True  # whether angles of links and knees are limited
    shank_limits: bool = False  # whether the shanks stay outside the steps

    @property
    def per_phase(self) -> int:
        """Number of equal parts of each phase."""
        return self.phase_grid.parts

    @cached_property
    def grid(self) -> tuple[DM, Array]:
        """Fractions of the phases and the current phase, (4, m) each, at the samples."""
        return make_phase_grid([np.linspace(0.0, 1.0, self.per_phase + 1)] * len(PHASES))

    @cached_property
    def clearance_grid(self) -> tuple[DM, Array]:
        """The same for checks of the swing foot against the stair."""
        fine = np.linspace(GROUND_SHARE, 1.0, CLEARANCE_DENSITY * self.per_phase + 1)
        return make_phase_grid([np.empty(0), np.empty(0), fine, 1.0 - fine[::-1]])

    def samples(self, point: Point, ops: Nonsmooth, grid: tuple[MX | DM, Array] | None = None) -> PlanSamples:
        """Return the step at all samples, or at those of another grid."""
        s, passing = grid or self.grid
        if self.balance == "polygon":
            return PlanSamples(*self._map_samples(make_balanced_function(ops), point, s, passing))
        function = sample_function(ops)
        return PlanSamples(*self._map_samples(function, point, s, passing, point["rear_share"]))

    def clearances(self, point: Point, ops: Nonsmooth, grid: tuple[MX | DM, Array] | None = None) -> MX:
        """Return heights (3, m) of toe, sole and ankle of the swing foot above the stair [m]."""
        heights = partial(planned.compute_heights, setback=SETBACK, width=EDGE_WIDTH)
        return self._map_samples(make_place_function(heights, ops), point, *(grid or self.clearance_grid))

    def shank_gaps(self, point: Point, ops: Nonsmooth, grid: tuple[MX | DM, Array] | None = None) -> MX:
        """Return by how much the shanks stay outside the steps (g, m) [m]."""
        gaps = partial(planned.compute_shank_gaps, setback=SETBACK)
        return self._map_samples(make_place_function(gaps, ops), point, *(grid or self.grid))

    def energy(self, samples: PlanSamples, ops: Nonsmooth) -> MX:
        """Return the integral of sum |torque x rate| by the grid's rule, phase by phase [J]."""
        power = ca.sum1(ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape))
        total, weights = MX(0), DM(self.phase_grid.weights)
        for first in self._phase_starts:
            last = first + self.per_phase
            total += (samples.time[last] - samples.time[first]) * (power[:, first : last + 1] @ weights)
        return total

    def jerk(self, samples: PlanSamples, quantum: MX) -> MX:
        """Return joint jerk between samples [rad/s^3] as a column; a jump between phases takes one quantum [s]."""
        change = DM(biped.JOINT_RATES) @ (samples.qdd[:, 1:] - samples.qdd[:, :-1])
        columns = []
        for k in range(change.shape[1]):
            duration = quantum if k + 1 in self._phase_starts else samples.time[k + 1] - samples.time[k]
            columns.append(change[:, k] / duration)
        return ca.vertcat(*columns)

    @property
    def _phase_starts(self) -> tuple[int, ...]:
        """Number of the first sample of each phase."""
        return tuple(i * (self.per_phase + 1) for i in range(len(PHASES)))

    def _map_samples(self, function: ca.Function, point: Point, s: MX | DM, passing: Array, *further: MX) -> MX:
        constants = (collect_governing(point), ca.vertcat(*read_stair(point)), point["reach_margin"], *further)
        columns = s.shape[1]
        repeated = (ca.repmat(value, 1, columns) for value in constants)
        return function.map(columns)(s, DM(passing), *repeated)


def make_grid_at(phase: int, fractions: MX | DM) -> tuple[MX | DM, Array]:
    """Return the grid of ``make_phase_grid`` at fractions (1, k) of one phase."""
    k = int(fractions.shape[1])
    shares: list[MX | DM] = [DM.ones(1, k) * float(j < phase) for j in range(len(PHASES))]
    shares[phase] = fractions
    return ca.vertcat(*shares), np.repeat(np.eye(len(PHASES))[:, [phase]], k, axis=1)


def make_phase_grid(fractions: list[Array]) -> tuple[DM, Array]:
    """Return s (4, m) of all phases from the fractions to sample in each, and the current phase as columns (4, m) of 0 and 1."""
    s, passing = zip(*(make_grid_at(i, DM(row).T) for i, row in enumerate(fractions)), strict=True)
    return ca.horzcat(*s), np.hstack(passing)


def sample_function(ops: Nonsmooth) -> ca.Function:
    """Return the function of one sample to the fields of ``PlanSamples``.

    Its inputs are s, the current phase, governing parameters, size, reach margin and rear share: that of the
    whole ground force on the rear toe at the start, which falls to zero over the double support.
    """
    inputs, plan, stair, step = make_step_symbols(ops)
    rear_share = SX.sym("rear_share")
    s = inputs[0]
    dynamics = biped.make_loads("T")
    support = ca.dot(plan.durations[:2], s[:2]) / ca.sum1(plan.durations[:2])
    share = rear_share * (1 - support**2 * (3 - 2 * support))
    _, force, whole = dynamics(*step.q, SX(2, 1))
    torque, stance_force, pressure = dynamics(*step.q, share * force)
    slope = stair.rise / stair.tread
    # The whole ground force acts along a line through the stance foot's level at ``whole``; where it meets the slope.
    zmp = whole * force[1] / (force[1] - slope * force[0])  # (eq. 49)
    power = torque * (DM(biped.JOINT_RATES) @ step.q.velocity)
    outputs = _list_outputs(inputs, plan, step, torque, power, stance_force, pressure, zmp, SX(2, 1))
    return ca.Function("sample", [*inputs, rear_share], ca.cse(outputs))


def make_balanced_function(ops: Nonsmooth) -> ca.Function:
    """Return the function of one sample with the load on both feet by ``compute_balance``; inputs without a rear share."""
    inputs, plan, stair, step = make_step_symbols(ops)
    s, passing, *_ = inputs
    torque, power, *ground = compute_balance(step, plan, s, passing, stair.rise / stair.tread)
    outputs = _list_outputs(inputs, plan, step, torque[: len(biped.JOINTS)], power, *ground)
    return ca.Function("sample", inputs, ca.cse(outputs))


def compute_balance(step: Posture, plan: StairPlan, s: SX, passing: SX, slope: SX) -> tuple[SX, ...]:
    """Return torques, power, forces, ZMP and support at fractions s (4,) of the phases, of which one is ``passing`` (4,).

    Outputs are those of ``PlanSamples``, with torques and power (8,) in the order of ``JOINT_SIDES``; the ZMP is (49) as printed:
    of point masses, on the virtual slope in all phases.

    Both feet share the load so that the stance foot carries what it can with its centre of pressure between its contact points;
    the forces on them are parallel.
    """
    q, v, a = (ca.vertcat(order, SX(2, 1)) for order in step.q)  # the stance foot is flat
    place = biped.locate_points(q, SX(2, 1))
    middles, accelerations = biped.locate_centres(place), _accelerate_centres(Motion(q, v, a))
    push, turn = biped.compute_pushes(accelerations, a)
    force = sum(push.values(), SX(2, 1))
    load = ca.fmax(force[1], biped.LEAST_LOAD * biped.GRAVITY * biped.load_toe_foot_biped().mass_kg)
    points = sum((biped.compute_moment(middles[link], push[link]) for link in biped.LINKS), SX(0))
    moment = points + sum(turn.values(), SX(0))

    sole, toe, rear_sole, rear_toe = (place[name] for name in ("S'", "T'", "S", "T"))
    double = passing[0] + passing[1]
    rear = rear_toe[0] + passing[0] * (rear_sole[0] - rear_toe[0])
    front = ca.fmin(ca.fmax(moment / load, 0), toe[0])
    back = ca.vertcat(ca.fmin(ca.fmax(moment / load, rear), rear_toe[0]), rear_toe[1])
    arm = ca.fmin(biped.compute_moment(back, force) - front * load, -LEAST_ARM)
    share = double * ca.fmin(ca.fmax((moment - front * load) / arm, 0), 1)

    torque, rate = [], []
    for joint, links, sense, between in JOINT_SIDES.values():
        total = sum(
            (biped.compute_moment(middles[link] - place[joint], push[link]) + turn[link] for link in links), SX(0)
        )
        torque.append(-sense * (total - share * biped.compute_moment(back - place[joint], force)))
        first, second = (v[biped.LINKS.index(link)] for link in between)
        rate.append(first + second if "UH" in between else first - second)
    pressure = (moment - share * biped.compute_moment(back, force)) / ca.fmax(
        (1 - share) * load, biped.LEAST_LOAD * load
    )
    zmp = points / ca.fmax(force[1] - slope * force[0], biped.LEAST_LOAD * load)  # (eq. 49)
    power = ca.vertcat(*torque) * ca.vertcat(*rate)
    return ca.vertcat(*torque), power, (1 - share) * force, pressure, zmp, ca.vertcat(double * rear, toe[0])


def _accelerate_centres(q: Motion) -> dict[str, SX]:
    """Return the accelerations (2,) of the links' centres [m/s^2] from angles (9,)."""

    def acceleration(link: str) -> SX:
        angle, rate, change = (order[biped.LINKS.index(link)] for order in q)
        normal = biped.compute_direction(link, angle + ca.pi / 2)
        return biped.get_rod(link).length_m * (change * normal - rate**2 * biped.compute_direction(link, angle))

    return biped.locate_centres(biped.sum_along_links("A'", SX(2, 1), acceleration))


def _list_outputs(inputs: list[SX], plan: StairPlan, step: Posture, *loads: SX) -> list[SX]:
    places = [step.hip.position, step.ankle.position]
    return [ca.dot(plan.durations, inputs[0]), *step.q, step.reach, *loads[:-1], *places, loads[-1]]


def make_place_function(measure: Callable[[Mapping[str, SX], Stair[SX]], SX], ops: Nonsmooth) -> ca.Function:
    """Return the function of a measure of points by name and the stair; inputs of ``make_balanced_function``."""
    inputs, _, stair, step = make_step_symbols(ops)
    points = biped.locate_points(biped.link_angles(step.q.position), SX(2, 1))
    return ca.Function("measure", inputs, [ca.cse(measure(points, stair))])


@cache
def make_reach_function(per_phase: int) -> ca.Function:
    """Return the function of governing parameters, size and reach margin to cosines of both knees (2, m) at the samples."""
    inputs, _, _, step = make_step_symbols(Exact())
    s, passing = PlannedStep(phase_grid=Grid(intervals=per_phase)).grid
    one = ca.Function("reach", inputs, [ca.cse(step.reach)])
    given = [SX.sym("given", size.shape) for size in inputs[2:]]
    columns = s.shape[1]
    return ca.Function(
        "reach", given, [one.map(columns)(s, DM(passing), *(ca.repmat(value, 1, columns) for value in given))]
    )


def make_step_symbols(ops: Nonsmooth) -> tuple[list[SX], StairPlan, Stair[SX], Posture]:
    """Return symbols s, passing, governing parameters, size and reach margin; the plan, the stair and the posture of these."""
    s, passing, values = SX.sym("s", 4), SX.sym("passing", 4), SX.sym("governing", len(GOVERNING))
    size, margin = SX.sym("size", 2), SX.sym("margin")
    plan, stair = make_stair_plan(values), Stair(size[0], size[1])
    rates = passing / plan.durations
    step = planned.compute_posture(plan, stair, s, rates, margin, ops)
    return [s, passing, values, size, margin], plan, stair, step
