"""NAO on its left foot with free joints between the paper's ends: the lower bound of all plans of hip, foot and arms.

Each joint's angle is a cubic between the ends plus a spline that leaves the ends unchanged. At both ends the robot has the
paper's pose: torso upright at the paper's hip positions with the hip's velocities as variables, both soles flat and at rest, arms
at rest. In between all joints of the legs are free, including the coupled yaw-pitch of the hips, and those of the arms that the
paper swings: the torso leans and turns, the swing foot tilts and leaves its line.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Array, GaitProblem, Grid, InstantPoint, Point
from nlp_gait.gaits.biped import limits
from nlp_gait.gaits.biped.body import LIFT, Support, read_duration
from nlp_gait.gaits.biped.curves import SPANS, Splines, Trajectory
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.recorded_motion import FreeParts, locate_free_parts
from nlp_gait.gaits.biped.samples import CORNERS, Instant, Samples
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.nao.body import ARM_SWING, NaoBody
from nlp_gait.gaits.nao.joints import HELD_ARM_ANGLES, JOINTS, KNEES, PLANNED_JOINTS, YAW_PITCHES
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.tape import simplify, tabulate_last_input
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, cubic, fit_spline

YAW_PITCH = "HipYawPitch"  # curve of both hips
CURVES = (YAW_PITCH, *PLANNED_JOINTS, *ARM_SWING[Support.SINGLE])
MOVING = (*YAW_PITCHES, *CURVES[1:])
OTHERS = (YAW_PITCHES[0], *ARM_SWING[Support.SINGLE])
OWN_ROWS = {"others": len(OTHERS), "along": 1, "sides": 2, "swing_heights": len(CORNERS)}  # that planned motions lack
# Quantities that follow from the joints' motion at one sample, in the order in which gradient solvers get them as variables.
OF_SAMPLE = ("torque", "zmp", "along", "swing_heights", "sides", "hip", "wrench_L", "wrench_R")
FIT_FACTOR = 40  # samples of a planned motion, in each of its own, to which free joints are fitted


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMotion:
    """Joint angles as splines."""

    paper: Phase  # the paper's phase, which defines the ends, for a body none of whose links stays upright
    splines: Splines  # on every curve
    support: tuple[float, float, float]  # (3,) the left ankle, which stands [m]

    def joints(self, at: InstantPoint, phase: SX, ops: Nonsmooth) -> dict[str, Motion]:
        """Return the motion of every joint [rad]."""
        duration = read_duration(at, Support.SINGLE)
        start, end = (self.paper.plan(at, SX(instant), ops).joints for instant in (0, 1))
        more = self.splines.motions(at, duration, phase)
        moved: dict[str, Motion] = {}
        for name in MOVING:
            a, b = start[name], end[name]
            hermite = cubic(a.position, b.position, a.velocity, b.velocity, duration, phase)
            moved[name] = add_motions(hermite, more[YAW_PITCH if name in YAW_PITCHES else name])
        return {**start, **moved}

    def plan(self, at: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
        """Return the motion of the whole robot."""
        joints = self.joints(at, phase, ops)
        body = self.body({name: motion.position for name, motion in joints.items()})
        return Instant(
            joints=joints,
            hip=body.torso,
            ankles={"L": SX(DM(self.support)), "R": body.ankle},
            reach=ca.vertcat(*(ca.cos(joints[knee].position) for knee in KNEES)),
        )

    def body(self, q: Mapping[str, SX]) -> FreeParts:
        """Return the places of torso and right foot for angles by joint name."""
        return locate_free_parts(self.paper.body.robot, q, self.support)

    def make_instant_function(self, names: Sequence[str]) -> ca.Function:
        """Return the function of one sample: from angles, velocities and accelerations (45,) to quantities by name."""
        rows = len(CURVES)
        v = SX.sym("v", 3 * rows)
        joints = {name: constant_motion(angle) for name, angle in HELD_ARM_ANGLES.items()}
        for row, curve in enumerate(CURVES):
            motion = Motion(*(v[order * rows + row] for order in range(3)))
            joints |= dict.fromkeys(YAW_PITCHES if curve == YAW_PITCH else (curve,), motion)
        body = self.body({name: motion.position for name, motion in joints.items()})
        loads = self.paper.loads(Instant(joints=joints, hip=body.torso, ankles={"L": SX(DM(self.support))}))
        known = {
            "torque": ca.vertcat(*(loads.torques[name] for name in JOINTS)),
            "zmp": loads.zmp,
            "along": body.ankle[0],
            "swing_heights": body.corners[2, :].T,
            "sides": body.corners[1, 1::2].T,
            "hip": body.torso,
            **{f"wrench_{side}": wrench for side, wrench in loads.wrenches.items()},
        }
        return ca.Function("instant", [v], simplify([known[name] for name in names]))


@dataclass(frozen=True, kw_only=True, eq=False)
class FreePhase(Phase):
    """A phase on the left foot whose joints are free."""

    free: FreeMotion

    def sample(self, at: Point, ops: Nonsmooth, phases: MX | None = None) -> Samples:
        """Evaluate the phase at its samples, or at other phases (1, k).

        The joints' motion becomes variables of gradient solvers, because torques are far from linear in it and it is linear in
        most of the many variables; so does what follows from it at each sample, before limits join samples.

        Quantities besides those of all phases: ``others`` (5, N + 1), angles of the hips' yaw-pitch and of the arms, rows as
        ``OTHERS`` [rad]; ``along`` (1, N + 1), x of the right ankle [m]; ``sides`` (2, N + 1), y of the left corners of the
        right sole [m].
        """
        n = self.grid.parts + 1 if phases is None else int(phases.shape[1])
        x, margin, s = SX.sym("x", len(self.variables)), SX.sym("margin"), SX.sym("s")
        joints = self.free.joints(InstantPoint.of(x, margin, self.names, [limits.REACH_MARGIN]), s, ops)
        moved = ca.vertcat(*(joints[name][order] for order in range(3) for name in MOVING[1:]))
        motion = ca.Function("motion", [x, margin, s], [ca.cse(moved)])
        motion, table = (
            tabulate_last_input(motion, DM(np.linspace(0.0, 1.0, n)).T) if phases is None else (motion, phases)
        )
        values = motion.map(n)(ca.repmat(at.x, 1, n), ca.repmat(at[limits.REACH_MARGIN], 1, n), table)
        motions = tie_entries(values, ops)
        names = [name for name in OF_SAMPLE if name in ("torque", "zmp") or name in self._names_read]
        tied = {
            name: tie_entries(part, ops)
            for name, part in zip(names, self.free.make_instant_function(names).map(n)(motions), strict=True)
        }
        rows = (dict(zip(CURVES, ca.vertsplit(part), strict=True)) for part in ca.vertsplit(motions, len(CURVES)))
        q, qd, qdd = ({n: part[YAW_PITCH if n in YAW_PITCHES else n] for n in MOVING} for part in rows)
        return Samples(
            joints=JOINTS,
            moving=MOVING,
            standing=self.standing,
            grid=self.grid if phases is None else Grid(intervals=n - 1),
            duration=at[self.duration],
            progress=self.grid.progress if phases is None else phases,
            values={
                **tied,
                "planned": ca.vertcat(*(q[name] for name in PLANNED_JOINTS)),
                "reach": ca.cos(ca.vertcat(*(q[knee] for knee in KNEES))),
                "power": ca.vertcat(*(qd[name] * tied["torque"][JOINTS.index(name), :] for name in MOVING)),
                "q": ca.vertcat(*q.values()),
                "qd": ca.vertcat(*qd.values()),
                "qdd": ca.vertcat(*qdd.values()),
                "others": ca.vertcat(*(q[name] for name in OTHERS)),
            },
        )

    def count_rows(self, name: str) -> int:
        return OWN_ROWS[name] if name in OWN_ROWS else super().count_rows(name)


class FreeLimits(limits.Limit):
    """Limits that planned motions keep by construction: joints, the swing foot's height, and its side of the other foot [m]."""

    def __init__(self, robot: Robot, path_middle: float, inner_edge: float) -> None:
        self._robot, self._path_middle, self._inner_edge = robot, path_middle, inner_edge

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> limits.RowsAndIndexes:
        middle = samples.steps // 2  # the number of samples is odd
        heights, aside = samples.swing_heights, self._inner_edge - samples.read("sides")[:, 1:-1]
        return (
            limits.make_angle_rows("other_angle", self._robot, OTHERS, samples.read("others")[:, 1:-1]),
            limits.make_rows_at_samples("foot_height", "m", heights[:, 1:-1], CORNERS, MX(0.0), first=1),
            *limits.make_halfway_rows(
                samples.read("along")[middle], self._path_middle, heights[:, middle], at[LIFT], CORNERS
            ),
            limits.make_rows_at_samples("feet_apart", "m", aside, CORNERS[1::2], MX(0.0), first=1),
        ), {}


