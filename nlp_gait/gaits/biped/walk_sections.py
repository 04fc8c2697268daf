"""The phases of a whole walk along footholds, each over the left foot at x = 0, their variables, and start points.

Each step is seen from its standing foot, mirrored if that is the right one. Along equal footholds all inner steps are the same
cycle, whose states at both switches are variables: the start ends in the cycle's state, and the stop begins there. So the size of
the problem does not depend on the number of steps. Otherwise every step has its own states.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np

from nlp_gait.formulation import Array, GaitProblem, Variable
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, Support, make_lift_variable, make_usual_bounds
from nlp_gait.gaits.biped.cycle import STEP, make_cycle_variables
from nlp_gait.gaits.biped.footholds import Foothold, list_swings
from nlp_gait.gaits.biped.sequence import End, MotionSection, State, make_state_variables

STAND, STAND_AT_END = Support.STAND.value, "stand_at_end"  # first pose, and state of its variables; last pose
SHIFT = "shift_time_s"
HALF_STEPS = 2  # the first and the last step are half steps
LEAST_SPEED, GREATEST_SPEED = "least_speed_m_s", "greatest_speed_m_s"  # parameters: of the inner steps
DURATION = "duration_s"  # variable of a phase besides those of its first and last state

BESIDE = 1e-6  # [m, rad]; feet this close to their places at the start stand side by side
START_NOISE = 0.002  # of start points, as a share of the bounds' ranges


def list_equal_footholds(steps: int, feet_y: tuple[float, float]) -> tuple[Foothold, ...]:
    """Return the footholds of a straight walk, in step lengths; the last foot closes."""
    return tuple(Foothold(float(min(k, steps - 1)), feet_y[k % 2], 0.0) for k in range(1, steps + 1))


def list_sections(footholds: Sequence[Foothold], feet_y: tuple[float, float], *, equal: bool) -> list[MotionSection]:
    """Return the phases of a walk in the order of time; along equal footholds the inner steps are one cycle."""
    swings, count = list_swings(footholds, feet_y), len(footholds)
    if equal:
        inner = {2: ("", count - HALF_STEPS)} if count > HALF_STEPS else {}
        steps = {1: ("start_", 1), **inner, count: ("stop_", 1)}
    else:
        steps = {k: (f"step{k}_", 1) for k in range(1, count + 1)}

    def lift_off(prefix: str) -> End:
        return End(State(f"{'' if prefix == 'stop_' else prefix}lift_off", "lift_off"))  # equal steps begin alike

    side = (swings[0][0],) * 2
    shift = MotionSection("shift", Support.STAND, End(), lift_off(steps[1][0]), side, SHIFT)
    sections = [shift._replace(name=STAND, end=End(), occurs=0), shift]
    for number, (k, (prefix, occurs)) in enumerate(steps.items(), 1):
        (lifted, landed), last = swings[k - 1], k == count
        single, double, lift = (f"{prefix}{name}" for name in (*TIMES.values(), LIFT))
        touch_down = End(State(f"{prefix}touch_down", "touch_down"))
        after = End() if last else lift_off("" if equal else f"step{k + 1}_")._replace(mirrored=True)
        kind = Support.STAND if np.allclose(landed, side[0], atol=BESIDE) else Support.DOUBLE
        swing = MotionSection(
            f"{prefix}ssp", Support.SINGLE, lift_off(prefix), touch_down, (lifted, landed), single, lift
        )
        stance = MotionSection(f"{prefix}dsp", kind, touch_down, after, (landed, landed), double)
        sections += [section._replace(step=number, occurs=occurs) for section in (swing, stance)]
    return sections if equal else [*sections, sections[-1]._replace(name=STAND_AT_END, begin=End(), occurs=0)]


def list_states(sections: Sequence[MotionSection]) -> list[State]:
    """Return the states between phases, each once, in the order of time."""
    ends = (end.state for section in sections for end in (section.begin, section.end))
    return list(dict.fromkeys(state for state in ends if state is not None))


def make_phase_variables(body: Body, right: Sequence[str]) -> tuple[Variable, ...]:
    """Return the variables of one phase: states at both ends, height of the swing, duration, and places of the right foot."""
    *_, single, _, step = make_cycle_variables(body)
    return (
        *make_state_variables(body, "begin", "lift_off"),
        *make_state_variables(body, "end", "touch_down"),
        make_lift_variable(body),
        replace(single, name=DURATION),
        *(replace(step, name=name, unit=name.rpartition("_")[2], description="of the right foot") for name in right),
    )


def make_walk_variables(body: Body, sections: Sequence[MotionSection], *, equal: bool) -> tuple[Variable, ...]:
    """Return the variables of a walk: the pose at both ends, the shift, and states, swing and times of each step.

    The length of equal steps is the last one; other footholds are given, and steps may lead backwards.
    """
    *_, step = cycle = make_cycle_variables(body)
    of_cycle = {variable.name: variable for variable in cycle}
    shift = replace(of_cycle[TIMES[Support.DOUBLE]], name=SHIFT, description="duration of the phase shift")
    variables, states = [*make_pose_variables(body), shift], set[State]()
    for single, double in zip(sections, sections[1:], strict=False):
        if single.kind is not Support.SINGLE:
            continue
        for state in (single.begin.state, single.end.state):
            if state is not None and state not in states:
                states.add(state)
                variables += state.make_variables(body)
        prefix = single.name.removesuffix(Support.SINGLE)
        words = f", {prefix.rstrip('_')} of the walk" if prefix else ""
        for name, like in zip((single.lift, single.duration, double.duration), (LIFT, *TIMES.values()), strict=True):
            variables.append(replace(of_cycle[like], name=name, description=f"{of_cycle[like].description}{words}"))
    if equal:
        return (*variables, step)
    both_ways = ("hip_x", "hip_vx")
    return tuple(replace(v, lower=min(v.lower, -v.upper)) if v.name.startswith(both_ways) else v for v in variables)


def make_pose_variables(body: Body) -> list[Variable]:
    """Return the variables of the pose at both ends: symmetric and at rest, so that the other coordinates are zero."""
    free = {"hip_x", "hip_z", *(c.name for c in body.coordinates if c.mirror_sign > 0)}
    states = make_state_variables(body, STAND, "lift_off")
    return [
        replace(variable, description=variable.description.replace("at stand", "standing"))
        for variable in states
        if variable.name.partition(f"_{STAND}_")[0] in free
    ]


def find_alike(body: Body, state: State) -> dict[str, str]:
    """Return the name of the cycle's variable for each variable of a state."""
    cycle = make_state_variables(body, state.switch, state.switch)
    return {variable.name: like.name for variable, like in zip(state.make_variables(body), cycle, strict=True)}


