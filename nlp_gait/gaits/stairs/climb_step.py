"""One step of a climb at least effort: quantised dynamics, feet, loads and the ground's forces at all instants."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Array
from nlp_gait.formulation.assembly import Constraint, Point, make_parameters
from nlp_gait.formulation.blocks import Block, Layout
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.display import StepMotion, make_standing_step
from nlp_gait.gaits.stairs.planar_biped import MOVING, StanceLoads

AXES = ("x", "z")
RATE_LIMIT, ACCELERATION_LIMIT = 12.0, 80.0  # [rad/s], [rad/s^2]
FORCE_LIMITS = ((-600.0, 600.0), (0.0, 900.0))  # of the ground on a point of the rear foot, along x and z [N]
# A start point: noise on the link angles [rad], and the rear foot's share of the load [N].
NOISE, TOE_LOAD, SOLE_LOAD = 0.02, 250.0, 100.0
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


def make_climb_step(intervals: int, behind: int = 1, ahead: int = 1) -> "ClimbStep":
    """Return a step whose rear sole and toe lift when the paper's do, in proportion to its time; see ``ClimbStep``."""
    sole_off, toe_off, _, end = stair.PAPER_TIMES
    lifts = [max(1, round(time / end * intervals)) for time in (sole_off, toe_off)]
    return ClimbStep(intervals=intervals, sole_off=lifts[0], toe_off=lifts[1], behind=behind, ahead=ahead)


@dataclass(frozen=True, kw_only=True, eq=False)
class ClimbStep:
    """One step as a trajectory optimisation.

    States are angles and rates of the seven links that move while the stance foot stands flat; controls are their
    accelerations and the ground's forces on sole and toe of the rear foot.
    """

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
        }
        return step * effort, rows, indexes

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
        """Swing toe and ankle (2,) from the stance ankle [m]."""
        q = SX.sym("q", len(MOVING))
        places = biped.locate_points(biped.link_angles(q), SX(2, 1))
        return ca.Function("places", [q], ca.cse([places["T"], places["A"]]))

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
        swing_toe, ankle = self._instant.map(n + 1)(q)
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


def make_equal_rows(
    name: str, value: MX, of: tuple[str, ...], columns: range | tuple[int, ...], unit: str, scale: float
) -> Constraint:
    """Return rows value == 0."""
    return stair.make_rows(name, value, of, unit, scale, lower=0.0, upper=0.0, columns=columns)
