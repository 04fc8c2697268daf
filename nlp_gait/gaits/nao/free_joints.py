"""NAO on its left foot with free joints between the paper's ends: the lower bound of all plans.

Each joint's angle is a cubic between the ends plus a spline that leaves the ends unchanged. At both ends the robot has the
paper's pose: torso upright at the paper's hip positions with the hip's velocities as variables, both soles flat and at rest, arms
at rest. In between all joints of the legs are free, including the coupled yaw-pitch of the hips, and those of the arms that the
paper swings: the torso leans and turns, the swing foot tilts and leaves its line.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, InstantPoint, Point, maker
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped import limits
from nlp_gait.gaits.biped.body import LIFT, Support, read_duration
from nlp_gait.gaits.biped.curves import SPANS, Splines, Trajectory
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.problems import SPLINE_SAMPLES, GridOptions, StepOptions
from nlp_gait.gaits.biped.samples import CORNERS, Samples
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.nao.body import ARM_SWING, NaoBody
from nlp_gait.gaits.nao.joint_phase import JointPhase
from nlp_gait.gaits.nao.joints import HELD_ARM_ANGLES, PLANNED_JOINTS, YAW_PITCHES
from nlp_gait.gaits.nao.leaning_torso import make_leaning_nao
from nlp_gait.gaits.nao.problems import STEP_M, NaoOptions, PaperLoads, nao_ssp
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, cubic, fit_spline

YAW_PITCH = "HipYawPitch"  # curve of both hips
CURVES = (YAW_PITCH, *PLANNED_JOINTS, *ARM_SWING[Support.SINGLE])
MOVING = (*YAW_PITCHES, *CURVES[1:])
OTHERS = (YAW_PITCHES[0], *ARM_SWING[Support.SINGLE])
FIT_FACTOR = 40  # samples of a planned motion, in each of its own, to which free joints are fitted


@dataclass(frozen=True, kw_only=True, eq=False)
class FreePhase(JointPhase):
    """A phase on the left foot whose joints are free."""

    paper: Phase  # the paper's phase, which defines the ends, for a body none of whose links stays upright
    splines: Splines  # on every curve

    @property
    def moving(self) -> tuple[str, ...]:
        return MOVING

    def move(self, point: Point, ops: Nonsmooth, phases: MX | None = None) -> MX:
        x, margin, s = SX.sym("x", len(self.variables)), SX.sym("margin"), SX.sym("s")
        joints = self.list_motions(InstantPoint.of(x, margin, self.names, [limits.REACH_MARGIN]), s, ops)
        moved = ca.vertcat(*(joints[name][order] for order in range(3) for name in MOVING[1:]))
        (motions,) = self._map(ca.Function("motion", [x, margin, s], [ca.cse(moved)]), [point], phases=phases)
        return motions

    def list_motions(self, point: InstantPoint, phase: SX, ops: Nonsmooth) -> dict[str, Motion]:
        """Return the motions of the joints that move [rad]."""
        duration = read_duration(point, Support.SINGLE)
        start, end = (self.paper.plan(point, SX(instant), ops).joints for instant in (0, 1))
        added = self.splines.motions(point, duration, phase)
        moved: dict[str, Motion] = {}
        for name in MOVING:
            a, b = start[name], end[name]
            hermite = cubic(a.position, b.position, a.velocity, b.velocity, duration, phase)
            moved[name] = add_motions(hermite, added[YAW_PITCH if name in YAW_PITCHES else name])
        return moved

    def tie(self, values: MX, ops: Nonsmooth) -> MX:
        """Return a matrix whose entries become variables of gradient solvers (see ``Nonsmooth.tie``).

        Torques are far from linear in the joints' motion, and this is linear in most of the many variables.
        """
        return ca.reshape(ops.tie(ca.vec(values)), *values.shape)


class FreeLimits(limits.Limit):
    """Limits that planned motions keep by construction: the swing foot's height, and its side of the other foot [m]."""

    def __init__(self, path_middle: float, inner_edge: float) -> None:
        self._path_middle, self._inner_edge = path_middle, inner_edge

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> limits.RowsAndIndexes:
        middle = samples.steps // 2  # the number of samples is odd
        along, heights, sides = samples.read("along"), samples.swing_heights, samples.read("sides")
        return (
            limits.make_rows_at_samples("foot_height", "m", heights[:, 1:-1], CORNERS, MX(0.0), first=1),
            *limits.make_halfway_rows(along[middle], self._path_middle, heights[:, middle], point[LIFT], CORNERS),
            limits.make_rows_at_samples(
                "feet_apart", "m", self._inner_edge - sides[:, 1:-1], CORNERS[1::2], MX(0.0), first=1
            ),
        ), {}


