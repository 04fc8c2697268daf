"""The NAO problems: published phases, with free joints too, walking cycle; options are in ``gaits.nao``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, maker
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.curves import SPLINE_SAMPLES, Trajectory
from nlp_gait.gaits.biped.footholds import Foothold
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.load_sharing import TorsoShare, share_load
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.problems import (
    CycleOptions,
    LoadOptions,
    PhaseOptions,
    WalkOptions,
    make_cycle_problem,
    make_support_problem,
    make_walk_problem,
)
from nlp_gait.gaits.biped.support_phases import make_support_phase, place_hip, place_soles, place_stance
from nlp_gait.gaits.nao.body import ARM_SWING, Arms, NaoBody, ZmpGravity, ZmpMasses, make_nao
from nlp_gait.gaits.nao.free_joints import fit_joints, make_free_single_support_phase
from nlp_gait.gaits.nao.leaning_torso import make_leaning_nao
from nlp_gait.gaits.nao.least_power.power_form import has_power_form, make_power_form_maker
from nlp_gait.gaits.nao.least_power.power_instants import make_double_support, make_single_support

STEP_M = 0.06


@dataclass(frozen=True, kw_only=True)
class NaoOptions:
    """The robot and its limits."""

    robot: str = "nao-v5"
    rotational_inertia: bool = True
    limits: str | AddedLimits = ""

    def make_body(self) -> NaoBody:
        """Return the robot as its gaits take it."""
        return make_nao(**vars(self))


@dataclass(frozen=True, kw_only=True)
class NaoMotorOptions(NaoOptions):
    """The robot, perhaps with its real motors."""

    motors: str = ""


@dataclass(frozen=True, kw_only=True)
class NaoReading(NaoMotorOptions):
    """The robot in a reading of the paper."""

    arms: Arms = "carried"
    zmp_gravity: ZmpGravity = "physical"


@dataclass(frozen=True, kw_only=True)
class DoubleSupportReading(NaoReading):
    """The same in double support."""

    zmp_masses: ZmpMasses = 25


@dataclass(frozen=True, kw_only=True)
class PaperPhase(PhaseOptions):
    """A phase of the paper's step length."""

    step_length_m: float = STEP_M
    derivatives: Derivatives = "analytic"


@dataclass(frozen=True, kw_only=True)
class PaperLoads(LoadOptions):
    """Loads as printed."""

    torso_share: TorsoShare = "printed"


@dataclass(frozen=True, kw_only=True)
class FreeOptions:
    """A phase whose joints are free."""

    intervals: int = 10
    trajectory: Trajectory = "spline-4"
    step_length_m: float = STEP_M
    samples_per_interval: int = SPLINE_SAMPLES

    def make_grid(self) -> Grid:
        """Return the samples."""
        samples = self.samples_per_interval
        return Grid(intervals=self.intervals, samples_per_interval=samples, refined_by="samples_per_interval")


@maker
def nao_ssp(robot: NaoReading, options: PaperPhase) -> GaitProblem:
    """Single support of NAO; the swing foot moves by twice the step length.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.1 and 4.1.
    """
    body = robot.make_body()
    problem = make_support_problem(body, options, derivatives=options.derivatives)
    if not has_power_form(vars(robot) | vars(options)):
        return problem
    places = place_stance(body, body.check_step_length(options.step_length_m)), ARM_SWING[Support.SINGLE]
    make_phase = partial(make_single_support, body.robot, *places)
    return replace(problem, power_form=make_power_form_maker(body.robot, make_phase))


@maker
def nao_dsp(robot: DoubleSupportReading, options: PaperPhase, loads: PaperLoads) -> GaitProblem:
    """Double support of NAO.

    The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
    torso, which depends on where the hip is between the feet.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.2 and 4.2.
    """
    if loads.torso_share == "free" and robot.arms != "carried":
        raise InputError(
            f"arms={robot.arms!r} does not go with torso_share='free', where the legs carry all; choose arms='carried'"
        )
    body = robot.make_body()
    problem = make_support_problem(body, options, loads, options.derivatives)
    if loads.torso_share == "free" or not has_power_form(vars(robot) | vars(options)):
        return problem
    soles = place_soles(body, body.check_step_length(options.step_length_m))
    places = soles, place_hip(body, soles), ARM_SWING[Support.DOUBLE]
    make_phase = partial(make_double_support, body.robot, *places, loads.torso_share)
    return replace(problem, power_form=make_power_form_maker(body.robot, make_phase))


@maker
def nao_cycle(robot: NaoMotorOptions, options: CycleOptions) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one.

    The published phases cannot be chained: single support ends with the hip 0.03 m ahead of the stance foot, double support
    starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times and the step
    length are variables, and the cycle repeats after mirroring left to right.

    ``objective="energy-per-metre"`` leaves the speed free; ``"power"``, and ``"torque"`` for the mean of the sum of squared
    torques, are those at the speed ``speed_m_s``, a parameter: the step length is then speed times the time of the cycle. By
    ``torso_share="lever"`` the nearer foot carries more, so that the load passes from foot to foot; as printed, the farther one.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walking cycle by this package.
    """
    return make_cycle_problem(robot.make_body(), options)


@maker
def nao_walk(robot: NaoMotorOptions, options: WalkOptions) -> GaitProblem:
    """Whole walk of NAO from standing to standing: weight shift, half step, steps, half step, weight shift.

    All inner steps are one cycle, as in ``nao-cycle``; its speed may have limits, which are parameters. The feet advance by one
    step length less than there are steps, because the first and the last one are half steps.

    ``steps`` are swings of a foot, both half steps included. On ground that rises forward by ``slope_deg`` all places are in its
    axes, in which gravity is tilted. ``footholds``, rows ``x,y,z,yaw`` [m, degrees] separated by semicolons, are where the right
    foot, the left foot and so on land instead; then every step has its own states. All angles are 0: one motor turns both feet.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walk by this package.
    """

    def check(places: Sequence[Foothold]) -> None:
        if any(place.yaw for place in places):
            raise InputError("footholds of NAO all point forward; leave out angles")

    return make_walk_problem(robot.make_body(), options, check)


@maker
def nao_ssp_free(robot: NaoOptions, options: FreeOptions) -> GaitProblem:
    """Single support of NAO with free joints. One of the samples must be the middle.

    Source:
        Ends, limits and objective of Gupta, Pratihar, Deb (2023), section 4.1; the formulation is this package's own.
    """
    grid, body = options.make_grid(), robot.make_body()
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
    body, grid = make_leaning_nao(robot.make_body()), options.make_grid()
    sharing = share_load(body, loads.torso_share, loads.load_degree)
    step_m = body.check_step_length(options.step_length_m)
    phase = make_support_phase(body, Support.DOUBLE, step_m, options.trajectory, grid, Goal(), sharing)
    return make_phase_problem(
        "dsp-free", "double support with a leaning torso: least mean power", phase, searchable=False
    )
