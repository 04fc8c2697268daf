"""One step of a climb at least effort: quantised dynamics, feet, loads and the ground's forces at all instants."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation.assembly import Constraint, Point, Variable, make_parameters, make_variables
from nlp_gait.formulation.signals import Array
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.display import StepMotion, make_standing_step
from nlp_gait.gaits.stairs.planar_biped import MOVING, StanceLoads
from nlp_gait.gaits.stairs.planned_motion import Stair, StepKind, compute_heights, compute_shank_gaps


@dataclass(frozen=True, kw_only=True)
class Block:
    """Variables ``<quantity>_<row>_<unit>[<column>]``, for example ``angle_HK_rad[12]``."""

    quantity: str  # for example ``"angle"``
    unit: str  # of all values, for example ``"rad/s^2"``
    rows: tuple[str, ...]  # names of the rows
    columns: int  # number of columns
    limits: tuple[tuple[float, float], ...]  # lower and upper bound of every row [unit]
    description: str  # of a row

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables, column by column."""
        suffix = self.unit.replace("/", "_").replace("^", "")
        text = self.description
        table = (
            (f"{self.quantity}_{row}_{suffix}[{k}]", self.unit, *ends, f"{text} {row} at instant {k}")
            for k in range(self.columns)
            for row, ends in zip(self.rows, self.limits, strict=True)
        )
        return make_variables(*table)

    @property
    def size(self) -> int:
        """Number of variables."""
        return len(self.rows) * self.columns


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Layout of x: consecutive blocks."""

    blocks: tuple[Block, ...]  # in the order of x

    @property
    def variables(self) -> tuple[Variable, ...]:
        """All variables in the order of x."""
        return tuple(variable for block in self.blocks for variable in block.variables)

    def split(self, point: Point) -> dict[str, MX]:
        """Return the symbols of each block by quantity, (rows, columns)."""
        ends = np.cumsum([0, *(block.size for block in self.blocks)])
        columns = ca.vertsplit(point.x, [int(end) for end in ends])
        return {
            block.quantity: ca.reshape(column, len(block.rows), block.columns)
            for block, column in zip(self.blocks, columns, strict=True)
        }

    def values(self, x: Array) -> dict[str, Array]:
        """Return the values of each block by quantity, (rows, columns), from x (n,)."""
        ends = np.cumsum([block.size for block in self.blocks])[:-1]
        return {
            block.quantity: values.reshape(block.columns, len(block.rows)).T
            for block, values in zip(self.blocks, np.split(x, ends), strict=True)
        }

    def join(self, values: Mapping[str, Array]) -> Array:
        """Return x (n,) from the values of each block (rows, columns)."""
        return np.concatenate([values[block.quantity].T.ravel() for block in self.blocks])


AXES, FOOT_POINTS = ("x", "z"), ("toe", "sole", "ankle")
RATE_LIMIT, ACCELERATION_LIMIT = 12.0, 80.0  # [rad/s], [rad/s^2]
FORCE_LIMITS = ((-600.0, 600.0), (0.0, 900.0))  # of the ground on a point of the rear foot, along x and z [N]
EDGE_RESERVE = 0.01  # by which edges are nearer than the steps' [m]; they are rounded over ``stair.EDGE_WIDTH``
RAMP = 0.1  # share of the swing over which the clearance grows, and falls again
ROUNDING = 2e-3  # height of a rounded edge below a foot that stands before it [m]
# A start point: hip ahead of the rear ankle and above it where two steps meet, and above the ankles of the standing robot [m];
# the torso's pitch [rad]; height of the swing above the higher step [m].
HIP_BETWEEN, HIP_STANDING, TORSO, LIFT = (0.10, 0.68), (0.06, 0.70), 1.35, 0.06
# Noise on its link angles [rad], and the rear foot's share of the load [N].
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


@dataclass(frozen=True, kw_only=True, eq=False)
class ClimbStep:
    """One step as a trajectory optimisation.

    States are angles and rates of the seven links that move while the stance foot stands flat; controls are their
    accelerations and the ground's forces on sole and toe of the rear foot.
    """

    intervals: int  # N, equal parts of the step
    behind: int  # steps by which the rear ankle is behind and below the stance ankle at the start
    ahead: int  # steps by which it is ahead and above at the end

    @property
    def sole_off(self) -> int:
        """Number of intervals with load on the rear sole, which lifts when the paper's does, in proportion to the time."""
        return self._find_lift(0)

    @property
    def toe_off(self) -> int:
        """Number of intervals with load on the rear toe: the double support."""
        return self._find_lift(1)

    def _find_lift(self, phase: int) -> int:
        return max(1, round(stair.PAPER_TIMES[phase] / stair.PAPER_TIMES[-1] * self.intervals))

    @property
    def kind(self) -> StepKind:
        """Which ground it passes."""
        return "next" if self.behind else "first"

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

    def assemble(self, x: Mapping[str, MX], point: Point) -> tuple[MX, tuple[Constraint, ...], dict[str, MX]]:
        """Return the effort, all rows, and metrics."""
        step = point["step_time_s"] / self.intervals
        torque, stance, pressure = self.compute_loads(x)
        effort = point["torque_weight"] * ca.sumsqr(torque)
        effort += point["acceleration_weight"] * ca.sumsqr(x["acceleration"])
        rate = DM(biped.JOINT_RATES) @ (x["rate"][:, 1:] + x["rate"][:, :-1]) / 2
        rows = (
            *self._limit_motion(x, point),
            stair.limit_grip("friction_toe", x["toe_force"], point["friction"]),
            stair.limit_grip("friction_sole", x["sole_force"], point["friction"]),
            stair.limit_grip("friction_stance", stance, point["stance_friction"]),
            stair.limit_stance_load(point, stance),
            stair.limit_stance_zmp(point, pressure),
            stair.limit_knees("knee", x["angle"]),
        )
        metrics = {
            "energy_J": step * ca.sum1(ca.fabs(ca.vec(torque * rate))),
            "peak_torque_Nm": ca.norm_inf(ca.vec(torque)),
        }
        return step * effort, rows, metrics

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

    def start(self, size: Array, duration_s: float, rng: np.random.Generator) -> Array:
        """Return a start point on steps of tread and rise (2,) [m]."""
        n = self.intervals
        s = np.linspace(0.0, 1.0, n + 1)[:, None]
        smooth = s**2 * (3 - 2 * s)
        between = np.array(HIP_BETWEEN)
        first, last = (between - size if self.behind else HIP_STANDING), (between if self.ahead else HIP_STANDING)
        hip = first + smooth * (np.array(last) - first)
        swing = np.clip((s[:, 0] - self.toe_off / n) / (1 - self.toe_off / n), 0.0, 1.0)
        way = (self.behind + self.ahead) * size
        late, early = (np.interp(swing, ends, (0.0, 1.0)) for ends in ((0.25, 1.0), (0.0, 0.6)))
        late, early = (share**2 * (3 - 2 * share) for share in (late, early))
        ankle = np.column_stack([late * way[0], early * way[1] + LIFT * np.sin(np.pi * swing)]) - self.behind * size
        still = np.zeros(n + 1)
        legs = [*_reach(ankle - hip), *_reach(-hip)]
        angle = np.stack([*legs, still + TORSO, still, still])
        angle += NOISE * rng.standard_normal(angle.shape)
        step = duration_s / n
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

    def _limit_motion(self, x: Mapping[str, MX], point: Point) -> tuple[Constraint, ...]:
        """Return rows of the quantised dynamics (eqs. 44, 45), feet, shanks and standing ends."""
        n, step, lift = self.intervals, point["step_time_s"] / self.intervals, self.toe_off
        q, v, a = x["angle"], x["rate"], x["acceleration"]
        rates = v[:, 1:] - v[:, :n] - a * step  # (eq. 44)
        angles = q[:, 1:] - q[:, :n] - v[:, :n] * step - 0.5 * a * step**2  # (eq. 45)
        size = ca.vertcat(*stair.read_stair(point))
        heights, gaps, centre, ends, feet = make_instant(self.kind).map(n + 1)(q, v, ca.repmat(size, 1, n + 1))
        swing_toe, ankle = ca.vertsplit(feet, [0, 2, 4])
        flat = q[[MOVING.index("AS"), MOVING.index("ST")], :]
        rear = self.behind * size
        toe = swing_toe[:, 1 : lift + 1] - ca.repmat(ca.vertcat(biped.load_toe_foot_biped().foot_m, 0) - rear, 1, lift)
        placed = ca.horzcat(ankle[:, 0] + rear, ankle[:, n] - self.ahead * size)
        # The clearance grows and falls with the swing.
        swing = range(lift + 1, n + 1)
        share = np.array([min(k - lift, n - k) / (n - lift) / RAMP for k in swing]).clip(0.0, 1.0)
        least = ca.vec(ca.repmat(point["clearance_m"] * DM(share[None, :]), 3, 1)) - ROUNDING
        feet_still = v[[MOVING.index(link) for link in ("UH", "AS", "ST")], :][:, [0, n]]
        steps, soles = range(1, n + 1), range(1, self.sole_off + 1)
        rows = [
            make_equal_rows("rate_continuity", rates, MOVING, steps, "rad/s", 1.0),
            make_equal_rows("angle_continuity", angles, MOVING, steps, "rad", 0.1),
            make_equal_rows("toe_stands", toe, AXES, range(1, lift + 1), "m", 0.01),
            make_equal_rows("toe_flat", flat[1, 1 : self.sole_off + 1], ("ST",), soles, "rad", 0.1),
            make_equal_rows("foot_flat", flat[:, [0, n]], ("AS", "ST"), (0, n), "rad", 0.1),
            make_equal_rows("ankle_on_step", placed, AXES, (0, n), "m", 0.01),
            make_equal_rows("torso_still", v[MOVING.index("UH"), 1:n], ("UH",), range(1, n), "rad/s", 1.0),
            make_equal_rows("foot_still", feet_still, ("UH", "AS", "ST"), (0, n), "rad/s", 1.0),
            make_equal_rows("ankle_still", ends[4:6, [0, n]], AXES, (0, n), "m/s", 0.1),
            stair.make_rows("clearance_in_support", heights[1:, :lift], ("sole", "ankle"), "m", 0.01, lower=-ROUNDING),
            stair.make_rows(
                "clearance_in_swing", heights[:, lift + 1 :], FOOT_POINTS, "m", 0.01, lower=least, columns=swing
            ),
            stair.limit_shanks(gaps, self.kind),
        ]
        for instant, stands in ((0, not self.behind), (n, not self.ahead)):
            if stands:
                at_rest = make_equal_rows("rest", ends[2:4, instant], AXES, (instant,), "m/s", 0.1)
                rows += [at_rest, replace(stair.limit_stance_zmp(point, centre[:, instant]), name="standing")]
        return tuple(rows)


