"""The published phases of NAO; options are in ``gaits.nao``."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from nlp_gait.formulation import GaitProblem, maker
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.formulation.power_form import PowerForm
from nlp_gait.gaits.biped.loads import Division
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.problems import LoadOptions, PhaseOptions, make_support_problem
from nlp_gait.gaits.nao.body import Arms, NaoBody, ZmpGravity, ZmpMasses, make_nao

STEP_M = 0.06
# Options of the phases that have formulas for proofs, with one sample in each interval.
FORM_OPTIONS = {
    "derivatives": "analytic",
    "trajectory": "cubic",
    "objective": "power",
    "motors": "",
    "arms": "carried",
    "zmp_gravity": "physical",
    "zmp_masses": 25,
    "rule": "trapezoid",
}


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

    torso_share: Division = "printed"


@maker
def nao_ssp(robot: NaoReading, options: PaperPhase) -> GaitProblem:
    """Single support of NAO; the swing foot moves by twice the step length.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.1 and 4.1.
    """
    body = robot.make_body()
    problem = make_support_problem(body, options, derivatives=options.derivatives)
    return _add_power_form(problem, body, vars(robot) | vars(options))


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
    return _add_power_form(problem, body, vars(robot) | vars(options), loads.torso_share)


def _add_power_form(
    problem: GaitProblem, body: NaoBody, options: Mapping[str, Any], rule: Division | None = None
) -> GaitProblem:
    """Return the problem with its formulas for proofs, if they are those of its options."""
    usual = all(options.get(name, value) == value for name, value in FORM_OPTIONS.items())
    if not usual or options["samples_per_interval"] > 1:
        return problem

    def make(changed: GaitProblem) -> PowerForm:
        from nlp_gait.gaits.nao.least_power.power_form import make_power_form  # which solvers do not need

        return make_power_form(changed, body, body.check_step_length(options["step_length_m"]), rule)

    return replace(problem, power_form=make)