def make_free_single_support_phase(body: NaoBody, step_m: float, trajectory: Trajectory, grid: Grid) -> FreePhase:
    """Return single support with free joints between the ends of the paper's; one sample of the grid is the middle."""
    body = replace(body, upright=frozenset())
    paper = make_support_phase(body, Support.SINGLE, step_m, "cubic", grid, Goal())
    splines = Splines(trajectory=trajectory, units=dict.fromkeys(CURVES, "rad"))
    _, left_y, _ = support = (step_m, *body.ankle("L"))
    motion = FreeMotion(paper=paper, splines=splines, support=support)
    return FreePhase(
        body=body,
        variables=(*paper.variables, *splines.variables),
        duration=paper.duration,
        plan=motion.plan,
        loads=paper.loads,
        grid=grid,
        limits=(*paper.limits, FreeLimits(body.robot, step_m, left_y - body.robot.feet["left"].right_m)),
        standing=paper.standing,
        free=motion,
        kinks=splines.kinks,
    )


def fit_joints(trajectory: Trajectory, planned: GaitProblem, x: Array) -> Array:
    """Return the point (n,) of free joints whose motion is nearest to a motion x of ``nao_ssp`` with the same robot and step."""
    own = x[: sum("[" not in name for name in planned.names)]
    spans = SPANS[trajectory]
    if spans == 0:
        return own
    dense = planned.dense(FIT_FACTOR)
    assert dense is not None  # a phase has one; for the type checker
    signals = dense.signals(x)
    t, q, qd = (signals.arrays[name] for name in ("t", "q", "qd"))
    phases, s = t / t[-1], SX.sym("s")
    start, end, v0, v1 = (SX(DM(row)) for row in (q[0], q[-1], qd[0], qd[-1]))
    hermite = ca.Function("hermite", [s], [cubic(start, end, v0, v1, SX(float(t[-1])), s).position])
    straight = np.array(hermite.map(len(phases))(DM(phases).T).full())
    columns = dict(zip(signals.joints, fit_spline(q - straight.T, spans, phases).T, strict=True))
    columns[YAW_PITCH] = np.mean([columns[name] for name in YAW_PITCHES], axis=0)
    return np.concatenate([own, *(columns[curve] for curve in CURVES)])


def tie_entries(values: MX, ops: Nonsmooth) -> MX:
    """Return a matrix whose entries are variables of a gradient solver (see ``Nonsmooth.tie``)."""
    return ca.reshape(ops.tie(ca.vec(values)), *values.shape)
