"""Variables of phases, whose bounds are NAO's in proportion to the robot's size."""

from dataclasses import replace

from nlp_gait.formulation import Variable
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.gaits.biped.body import LIFT, TIMED_UNITS, TIMES, Body, Support


def make_hip_variables(body: Body) -> tuple[Variable, ...]:
    """Return hip height and velocities at both ends of a phase: the first variables of every phase (section 4)."""
    low, high = body.hip_height_m
    rows = [("hip_height_m", "m", low, high, f"height of the {body.hip_name} at both ends")]
    bounds = {"z": (-0.05, 0.05, "vertical"), "x": (0.001, 0.2, "sagittal"), "y": (-0.2, 0.2, "lateral")}
    for axis, (least, most, word) in bounds.items():
        for end in ("start", "end"):
            limits = body.scale_time(min(least, least * body.swing_speed)), body.scale_time(most * body.swing_speed)
            rows.append((f"hip_v{axis}_{end}_m_s", "m/s", *limits, f"{word} velocity at the {end}"))
    return make_variables(*rows)


def make_lift_variable(body: Body) -> Variable:
    """Return the height of the swing."""
    lower, upper = body.scale_length(0.015), body.scale_length(0.03)
    return Variable(name=LIFT, unit="m", lower=lower, upper=upper, description="highest point of the swing foot")


def make_time_variable(body: Body, phase: Support) -> Variable:
    """Return the duration of a phase."""
    least, most = {Support.SINGLE: (0.4, 4.0), Support.DOUBLE: (0.2, 2.0)}[phase]
    word = {Support.SINGLE: "from lift-off to touch-down", Support.DOUBLE: "from touch-down to the next lift-off"}[
        phase
    ]
    lower, upper = body.scale_time(least / body.swing_speed), body.scale_time(most)
    return Variable(name=TIMES[phase], unit="s", lower=lower, upper=upper, description=word)


def make_usual_bounds(body: Body, variable: Variable) -> Variable:
    """Return a variable with the bounds in proportion to NAO's, between which gaits start."""
    if variable.unit == "s":
        return replace(variable, lower=min(variable.lower * body.swing_speed, variable.upper))
    if variable.unit not in TIMED_UNITS:
        return variable
    lower = max(variable.lower, variable.lower / body.swing_speed)
    return replace(variable, lower=lower, upper=variable.upper / body.swing_speed)
