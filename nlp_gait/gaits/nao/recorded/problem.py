"""A recorded gait as a problem whose only variables are its times: it is judged, drawn and played as any other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Assembly, Display, GaitProblem, Grid, Point, load
from nlp_gait.formulation.motion.signals import JointAngles
from nlp_gait.gaits.biped.double_support import double_support_margins, double_support_mean_margins, support_box
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.parts import Part
from nlp_gait.gaits.biped.recorded.cycle import Half, Judge, on_grids
from nlp_gait.gaits.biped.recorded.limits import HipLimits, StandingLimits, SwingLimits, mean_place
from nlp_gait.gaits.biped.recorded.motion import Motion, RecordedGait
from nlp_gait.gaits.biped.recorded.phase import RecordedPhase
from nlp_gait.gaits.biped.single_support import single_support_mean_margins
from nlp_gait.gaits.nao.body import JOINTS, PLANNED_JOINTS, nao
from nlp_gait.gaits.nao.cycle.motion import double_support_planner, nao_cycle_variables, single_support_planner
from nlp_gait.gaits.nao.cycle.problem import nao_cycle_of
from nlp_gait.gaits.nao.cycle.rows import double_margins, mean_margins, single_margins
from nlp_gait.gaits.nao.double_support import DURATION, standing
from nlp_gait.gaits.nao.free_joints import KNEES
from nlp_gait.gaits.nao.legs import hip_variables
from nlp_gait.gaits.nao.problem import paper_parts, with_robot
from nlp_gait.gaits.nao.recorded.motion import motion_of
from nlp_gait.gaits.nao.single_support import OWN_VARIABLES, single_support_loads, single_support_margins
from nlp_gait.robots import Robot

GAITS = ("nao-ssp", "nao-dsp", "nao-cycle")


def make_recorded_gait(
    angles: JointAngles,
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    gait: str | None = None,
    touch_down_s: float | None = None,
) -> RecordedGait:
    """Make a gait from angles over time.

    Args:
        angles: of the whole gait; its last instant is its end.
        robot: name or file.
        intervals: of each phase, as in the planned problem.
        gait: problem whose limits count; None for what the motion shows.
        touch_down_s: where single support ends in a cycle; None to find it.

    Raises:
        InputError: angles that are no gait, or another gait than named.
    """
    if gait is not None and gait not in GAITS:
        raise InputError(f"a motion is judged by the limits of {', '.join(GAITS)}, got {gait!r}")
    model = nao(robot, rotational_inertia=True)
    motion = motion_of(angles, model)
    if touch_down_s is None and gait in ("nao-ssp", "nao-dsp"):
        phases = {gait.removeprefix("nao-"): (0.0, motion.duration_s)}
    else:
        phases = motion.phases(touch_down_s)
    found = "nao-cycle" if len(phases) > 1 else "nao-ssp" if "ssp" in phases else "nao-dsp"
    if gait not in (None, found):
        raise InputError(
            f"{angles.owner} shows {found}, not {gait}: the right foot lands at no time before the end; name it with --touch-down"
        )
    parts = {name: motion.part(*span) if len(phases) > 1 else motion for name, span in phases.items()}

    def built(grid: Grid) -> GaitProblem:
        problem = cycle_judge(model).problem(parts, grid) if len(parts) > 1 else _phase(model, parts, grid)
        return with_robot(problem, robot, model.armatures_kgm2, repeats=len(parts) > 1 and motion.repeats)

    foot = motion.right_foot(np.array([0.0, motion.duration_s]))
    times: tuple[float, ...]
    if found == "nao-ssp":
        step, times = float(foot[1, 0] - foot[0, 0]) / 2, (motion.duration_s,)
    else:
        step, times = float(foot[1, 0]), tuple(part.duration_s for part in parts.values())
    cosine = float(motion.stance.places(motion.q[0])[4])
    problem = on_grids(built, intervals, {"robot": robot, "intervals": intervals})
    x = (*times, step) if found == "nao-cycle" else times
    return RecordedGait(
        gait=found,
        problem=problem,
        x=x,
        motion=motion,
        step_m=step,
        lean_deg=float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))),
        make_planned=partial(_planned_problem, found, problem, x, step),
    )


def _planned_problem(gait: str, recorded: GaitProblem, x: Sequence[float], step_m: float) -> GaitProblem:
    options = {key: recorded.options[key] for key in ("robot", "intervals")}
    problem = load(gait, **options) if gait == "nao-cycle" else load(gait, step_length_m=step_m, **options)
    fixed = dict(zip(recorded.names, x, strict=True))
    wider: dict[str, float] = {}
    for name, value in fixed.items():  # a recorded duration may violate its bounds; the optimum has the same duration
        low, high = problem.value(f"{name}.lower"), problem.value(f"{name}.upper")
        wider |= {f"{name}.lower": min(low, value), f"{name}.upper": max(high, value)}
    return problem.with_values(**wider).fix(**fixed)


def _phase(model: Robot, parts: Mapping[str, Motion], grid: Grid) -> GaitProblem:
    """Problem of one phase."""
    ((name, motion),) = parts.items()
    lift, single = OWN_VARIABLES
    height, vz0, vz1, vx0, vx1, vy0, vy1 = hip_variables(model)
    ends = ({"z": height, "vx": vx0, "vy": vy0, "vz": vz0}, {"z": height, "vx": vx1, "vy": vy1, "vz": vz1})
    hip = HipLimits(ends, ("start", "end"))
    own: tuple[Part, ...]
    if name == "ssp":
        duration, loads = single, single_support_loads(model, upright=())
        foot = model.feet["left"]
        own = (
            *paper_parts(
                model, single_support_margins(motion.stance.support[:2], foot), single_support_mean_margins(foot)
            ),
            hip,
            SwingLimits(motion, lift),
        )
    else:
        duration, loads = DURATION, standing(model, upright=()).loads("printed")
        right = mean_place(motion)
        box = support_box(model, {"L": motion.stance.support[:2], "R": (float(right[0]), float(right[1]))})
        own = (
            *paper_parts(model, double_support_margins(box), double_support_mean_margins(box)),
            hip,
            StandingLimits(),
        )
    phase = RecordedPhase(
        robot=model,
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        variables=(duration,),
        duration=duration.name,
        plan=single_support_planner(model) if name == "ssp" else double_support_planner(model),
        loads=loads,
        grid=grid,
        parts=own,
        recorded=motion,
        cosines=_cosines,
    )

    def assemble(at: Point, ops: object) -> Assembly:
        return phase.assemble(at, phase.samples(at, ops), ops)  # type: ignore[arg-type]

    return GaitProblem(
        name=f"recorded-{name}",
        title=f"A recorded gait of NAO, {'single' if name == 'ssp' else 'double'} support",
        variables=(duration,),
        own_parameters=phase.parameters,
        objective=phase.goal.objective,
        assemble=assemble,
        grid=grid,
        display=Display(motion=phase.signals, durations=(duration.name,)),
    )


def cycle_judge(model: Robot) -> Judge:
    """The planned cycle as the judge."""
    means = mean_margins(model)
    single = paper_parts(model, single_margins(model), means["ssp"])
    double = paper_parts(model, double_margins(model), means["dsp"])
    standing_loads = standing(model, upright=()).loads("lever")
    return Judge(
        owner="NAO",
        robot=model,
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        variables=nao_cycle_variables(model),
        halves={
            "ssp": Half(
                plan=single_support_planner(model), loads=single_support_loads(model, upright=()), parts=single
            ),
            "dsp": Half(plan=double_support_planner(model), loads=standing_loads, parts=double),
        },
        goal=Goal(),
        cosines=_cosines,
        joined=partial(nao_cycle_of, model, at_given_speed=False),
    )


def _cosines(q: MX) -> MX:
    """Of both knees, from all angles."""
    return ca.cos(q[[JOINTS.index(knee) for knee in KNEES], :])
