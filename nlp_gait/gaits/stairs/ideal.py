"""Climbing one step at least effort: full trajectory optimisation."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from math import inf

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import check_count
from nlp_gait.formulation import Array, Display, GaitProblem, Grid, Signals, SolverHints, maker
from nlp_gait.formulation.assembly import Assembly, Constraint, NumericPoint, Objective, Point, make_parameters
from nlp_gait.formulation.blocks import Block, Layout
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.display import StepMotion, make_simulation_model, make_skeleton, make_standing_step
from nlp_gait.gaits.stairs.planar_biped import JOINTS, MOVING, StanceLoads
from nlp_gait.gaits.stairs.planned_motion import Stair, StairPlan, compute_heights, compute_posture
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

EDGE_WIDTH = 0.012  # of the sigmoid that replaces an edge of the stair [m]
AXES = ("x", "z")
RATE_LIMIT, ACCELERATION_LIMIT = 12.0, 80.0  # [rad/s], [rad/s^2]
FORCE_LIMITS = ((-600.0, 600.0), (0.0, 900.0))  # of the ground on a point of the rear foot, along x and z [N]
# A start point: noise on the link angles [rad], and the rear foot's share of the load [N].
NOISE, TOE_LOAD, SOLE_LOAD = 0.02, 250.0, 100.0
# A plan whose legs reach on common stairs; neither optimal nor balanced.
PLAN = {
    "hip_height": 0.66,
    "zmp_start": 0.18,
    "zmp_end": 0.05,
    "end_rate": 2.0,
    "torso_pitch": 1.35,
    "foot_pitch": 0.0,
    "sole_angle": np.pi / 6,
    "toe_angle": np.pi / 6,
    "catch_angle": 0.01,
    **dict(zip(("t1", "t2", "t_bc", "t3"), stair.PAPER_TIMES, strict=True)),
}
HIP_BEHIND = 0.08  # of the hip at the start, from the middle of the rear tread [m]
REACH_MARGIN = 0.02  # on the cosine of a knee: avoids stretched legs at the start
FINE_INTERVALS = 1000  # of a simulated gait

PARAMETERS = (
    *stair.STAIR_PARAMETERS,
    *make_parameters(
        ("step_time_s", "s", 3.5, "t3, time of the step", 0.1, inf),
        ("torque_weight", "1/(N m)^2/s", 0.01, "cost of squared torque", 0.0, inf),
        ("acceleration_weight", "s^3/rad^2", 1e-3, "cost of squared link acceleration", 0.0, inf),
        ("friction", "1", 0.6, "mu below the rear foot", 0.0, inf),
        ("stance_friction", "1", 10.0, "mu below the stance foot; the default does not bind", 0.0, inf),
        stair.LEAST_STANCE_FORCE,
        ("zmp_margin_m", "m", 0.0, "least distance of the stance foot's ZMP from its ends", 0.0, 0.08),
        ("clearance_m", "m", -0.002, "least height of foot points above the smoothed stair", -inf, inf),
    ),
)


@maker
def stairs_ideal(*, intervals: int = 70) -> GaitProblem:
    """Return the trajectory optimisation of one step, which starts and ends at rest on flat feet.

    States are angles and rates of the seven links that move while the stance foot stands flat; controls are their
    accelerations and the ground's forces on sole and toe of the rear foot.

    Args:
        intervals: equal parts of the step, at least 10.

    Source:
        Robot, stair and phases of Bhardwaj et al.; the formulation is this package's own.
    """
    intervals = check_count("intervals", intervals, at_least=10)
    step = make_ideal_step(intervals)
    model = make_simulation_model(step.simulate, repeats=True)
    return GaitProblem(
        name="stairs-ideal",
        title="Stairs, full trajectory optimisation: least effort",
        variables=step.layout.variables,
        own_parameters=PARAMETERS,
        objective=Objective(name="effort", unit="1"),
        assemble=step.assemble,
        grid=Grid(intervals=intervals),
        display=Display(motion=step.compute_signals, skeleton=make_skeleton, simulation_model=model),
        hints=SolverHints(start=step.start, starts=3, searchable=False),
    )


def make_ideal_step(intervals: int, behind: int = 1, ahead: int = 1) -> "IdealStep":
    """Return a step whose rear sole and toe lift when the paper's do, in proportion to its time; see ``IdealStep``."""
    sole_off, toe_off, _, end = stair.PAPER_TIMES
    lifts = [max(1, round(time / end * intervals)) for time in (sole_off, toe_off)]
    return IdealStep(intervals=intervals, sole_off=lifts[0], toe_off=lifts[1], behind=behind, ahead=ahead)


