"""Phases of NAO with free joints; options are in ``gaits.nao``."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, maker
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.curves import SPLINE_SAMPLES, Trajectory
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.nao.free_joints import fit_joints, make_free_single_support_phase
from nlp_gait.gaits.nao.leaning_torso import make_leaning_nao
from nlp_gait.gaits.nao.problems import STEP_M, NaoOptions, PaperLoads, nao_ssp


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
    step_m = body.check_step_length(options.step_length_m)
    divided = make_divided_loads(body, loads.torso_share)
    phase = make_support_phase(body, Support.DOUBLE, step_m, options.trajectory, grid, Goal(), divided)
    return make_phase_problem(
        "dsp-free", "double support with a leaning torso: least mean power", phase, searchable=False
    )
