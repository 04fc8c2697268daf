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
from nlp_gait.gaits.stairs.planar_biped import StanceLoads
from nlp_gait.gaits.stairs.planned_motion import PHASES, Posture, Stair, StairPlan
from nlp_gait.gaits.stairs.stair import EDGE_WIDTH, GOVERNING, SETBACK, collect_governing, read_stair
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

# Checks of the swing foot against the stair per interval; none while the toe leaves or meets the ground.
CLEARANCE_DENSITY = 4
GROUND_SHARE = 0.1
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
    power: MX  # (7, m) of the joints [W], signed
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
        further = (point["rear_share"],) if self.balance == "feet" else ()
        function = make_sample_function(ops, self.balance)
        return PlanSamples(*self._map_samples(function, point, *(grid or self.grid), *further))

    def clearances(self, point: Point, ops: Nonsmooth, grid: tuple[MX | DM, Array] | None = None) -> MX:
        """Return heights (3, m) of toe, sole and ankle of the swing foot above the stair [m]."""
        heights = partial(planned.compute_heights, setback=SETBACK, width=EDGE_WIDTH)
        return self._map_samples(make_place_function(heights, ops), point, *(grid or self.clearance_grid))

    def shank_gaps(self, point: Point, ops: Nonsmooth, grid: tuple[MX | DM, Array] | None = None) -> MX:
        """Return by how much the shanks stay outside the steps (g, m) [m]."""
        gaps = partial(planned.compute_shank_gaps, setback=SETBACK)
        return self._map_samples(make_place_function(gaps, ops), point, *(grid or self.grid))

    def energy(self, samples: PlanSamples, ops: Nonsmooth) -> MX:
        """Return the integral of sum |torque x rate| by the trapezoidal rule, phase by phase [J]."""
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


def make_sample_function(ops: Nonsmooth, balance: BalanceRule) -> ca.Function:
    """Return the function of one sample to the fields of ``PlanSamples``.

    Its inputs are those of ``make_step_symbols``, and with ``feet`` the rear share: that of the whole ground force on the rear
    toe at the start, which falls to zero over the double support.
    """
    inputs, plan, stair, step = make_step_symbols(ops)
    slope = stair.rise / stair.tread
    if balance == "feet":
        rear_share = SX.sym("rear_share")
        loads, zmp = _share_load(plan, inputs[0], step, rear_share, slope)
        inputs, support = [*inputs, rear_share], SX(2, 1)
    else:
        loads, zmp, support = _balance_load(inputs[1], step, slope)
    power = loads.torque * (DM(biped.JOINT_RATES) @ step.q.velocity)
    time = ca.dot(plan.durations, inputs[0])
    samples = PlanSamples(
        time, *step.q, step.reach, loads.torque, power, *loads[1:], zmp, step.hip[0], step.ankle[0], support
    )
    return ca.Function("sample", inputs, ca.cse([*samples]))


def _share_load(plan: StairPlan, s: SX, step: Posture, rear_share: SX, slope: SX) -> tuple[StanceLoads[SX], SX]:
    """Return the loads with a share of the ground force on the rear toe, and the ZMP on the virtual slope."""
    dynamics = biped.make_loads("T")
    support = ca.dot(plan.durations[:2], s[:2]) / ca.sum1(plan.durations[:2])
    share = rear_share * (1 - support**2 * (3 - 2 * support))
    _, force, whole = dynamics(*step.q, SX(2, 1))
    # The whole ground force acts along a line through the stance foot's level at ``whole``; where it meets the slope.
    zmp = whole * force[1] / (force[1] - slope * force[0])  # (eq. 49)
    return StanceLoads(*dynamics(*step.q, share * force)), zmp


def _balance_load(passing: SX, step: Posture, slope: SX) -> tuple[StanceLoads[SX], SX, SX]:
    """Return the loads, the ZMP of (49) as printed, of point masses on the virtual slope in all phases, and the support (2,).

    Both feet share the load so that the stance foot carries what it can with its centre of pressure between its contact points;
    the forces on them are parallel. The rear force acts between the contact points of the rear foot, whose toe is flat while its
    sole stands.
    """
    dynamics, nothing = biped.make_loads("T", "S"), SX(2, 1)
    place = biped.locate_points(biped.link_angles(step.q.position), SX(2, 1))
    _, force, whole = dynamics(*step.q, nothing, nothing)
    load = ca.fmax(force[1], biped.LEAST_LOAD * biped.GRAVITY * biped.load_toe_foot_biped().mass_kg)

    toe, rear_sole, rear_toe = (place[name] for name in ("T'", "S", "T"))
    sole_stands, double = passing[0], passing[0] + passing[1]
    rear = rear_toe[0] + sole_stands * (rear_sole[0] - rear_toe[0])
    front = ca.fmin(ca.fmax(whole, 0), toe[0])
    back = ca.fmin(ca.fmax(whole, rear), rear_toe[0])
    arm = ca.fmin(biped.compute_moment(ca.vertcat(back, rear_toe[1]), force) - front * load, -LEAST_ARM)
    behind = double * ca.fmin(ca.fmax((whole - front) * load / arm, 0), 1) * force
    on_sole = (rear_toe[0] - back) / biped.get_rod("ST").length_m
    loads = StanceLoads(*dynamics(*step.q, (1 - on_sole) * behind, on_sole * behind))

    points = whole * load - biped.compute_spin_moment(ca.vertcat(step.q.acceleration, SX(2, 1)))
    zmp = points / ca.fmax(force[1] - slope * force[0], biped.LEAST_LOAD * load)  # (eq. 49)
    return loads, zmp, ca.vertcat(double * rear, toe[0])


def make_place_function(measure: Callable[[Mapping[str, SX], Stair[SX]], SX], ops: Nonsmooth) -> ca.Function:
    """Return the function of a measure of points by name and the stair; inputs of ``make_step_symbols``."""
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
    plan, stair = StairPlan(*ca.vertsplit(values)), Stair(size[0], size[1])
    rates = passing / plan.durations
    step = planned.compute_posture(plan, stair, s, rates, margin, ops)
    return [s, passing, values, size, margin], plan, stair, step
