"""NAO's double support with every freedom that two flat soles leave: least mean power, the floor under planned motions."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
from casadi import MX, SX

from nlp_gait.formulation import GaitProblem, Grid, InstantPoint, Point, maker
from nlp_gait.formulation.blocks import labels
from nlp_gait.gaits.biped.curves import SPLINE_SAMPLES, Splines, Trajectory
from nlp_gait.gaits.biped.double_support import (
    LOAD_DEGREE,
    TorsoShare,
    double_support_margins,
    double_support_mean_margins,
    support_box,
)
from nlp_gait.gaits.biped.instant import PlannedInstant
from nlp_gait.gaits.biped.parts import REACH_MARGIN, AngleLimits, Contribution, Part, rows
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Samples, Trace
from nlp_gait.gaits.nao.body import JOINTS, PLANNED_JOINTS, nao
from nlp_gait.gaits.nao.closed_chain import YAW_PITCHES, check_yaw_pitches, closure, leaning_legs
from nlp_gait.gaits.nao.curves import arm_limits, arm_motions, hip_and_arm_units
from nlp_gait.gaits.nao.double_support import (
    ARM_SWING,
    DURATION,
    double_support_duration,
    double_support_hip,
    soles_of,
    standing,
    standing_ankles,
)
from nlp_gait.gaits.nao.legs import check_step_length, hip_variables
from nlp_gait.gaits.nao.problem import paper_parts, phase_problem
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, stack

LEAN = ("torso_roll", "torso_pitch")
# A sole turned by this leaves the ground by a tenth of a micrometre: what the closed chain may be off [rad].
FLAT = 1e-6


@maker
def nao_dsp_free(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    trajectory: Trajectory = "spline-4",
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "printed",
    step_length_m: float = 0.06,
    samples_per_interval: int = SPLINE_SAMPLES,
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Double support of NAO with a torso that leans; for the options see ``gaits.nao``.

    The curves are those of ``nao-dsp`` and the torso's roll and pitch, zero and at rest at both ends; with zero coefficients on
    these the motion is that of ``nao-dsp``.

    Source:
        Ends, limits, loads and objective of Gupta, Pratihar, Deb (2023), section 4.2; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    model = nao(robot, rotational_inertia)
    check_yaw_pitches(model)
    soles = soles_of(model, step_length_m)
    sharing = standing(model, upright=()).sharing(torso_share, load_degree)
    box, ankles = support_box(model, soles), standing_ankles(model, soles)
    splines = Splines(trajectory=trajectory, units=hip_and_arm_units(ARM_SWING) | dict.fromkeys(LEAN, "rad"))

    def torso(at: InstantPoint, s: SX) -> tuple[Motion, Motion, Mapping[str, Motion]]:
        """Its origin, its lean, and the arms."""
        duration = double_support_duration(at)
        more = splines.motions(at, duration, s)
        hip = double_support_hip(at, more, soles, s)
        return hip, stack(*(more[name] for name in LEAN)), arm_motions(more, ARM_SWING, duration, s)

    def plan(at: InstantPoint, s: SX, ops: Nonsmooth) -> PlannedInstant:
        hip, lean, arms = torso(at, s)
        legs = leaning_legs(model, hip, lean, ankles, at[REACH_MARGIN], ops)
        return PlannedInstant(joints={**legs.joints, **arms}, hip=hip.position, ankles=ankles, reach=legs.reach)

    def pose(at: InstantPoint, s: SX) -> SX:
        hip, lean, _ = torso(at, s)
        return ca.vertcat(hip.position, lean.position)

    richer = (arm_limits(model, splines, ARM_SWING, double_support_duration),) if splines.count else ()
    phase = Phase(
        robot=model,
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        variables=(*hip_variables(model), DURATION, *splines.variables, *sharing.variables),
        duration=DURATION.name,
        plan=sharing.planned(plan),
        loads=sharing.loads,
        grid=Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval"),
        parts=(
            *paper_parts(model, double_support_margins(box), double_support_mean_margins(box)),
            *richer,
            AngleLimits(
                "other_angle", model, (YAW_PITCHES["L"],), lambda at, s: closure(model, pose(at, s), ankles)[0]
            ),
            FlatSoles(lambda at, s: closure(model, pose(at, s), ankles)[1]),
            *sharing.parts,
        ),
        kinks=splines.kinks,
    )
    return phase_problem(
        "nao-dsp-free",
        "NAO, double support with a leaning torso: least mean power",
        phase,
        robot,
        start=sharing.start_of(phase.names, splines.start_of(phase.names)),
        searchable=False,
    )


class FlatSoles(Part):
    """Soles that the closed chain leaves flat between the ends, where Newton's method has converged.

    Args:
        turns: how far each sole is from flat (2,) [rad].
    """

    def __init__(self, turns: Trace) -> None:
        self.traces = {"sole_turn": turns}

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        names = labels(("left", "right"), range(1, samples.steps))
        turns = ca.vec(samples.traces["sole_turn"][:, 1:-1])
        return Contribution(rows=(rows("sole_turn", "rad", turns, MX(-FLAT), MX(FLAT), names, "instant"),))
