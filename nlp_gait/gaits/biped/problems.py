"""Options of the problems of bipeds, and how NAO's and other humanoids' problems are made of them."""

from dataclasses import dataclass

from nlp_gait.formulation import GaitProblem, Grid
from nlp_gait.formulation.assembly import Quadrature
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.biped.curves import Trajectory, make_grid
from nlp_gait.gaits.biped.loads import Division, make_divided_loads
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.phase_problem import Criterion, make_goal, make_phase_problem
from nlp_gait.gaits.biped.support_phases import make_support_phase


@dataclass(frozen=True, kw_only=True)
class SampleOptions:
    """SampleOptions of a phase, and the rule of means."""

    intervals: int = 10
    samples_per_interval: int = 0
    rule: Quadrature = "trapezoid"

    def make_grid(self, trajectory: Trajectory = "cubic") -> Grid:
        """Return the samples, which suit the trajectory."""
        return make_grid(trajectory, self.intervals, self.samples_per_interval, rule=self.rule)


@dataclass(frozen=True, kw_only=True)
class PhaseOptions(SampleOptions):
    """A phase as in the paper."""

    step_length_m: float = 0.0
    trajectory: Trajectory = "cubic"
    objective: Criterion = "power"


@dataclass(frozen=True, kw_only=True)
class LoadOptions:
    """Load of double support, see ``loads.share_torso``."""

    torso_share: Division = "lever"


def make_support_problem(
    body: Body, options: PhaseOptions, loads: LoadOptions | None = None, derivatives: Derivatives = "analytic"
) -> GaitProblem:
    """Return the problem of single support, or of double support with its loads."""
    step_m, goal = body.check_step_length(options.step_length_m), make_goal(body, options.objective)
    kind, words = (Support.SINGLE, "single") if loads is None else (Support.DOUBLE, "double")
    loader = None if loads is None else make_divided_loads(body, loads.torso_share)
    grid = options.make_grid(options.trajectory)
    phase = make_support_phase(body, kind, step_m, options.trajectory, grid, goal, loader, derivatives)
    return make_phase_problem(kind, f"{words} support: least mean power", phase)