def make_free_single_support_phase(body: NaoBody, step_m: float, trajectory: Trajectory, grid: Grid) -> FreePhase:
    """Return single support with free joints between the ends of the paper's; one sample of the grid is the middle."""
    body = replace(body, upright=frozenset())
    paper = make_support_phase(body, Support.SINGLE, step_m, "cubic", grid, Goal())
    splines = Splines(trajectory=trajectory, units=dict.fromkeys(CURVES, "rad"))
    _, left_y, _ = support = (step_m, *body.ankle("L"))
    own_limits = (
        limits.AngleLimits("other_angle", body.robot, OTHERS),
        FreeLimits(step_m, left_y - body.robot.feet["left"].right_m),
    )
    return FreePhase(
        body=body,
        variables=(*paper.variables, *splines.variables),
        duration=paper.duration,
        loads=paper.loads,
        grid=grid,
        limits=(*paper.limits, *own_limits),
        standing=paper.standing,
        support=support,
        curves={YAW_PITCH: YAW_PITCHES, **{name: (name,) for name in CURVES[1:]}},
        held=HELD_ARM_ANGLES,
        other_joints=OTHERS,
        paper=paper,
        splines=splines,
        kinks=splines.kinks,
    )


def fit_joints(trajectory: str, planned: GaitProblem, x: Array) -> Array:
    """Return the point (n,) of free joints whose motion is nearest to a motion x of ``nao_ssp`` with the same robot and step."""
    planned_x = x[: sum("[" not in name for name in planned.names)]
    spans = SPANS[trajectory]
    if spans == 0:
        return planned_x
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
    return np.concatenate([planned_x, *(columns[curve] for curve in CURVES)])


@dataclass(frozen=True, kw_only=True)
class FreeOptions(StepOptions, GridOptions):
    """A phase whose joints are free."""

    trajectory: Trajectory = "spline-4"
    step_length_m: float = STEP_M
    samples_per_interval: int = SPLINE_SAMPLES


@maker
def nao_ssp_free(robot: NaoOptions, options: FreeOptions) -> GaitProblem:
    """Single support of NAO with free joints. One of the samples must be the middle.

    Source:
        Ends, limits and objective of Gupta, Pratihar, Deb (2023), section 4.1; the formulation is this package's own.
    """
    grid, body = options.make_grid(options.trajectory), robot.make_body()
    if grid.parts % 2:
        raise InputError(f"intervals * samples_per_interval must be even, got {grid.parts}: one sample is the middle")
    step_m = body.check_step_length(options.step_length_m)
    phase = make_free_single_support_phase(body, step_m, options.trajectory, grid)

    @cache
    def make_planned() -> GaitProblem:
        return nao_ssp(robot=robot.robot, rotational_inertia=robot.rotational_inertia, step_length_m=step_m)

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Start from the paper's motion, for random values of its variables."""
        return fit_joints(options.trajectory, make_planned(), draw_uniform(phase.paper.names, parameters, rng))

    title = "single support with free joints: least mean power"
    return make_phase_problem("ssp-free", title, replace(phase, start=start), searchable=False)


@maker
def nao_dsp_free(robot: NaoOptions, options: FreeOptions, loads: PaperLoads) -> GaitProblem:
    """Double support of NAO with every freedom that two flat soles leave.

    The curves are those of ``nao-dsp`` and the torso's roll and pitch, zero and at rest at both ends; with zero coefficients on
    these the motion is that of ``nao-dsp``.

    Source:
        Ends, limits, loads and objective of Gupta, Pratihar, Deb (2023), section 4.2; the formulation is this package's own.
    """
    body, grid = make_leaning_nao(robot.make_body()), options.make_grid(options.trajectory)
    step_m = body.check_step_length(options.step_length_m)
    divided = make_divided_loads(body, loads.torso_share)
    phase = make_support_phase(body, Support.DOUBLE, step_m, options.trajectory, grid, Goal(), divided)
    return make_phase_problem(
        "dsp-free", "double support with a leaning torso: least mean power", phase, searchable=False
    )
