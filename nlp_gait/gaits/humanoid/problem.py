"""What every phase of a humanoid is made of: limits, lean of the torso, and the problem around it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.formulation import Array, GaitProblem, InstantPoint, Point, SimulationModel, Start, Variable
from nlp_gait.gaits.biped.goals import HEAT_LOSS
from nlp_gait.gaits.biped.motors import Motors
from nlp_gait.gaits.biped.parts import (
    REACH_MARGIN,
    BalanceMargins,
    Closure,
    DriveLimits,
    JointLimits,
    Margins,
    Part,
    Reach,
    TorqueChange,
)
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.problem import problem_of
from nlp_gait.gaits.biped.skeleton import skeleton
from nlp_gait.gaits.humanoid.body import GRAVITY, LARGEST_PITCH, LARGEST_ROLL, Humanoid
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.symbolic.trajectories import Motion, add_motions, cubic

DRAWS = 50  # of a start point, at most

LEAN = ("torso_roll", "torso_pitch")
LARGEST_LEAN = {"torso_roll": LARGEST_ROLL, "torso_pitch": LARGEST_PITCH}


def parts_of(
    body: Humanoid, margins: Margins, mean_limits_m: tuple[float, float], *, drive_limits: bool, solved: bool = True
) -> tuple[Part, ...]:
    """Limits of a phase: those of the paper, legs that end at their feet, and what the joints can give.

    Args:
        body: whose phase it is.
        margins: of balance.
        mean_limits_m: default of the least mean ones in x and y [m].
        drive_limits: whether torques and speeds are limited.
        solved: the legs' angles follow from their feet; False where the angles are given.
    """
    model, size = body.biped.model, body.biped.torque_scale
    return (
        JointLimits(model, body.biped.joints),
        Reach(),
        *((Closure(("left leg", "right leg")),) if solved else ()),
        TorqueChange(size),
        *((DriveLimits(model, size),) if drive_limits else ()),
        BalanceMargins(margins, mean_limits_m),
    )


def humanoid_motors(text: str, body: Humanoid) -> Motors:
    """What of the motors an option's text takes into account."""
    return Motors.parsed(text, body.biped.model, body.biped.joints)


def lean_variables() -> tuple[Variable, ...]:
    """Lean of the torso at both ends of a phase, where it is at rest."""
    return tuple(
        Variable(
            name=f"{name}_{end}_rad",
            unit="rad",
            lower=-LARGEST_LEAN[name],
            upper=LARGEST_LEAN[name],
            description=f"{name.replace('_', ' ')} at the {end}",
        )
        for name in LEAN
        for end in ("start", "end")
    )


def lean_motion(at: InstantPoint, more: Mapping[str, Motion], duration: SX, phase: SX) -> tuple[Motion, Motion]:
    """Roll and pitch of the torso [rad]: cubics from rest to rest, and what each curve adds."""
    still = SX(0)
    roll, pitch = (
        add_motions(cubic(at[f"{name}_start_rad"], at[f"{name}_end_rad"], still, still, duration, phase), more[name])
        for name in LEAN
    )
    return roll, pitch


def within_reach(
    variables: Sequence[str], known: Sequence[str], reach: Callable[[Point], MX], start: Start | None
) -> Start:
    """Start points at which all knees are within reach, or the nearest to it of some: beyond it a solver finds no slope back.

    Args:
        variables: names.
        known: names of the parameters that the motion reads.
        reach: cosines of the knees (2, N + 1) at a point.
        start: start points to choose from; None for any within the bounds.
    """

    @cache
    def farthest() -> ca.Function:
        x, p = MX.sym("x", len(variables)), MX.sym("p", len(known))
        cosines = reach(Point.of(x, p, variables, known))
        return ca.Function("farthest", [x, p], [ca.mmax(ca.fabs(cosines))])

    def drawn(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        if start is not None:
            return start(parameters, rng)
        return rng.uniform(
            *(np.array([parameters[f"{name}.{end}"] for name in variables]) for end in ("lower", "upper"))
        )

    def chosen(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        best, least = np.zeros(0), np.inf
        for _ in range(DRAWS):
            x = drawn(parameters, rng)
            cosine = float(farthest()(x, [parameters[name] for name in known]))
            if cosine < least:
                best, least = x, cosine
            if least <= 1.0 - parameters[REACH_MARGIN]:
                break
        return best

    return chosen


def staged(
    name: str,
    title: str,
    phase: Phase,
    body: Humanoid,
    *,
    start: Start | None = None,
) -> GaitProblem:
    """Problem of one phase; the robot's name goes before the title."""
    start = within_reach(phase.names, (REACH_MARGIN,), lambda at: phase.samples(at, Exact()).reach, start)
    problem = problem_of(name, f"{body.biped.full.name}, {title}", phase, start=start)
    return with_body(problem, body, phase.robot.armatures_kgm2)


def with_body(
    problem: GaitProblem, body: Humanoid, armatures_kgm2: Mapping[str, float], *, repeats: bool = False
) -> GaitProblem:
    """The problem with what drawing and playing its gaits need.

    Args:
        problem: without.
        body: whose gaits they are.
        armatures_kgm2: by joint, the inertia of rotors that the gait was planned with.
        repeats: a gait is one step, whose mirror image is the next one.
    """
    played = replace(body.biped.model, armatures_kgm2=armatures_kgm2)
    simulation_model = SimulationModel(robot=played, gravity=GRAVITY, heat_loss=HEAT_LOSS.name, repeats=repeats)
    full = body.biped.full
    display = replace(problem.display, robot=full, skeleton=skeleton(full), simulation_model=simulation_model)
    return replace(problem, display=display)