def make_equal_rows(
    name: str, value: MX, of: tuple[str, ...], columns: range | tuple[int, ...], unit: str, scale: float
) -> Constraint:
    """Return rows value == 0."""
    return stair.make_rows(name, value, of, unit, scale, lower=0.0, upper=0.0, columns=columns)


def make_instant(kind: StepKind) -> ca.Function:
    """Return the function (angles, rates (7,), tread and rise (2,)) of an instant.

    Its outputs are heights (3,) of swing toe, sole and ankle above the stair, the shanks' gaps, the centre of mass ahead of the
    stance ankle, place and velocity of the hip and velocity of the swing ankle (6,), and places of swing toe and ankle (4,) [m].
    """
    q, v, size = SX.sym("q", len(MOVING)), SX.sym("v", len(MOVING)), SX.sym("size", 2)
    points = biped.locate_points(biped.link_angles(q), SX(2, 1))
    steps, setback = Stair(size[0], size[1]), stair.SETBACK + EDGE_RESERVE
    heights = compute_heights(points, steps, setback, stair.EDGE_WIDTH, kind)
    robot = biped.load_toe_foot_biped()
    centres = biped.locate_centres(points)
    centre = sum((biped.get_rod(link).mass_kg * place[0] for link, place in centres.items()), SX(0)) / robot.mass_kg
    ends = ca.vertcat(points["H"], *(ca.jtimes(points[name], q, v) for name in "HA"))
    gaps = compute_shank_gaps(points, steps, stair.SETBACK, kind)
    outputs = [heights, gaps, centre, ends, ca.vertcat(points["T"], points["A"])]
    return ca.Function("instant", [q, v, size], ca.cse(outputs))


def _reach(ankle: Array) -> tuple[Array, Array]:
    """Return the angles (T,) of thigh and shank that bring the ankle to a place (T, 2) from the hip, the knee bent forward."""
    length = biped.get_rod("HK").length_m
    half = np.arccos(np.clip(np.hypot(*ankle.T) / (2 * length), 0.0, 0.99))
    direction = np.arctan2(-ankle[:, 1], ankle[:, 0])
    return direction - half, direction + half