@cache
def _load_start() -> dict[str, float]:
    """Return the variables of a walk of NAO as shares of their bounds' ranges."""
    shares: dict[str, float] = json.loads(files(__package__).joinpath("walk_start.json").read_text(encoding="utf-8"))
    return shares


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkStart:
    """Start points of a walk, near one of NAO or near a cycle."""

    variables: Sequence[Variable]  # between whose bounds it starts
    alike: Mapping[str, str]  # the cycle's variable for each variable of the walk
    pose: Mapping[str, str]  # the cycle's variable for each variable of the poses at both ends
    rise: float  # of the ground, for each metre forward

    def __call__(self, parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Draw a start point (n,) near NAO's walk in proportion to the bounds, at the required speed."""
        shares, widths = _load_start(), [variable.upper - variable.lower for variable in self.variables]
        x = {
            variable.name: variable.lower + width * shares.get(self.alike.get(variable.name, variable.name), 0.5)
            for variable, width in zip(self.variables, widths, strict=True)
        }
        for name in x:
            if name.startswith("hip_x_"):
                x[name] += self.rise * x[f"hip_z_{STAND}_m"]
        if LEAST_SPEED in parameters:
            speed = x[STEP] / sum(x[time] for time in TIMES.values())
            wanted = min(max(speed, parameters[LEAST_SPEED]), parameters[GREATEST_SPEED])
            x[TIMES[Support.DOUBLE]] += max(x[STEP] / wanted - x[STEP] / speed, 0.0)
            x[STEP] *= max(wanted / speed, 1.0)
        lower, upper = (np.array([parameters[f"{name}.{end}"] for name in x]) for end in ("lower", "upper"))
        noise = START_NOISE * np.array(widths) * rng.uniform(-1.0, 1.0, len(x))
        return np.asarray(np.clip(np.array(list(x.values())) + noise, lower, upper))


def make_walk_start(body: Body, variables: Sequence[Variable], sections: Sequence[MotionSection]) -> WalkStart:
    """Return the start points of a walk of these phases."""
    alike = {name: like for state in list_states(sections) for name, like in find_alike(body, state).items()}
    for section in sections:
        if section.duration != SHIFT:
            alike[section.duration] = TIMES[Support.SINGLE if section.kind is Support.SINGLE else Support.DOUBLE]
        if section.kind is Support.SINGLE:
            alike[section.lift] = LIFT
    return WalkStart(
        variables=[make_usual_bounds(body, variable) for variable in variables],
        alike=alike,
        pose=find_alike(body, State(STAND, "lift_off")) | {SHIFT: TIMES[Support.DOUBLE]},
        rise=math.tan(body.slope_rad),
    )


def start_from_cycle(walk: GaitProblem, start: Array, cycle: Mapping[str, float], rise_m: float = 0.0) -> Array:
    """Return ``start`` (n,) with states and times of a cycle in all phases; on stairs the hip rises with the feet's middle."""
    rule = walk.hints.start
    assert isinstance(rule, WalkStart)
    alike = {**rule.alike, **rule.pose}
    values = {name: cycle.get(alike.get(name, name), value) for name, value in walk.by_name(start).items()}
    # A lift-off between both feet is ahead of one side by side.
    first = next(name for name in values if name in ("hip_x_start_lift_off_m", "hip_x_step1_lift_off_m"))
    values |= dict.fromkeys((f"hip_x_{STAND}_m", first), 0.2 * (values | dict(cycle))[STEP])
    for state, share in {"lift_off": -0.5, "touch_down": 0.5, "start_touch_down": 0.5}.items():
        if (name := f"hip_z_{state}_m") in values:
            values[name] += share * rise_m
    return np.asarray(np.clip(list(values.values()), walk.lower, walk.upper))
