"""NAO's double support with every freedom that two flat soles leave: least mean power, the floor under planned motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import get_args

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Assembly, Constraint, GaitProblem, Point
from nlp_gait.problems.nao.body import nao
from nlp_gait.problems.nao.closed_chain import YAW_PITCHES, check_yaw_pitches, closure, leaning_legs
from nlp_gait.problems.nao.curve_limits import at_phases, limit_rows, with_motion
from nlp_gait.problems.nao.curves import SPLINE_SAMPLES, Splines, Trajectory, arm_motions, hip_and_arm_units
from nlp_gait.problems.nao.double_support import (
    ARM_SWING,
    TorsoShare,
    double_support_loads,
    double_support_margins,
    double_support_mean_margins,
    support_box,
)
from nlp_gait.problems.nao.double_support_stance import (
    DURATION,
    double_support_duration,
    double_support_hip,
    soles_of,
    standing_ankles,
)
from nlp_gait.problems.nao.legs import check_step_length, hip_variables
from nlp_gait.problems.nao.limits import phase_problem
from nlp_gait.problems.nao.phase import Phase, Plan
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, stack

LEAN = ("torso_roll", "torso_pitch")
# A sole turned by this leaves the ground by a tenth of a micrometre: what the closed chain may be off [rad].
FLAT = 1e-6


def nao_dsp_free(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    trajectory: Trajectory = "spline-4",
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "printed",
    step_length_m: float = 0.06,
    samples_per_interval: int = SPLINE_SAMPLES,
) -> GaitProblem:
    """Double support of NAO with a torso that leans.

    The curves are those of ``nao-dsp`` and the torso's roll and pitch, zero and at rest at both ends; with zero coefficients on
    these the motion is that of ``nao-dsp``.

    Args:
        robot: name or file of the robot.
        intervals: equal parts of the phase over which torques may change by the limit.
        trajectory: of torso and arms.
        rotational_inertia: False takes every link as a point mass, in torques and ZMP.
        torso_share: how the torso's mass is shared between the legs (see ``nao_dsp.torso_shares``).
        step_length_m: from foot to foot.
        samples_per_interval: so many that the joints cannot bend between the samples.

    Source:
        Ends, limits, loads and objective of Gupta, Pratihar, Deb (2023), section 4.2; the formulation is this package's own.
    """
    if torso_share not in get_args(TorsoShare):
        raise InputError(f"torso_share must be one of {', '.join(get_args(TorsoShare))}, got {torso_share!r}")
    check_step_length(step_length_m)
    model = nao(robot, rotational_inertia)
    check_yaw_pitches(model)
    soles = soles_of(model, step_length_m)
    box, ankles = support_box(model, soles), standing_ankles(model, soles)
    own = (*hip_variables(model), DURATION)
    units = hip_and_arm_units(ARM_SWING) | dict.fromkeys(LEAN, "rad")
    splines = Splines(trajectory=trajectory, units=units, first=len(own))
    variables = (*own, *splines.variables)

    def torso(x: SX, s: SX) -> tuple[Motion, Motion, Mapping[str, Motion]]:
        """Its origin, its lean, and the arms."""
        duration = double_support_duration(x)
        more = splines.motions(x, duration, s)
        hip = double_support_hip(x, more, soles, s)
        return hip, stack(*(more[name] for name in LEAN)), arm_motions(more, ARM_SWING, duration, s)

    def plan(x: SX, margin: SX, s: SX, ops: Nonsmooth) -> Plan:
        hip, lean, arms = torso(x, s)
        legs = leaning_legs(model, hip, lean, ankles, margin, ops)
        return Plan(joints={**legs.joints, **arms}, hip=hip.position, ankles=ankles, reach=legs.reach)

    phase = Phase(
        robot=model,
        variables=len(variables),
        duration=DURATION.name,
        plan=plan,
        loads=double_support_loads(model, torso_share, upright=()),
        intervals=intervals,
        samples_per_interval=samples_per_interval,
        derivatives="analytic",
    )
    problem = phase_problem(
        name="nao-dsp-free",
        title="NAO, double support with a leaning torso: least mean power",
        variables=variables,
        phase=phase,
        margins=lambda zmp, ops: double_support_margins(zmp, box, ops),
        mean_dbm_m=double_support_mean_margins(box),
        make=nao_dsp_free,
        options={
            "robot": robot,
            "intervals": intervals,
            "trajectory": trajectory,
            "rotational_inertia": rotational_inertia,
            "torso_share": torso_share,
            "step_length_m": step_length_m,
            "samples_per_interval": samples_per_interval,
        },
    )
    moved = with_motion(problem, phase, splines, "power", lambda x, s: torso(x, s)[2])

    def closed(x: SX, s: SX) -> SX:
        hip, lean, _ = torso(x, s)
        return ca.vertcat(*closure(model, ca.vertcat(hip.position, lean.position), ankles))

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        assembly = moved.assemble(point, ops)
        rows = at_phases(closed, point, np.linspace(0.0, 1.0, phase.steps + 1)[1:-1])
        flat = Constraint(
            name="sole_turn",
            labels=tuple(f"{side}, {k}" for k in range(1, phase.steps) for side in ("left", "right")),
            unit="rad",
            scale=1.0,
            value=ca.vec(rows[1:, :]),
            lower=MX(-FLAT),
            upper=MX(FLAT),
        )
        yaw_pitch = limit_rows(model, "other_angle", (YAW_PITCHES["L"],), rows[0, :])
        return replace(assembly, constraints=(*assembly.constraints, yaw_pitch, flat))

    return replace(moved, assemble=assemble, searchable=False)