@dataclass(frozen=True, kw_only=True, eq=False)
class IdealStep:
    """One step as a trajectory optimisation."""

    intervals: int  # N, equal parts of the step
    sole_off: int  # number of intervals with load on the rear sole
    toe_off: int  # number of intervals with load on the rear toe: the double support
    behind: int = 1  # steps by which the rear ankle is behind and below the stance ankle at the start
    ahead: int = 1  # steps by which it is ahead and above at the end

    @cached_property
    def layout(self) -> Layout:
        """Variables: angles and rates at all instants; accelerations and ground forces constant during an interval."""
        angles = tuple(stair.ANGLE_LIMITS[link] for link in MOVING)
        rates = ((-RATE_LIMIT, RATE_LIMIT),) * len(MOVING)
        accelerations = ((-ACCELERATION_LIMIT, ACCELERATION_LIMIT),) * len(MOVING)
        table = (
            ("angle", "rad", MOVING, self.intervals + 1, angles, "absolute angle of link"),
            ("rate", "rad/s", MOVING, self.intervals + 1, rates, "rate of link"),
            ("acceleration", "rad/s^2", MOVING, self.intervals, accelerations, "acceleration of link"),
            ("toe_force", "N", AXES, self.toe_off, FORCE_LIMITS, "force of the ground on the rear toe along"),
            ("sole_force", "N", AXES, self.sole_off, FORCE_LIMITS, "force of the ground on the rear sole along"),
        )
        return Layout(
            blocks=tuple(
                Block(quantity=quantity, unit=unit, rows=rows, columns=columns, limits=limits, description=description)
                for quantity, unit, rows, columns, limits, description in table
            )
        )

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return objective and constraints; everything is smooth."""
        x = self.layout.split(point)
        motion, n = self.limit_motion(x, point), self.intervals
        torso = x["rate"][MOVING.index("UH"), 1:n]
        at_rest = make_equal_rows("rest", x["rate"][:, [0, n]], MOVING, (0, n), "rad/s", 1.0)
        still = make_equal_rows("torso_still", torso, ("UH",), range(1, n), "rad/s", 1.0)
        objective, loads, indexes = self.load(x, point)
        return Assembly(
            objective=objective,
            constraints=(*motion, at_rest, still, *self.place_feet(x, point), *self._clear_stair(x, point), *loads),
            indexes=indexes,
        )

    def load(self, x: Mapping[str, MX], point: Point) -> tuple[MX, tuple[Constraint, ...], dict[str, MX]]:
        """Return the effort, rows of forces, pressure and knees, and indexes."""
        step = point["step_time_s"] / self.intervals
        torque, stance, pressure = self.compute_loads(x)
        effort = point["torque_weight"] * ca.sumsqr(torque)
        effort += point["acceleration_weight"] * ca.sumsqr(x["acceleration"])
        rate = DM(biped.JOINT_RATES) @ (x["rate"][:, 1:] + x["rate"][:, :-1]) / 2
        rows = (
            stair.limit_grip("friction_toe", x["toe_force"], point["friction"]),
            stair.limit_grip("friction_sole", x["sole_force"], point["friction"]),
            stair.limit_grip("friction_stance", stance, point["stance_friction"]),
            stair.limit_stance_load(point, stance),
            stair.limit_stance_zmp(point, pressure),
            stair.limit_knees("knee", x["angle"]),
        )
        indexes = {
            "energy_J": step * ca.sum1(ca.fabs(ca.vec(torque * rate))),
            "peak_torque_Nm": ca.norm_inf(ca.vec(torque)),
            "torso_pitch_rad": x["angle"][MOVING.index("UH"), 0],
        }
        return step * effort, rows, indexes

    def compute_signals(self, point: NumericPoint) -> Signals:
        """Return time histories; values of intervals are those of their first instants, the last instant repeats the last one."""
        values = self.layout.values(point.x.full().ravel())
        symbolic = self.compute_loads({name: MX(DM(value)) for name, value in values.items()})
        intervals = [*(np.array(ca.evalf(columns)) for columns in symbolic), values["acceleration"]]
        torque, force, pressure, acceleration = (
            np.concatenate([columns, columns[:, -1:]], axis=1).T for columns in intervals
        )
        return Signals(
            joints=JOINTS,
            arrays={
                "t": np.linspace(0.0, float(point["step_time_s"]), self.intervals + 1),
                **stair.make_joint_signals(values["angle"].T, values["rate"].T, acceleration),
                "tau": torque,
                "stance_force": force,
                "zmp": pressure[:, 0],
            },
            columns=stair.COLUMNS,
        )

    def simulate(self, point: NumericPoint) -> StepMotion:
        """Return the step on a fine grid, for the engine."""
        return self.refine(self.layout.values(point.x.full().ravel()), float(point["step_time_s"]))

    def refine(self, values: Mapping[str, Array], duration_s: float) -> StepMotion:
        """Return the step of the blocks' values on a fine grid."""
        step = duration_s / self.intervals
        per_interval = math.ceil(FINE_INTERVALS / self.intervals)
        since = np.tile(np.arange(per_interval) * step / per_interval, self.intervals)
        # The last instant ends the last interval.
        which = np.append(np.repeat(np.arange(self.intervals), per_interval), self.intervals - 1)
        since = np.append(since, step)[:, None]
        q, qd, qdd = (values[name].T[which] for name in ("angle", "rate", "acceleration"))

        def expand_force(name: str) -> Array:
            force = np.zeros((self.intervals, 2))
            force[: values[name].shape[1]] = values[name].T
            return force[which]

        return make_standing_step(
            which * step + since[:, 0],
            q + qd * since + qdd * since**2 / 2,
            qd + qdd * since,
            qdd,
            expand_force("toe_force"),
            expand_force("sole_force"),
            self.toe_off * step,
        )

    def start(self, values: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Return planned angles with noise, rates and accelerations by differences, and a part of the load on the rear foot."""
        tread = values["stair_length_m"] / 2
        ends = np.array([0.0, *stair.PAPER_TIMES])
        times = np.linspace(0.0, ends[-1], self.intervals + 1)
        fractions = np.clip((times - ends[:-1, None]) / np.diff(ends)[:, None], 0.0, 1.0)
        size = np.tile([[tread], [values["rise_run_ratio"] * tread]], self.intervals + 1)
        angle = np.array(_make_angles_function().map(self.intervals + 1)(size, fractions))
        angle += NOISE * rng.standard_normal(angle.shape)
        return self.join_start(angle, values["step_time_s"])

    def join_start(self, angle: Array, duration_s: float) -> Array:
        """Return the start point of link angles (7, n + 1) over equal times, with a part of the load on the rear foot."""
        step = duration_s / self.intervals
        rate = np.gradient(angle, step, axis=1)
        return self.layout.join(
            {
                "angle": angle,
                "rate": rate,
                "acceleration": np.diff(rate, axis=1) / step,
                "toe_force": np.tile([[0.0], [TOE_LOAD]], self.toe_off),
                "sole_force": np.tile([[0.0], [SOLE_LOAD]], self.sole_off),
            }
        )

    def compute_loads(self, x: Mapping[str, MX]) -> StanceLoads[MX]:
        """Return joint torques and ground reaction in each interval."""
        n = self.intervals
        toe, sole = (ca.horzcat(x[force], MX(2, n - x[force].shape[1])) for force in ("toe_force", "sole_force"))
        at_intervals = biped.make_loads("T", "S").map(n)
        return StanceLoads(*at_intervals(x["angle"][:, :n], x["rate"][:, :n], x["acceleration"], toe, sole))

    @cached_property
    def _instant(self) -> ca.Function:
        """Swing toe, ankle and hip (2,) from the stance ankle, and heights (3,) of toe, sole and ankle above the stair [m]."""
        q, size = SX.sym("q", len(MOVING)), SX.sym("size", 2)
        places = biped.locate_points(biped.link_angles(q), SX(2, 1))
        heights = compute_heights(places, Stair(size[0], size[1]), stair.SETBACK, EDGE_WIDTH)
        return ca.Function("places", [q, size], ca.cse([*(places[name] for name in "TAH"), heights]))

    def limit_motion(self, x: Mapping[str, MX], point: Point) -> tuple[Constraint, ...]:
        """Return rows of the quantised dynamics (eqs. 44, 45)."""
        n, step = self.intervals, point["step_time_s"] / self.intervals
        q, v, a = x["angle"], x["rate"], x["acceleration"]
        rates = v[:, 1:] - v[:, :n] - a * step  # (eq. 44)
        angles = q[:, 1:] - q[:, :n] - v[:, :n] * step - 0.5 * a * step**2  # (eq. 45)
        steps = range(1, n + 1)
        return (
            make_equal_rows("rate_continuity", rates, MOVING, steps, "rad/s", 1.0),
            make_equal_rows("angle_continuity", angles, MOVING, steps, "rad", 0.1),
        )

    def place_feet(self, x: Mapping[str, MX], point: Point) -> tuple[Constraint, ...]:
        """Return rows of the swing foot's positions."""
        n, lift = self.intervals, self.toe_off
        size = ca.vertcat(*stair.read_stair(point))
        q = x["angle"]
        swing_toe, ankle, *_ = self._instant.map(n + 1)(q, ca.repmat(size, 1, n + 1))
        flat = q[[MOVING.index("AS"), MOVING.index("ST")], :]
        rear = self.behind * size
        toe = swing_toe[:, 1 : lift + 1] - ca.repmat(ca.vertcat(biped.load_toe_foot_biped().foot_m, 0) - rear, 1, lift)
        ends = ca.horzcat(ankle[:, 0] + rear, ankle[:, n] - self.ahead * size)
        return (
            make_equal_rows("toe_stands", toe, AXES, range(1, lift + 1), "m", 0.01),
            make_equal_rows(
                "toe_flat", flat[1, 1 : self.sole_off + 1], ("ST",), range(1, self.sole_off + 1), "rad", 0.1
            ),
            make_equal_rows("foot_flat", flat[:, [0, n]], ("AS", "ST"), (0, n), "rad", 0.1),
            make_equal_rows("ankle_on_step", ends, AXES, (0, n), "m", 0.01),
        )

    def _clear_stair(self, x: Mapping[str, MX], point: Point) -> tuple[Constraint, ...]:
        """Return rows of the hip's advance and of the swing foot's height above the stair."""
        n, lift = self.intervals, self.toe_off
        size = ca.vertcat(*stair.read_stair(point))
        *_, hip, heights = self._instant.map(n + 1)(x["angle"], ca.repmat(size, 1, n + 1))
        advance = hip[:, n] - hip[:, 0] - size
        in_support, in_swing = range(lift), range(lift + 1, n + 1)

        def above(name: str, heights: MX, points: tuple[str, ...], instants: range) -> Constraint:
            return stair.make_rows(name, heights, points, "m", 0.01, lower=point["clearance_m"], columns=instants)

        return (
            make_equal_rows("hip_advance", advance, AXES, (n,), "m", 0.01),
            above("clearance_in_support", heights[1:, :lift], ("sole", "ankle"), in_support),
            above("clearance_in_swing", heights[:, lift + 1 :], ("toe", "sole", "ankle"), in_swing),
        )


def make_equal_rows(
    name: str, value: MX, of: tuple[str, ...], columns: range | tuple[int, ...], unit: str, scale: float
) -> Constraint:
    """Return rows value == 0."""
    return stair.make_rows(name, value, of, unit, scale, lower=0.0, upper=0.0, columns=columns)


@cache
def _make_angles_function() -> ca.Function:
    """Function (tread and rise (2,), fractions of the phases (4,)) to link angles (7,)."""
    size, s = SX.sym("size", 2), SX.sym("s", 4)
    plan = StairPlan(hip_start=size[0] / 2 - HIP_BEHIND, **{name: SX(value) for name, value in PLAN.items()})
    posture = compute_posture(plan, Stair(size[0], size[1]), s, SX(4, 1), SX(REACH_MARGIN), Exact())
    return ca.Function("angles", [size, s], [posture.q.position])
