"""Problems of NAO: the published phases, its cycle and its whole walk."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from nlp_gait.formulation import GaitProblem, maker
from nlp_gait.gaits.biped.body import ZmpGravity, ZmpMasses
from nlp_gait.gaits.biped.loads import Division
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.problems import (
    CycleOptions,
    LoadOptions,
    PhaseOptions,
    RobotOptions,
    WalkOptions,
    make_support_problem,
    plan_cycle,
    plan_walk,
)
from nlp_gait.gaits.nao.body import Arms, NaoBody, make_nao

STEP_M = 0.06
# Options of the phases for which the prover has formulas, with one sample in each interval.
PROVEN_OPTIONS = {
    "derivatives": "analytic",
    "trajectory": "cubic",
    "objective": "power",
    "arms": "carried",
    "zmp_gravity": "physical",
    "zmp_masses": 25,
}


@dataclass(frozen=True, kw_only=True)
class LeastPower:
    """A phase of least power, for the prover's formulas."""

    body: NaoBody
    step_m: float
    division: Division | None  # of the torso in double support; None in single support


@dataclass(frozen=True, kw_only=True)
class NaoOptions(RobotOptions):
    """NAO, or a robot of its build.

    Attributes:
        rotational_inertia: false takes every link as a point mass, in torques and ZMP
    """

    rotational_inertia: bool = True

    def make_body(self) -> NaoBody:
        """Return the robot as its gaits take it."""
        return make_nao(**vars(self))


@dataclass(frozen=True, kw_only=True)
class NaoReading(NaoOptions):
    """The robot in a reading of the paper.

    Attributes:
        arms: carried by the legs, or separate: in the torques the legs carry a torso without arms, and each arm moves on a torso
            at rest, the ZMP is that of all links; shared: likewise, but in double support both arms add to the torso's mass
            that the legs share; held: carried, at rest in the middle of their swing
        zmp_gravity: physical, or as printed in (19) and (20): the inertial part of the ZMP has the opposite sign, and links are
            point masses in it. It moves the margins of the printed solutions by up to 0.9 mm in single and 2.9 mm in double
            support
    """

    arms: Arms = "carried"
    zmp_gravity: ZmpGravity = "physical"


@dataclass(frozen=True, kw_only=True)
class DoubleSupportReading(NaoReading):
    """The same in double support.

    Attributes:
        zmp_masses: 23: neck and head of double support are at the torso's centre of mass in the ZMP, as the text counts there (25
            in single support); moves the least margins by up to 0.3 mm
    """

    zmp_masses: ZmpMasses = 25


@dataclass(frozen=True, kw_only=True)
class PaperPhase(PhaseOptions):
    """A phase of the paper's step length.

    Attributes:
        derivatives: analytic, or finite-difference: of the sampled angles, as in the paper, of first order at the ends;
            finite-difference-2: of second order there, too
    """

    step_length_m: float = STEP_M
    derivatives: Derivatives = "analytic"


@dataclass(frozen=True, kw_only=True)
class PaperLoads(LoadOptions):
    """Loads as printed."""

    torso_share: Division = "printed"


@maker
def nao_ssp(robot: NaoReading, options: PaperPhase) -> GaitProblem:
    """Single support of NAO; the swing foot moves by twice the step length.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.1 and 4.1.
    """
    body = robot.make_body()
    problem = make_support_problem(body, options, derivatives=options.derivatives)
    return _add_least_power(problem, body, vars(robot) | vars(options))


@maker
def nao_dsp(robot: DoubleSupportReading, options: PaperPhase, loads: PaperLoads) -> GaitProblem:
    """Double support of NAO.

    The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
    torso, which depends on where the hip is between the feet.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.2 and 4.2.
    """
    body = robot.make_body()
    problem = make_support_problem(body, options, loads, options.derivatives)
    return _add_least_power(problem, body, vars(robot) | vars(options), loads.torso_share)


@maker
def nao_cycle(robot: NaoOptions, options: CycleOptions) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one.

    The published phases cannot be chained: single support ends with the hip 0.03 m ahead of the stance foot, double support
    starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times and the step
    length are variables, and the cycle repeats after mirroring left to right.

    By ``torso_share="lever"`` the load passes from foot to foot.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walking cycle by this package.
    """
    return plan_cycle(robot.make_body(), options)


@maker
def nao_walk(robot: NaoOptions, options: WalkOptions) -> GaitProblem:
    """Whole walk of NAO from standing to standing: weight shift, half step, steps, half step, weight shift.

    Angles of its footholds are 0: one motor turns both feet.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walk by this package.
    """
    return plan_walk(robot.make_body(), options)


def _add_least_power(
    problem: GaitProblem, body: NaoBody, options: Mapping[str, Any], division: Division | None = None
) -> GaitProblem:
    """Return the problem with what the prover reads, if its formulas are those of the options."""
    usual = all(options.get(name, value) == value for name, value in PROVEN_OPTIONS.items())
    if not usual or options["samples_per_interval"] > 1:
        return problem
    step_m = body.check_step_length(options["step_length_m"])
    return replace(problem, least_power=LeastPower(body=body, step_m=step_m, division=division))
