"""Runs behind the verdicts: gaits, what each joint draws in them, softer servos, other heights and heat constants."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, partial
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from compare.papers.nao_walk.effort import Effort
from compare.papers.nao_walk.nao_walk_sources import SPEED_M_S, STRETCHED_M, documented
from compare.questions.sweep.study import Axis
from compare.questions.walk.study import CYCLE, optimal_gaits
from compare.study.store import Computation
from compare.study.task import ProblemSpec
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, finely_sampled
from nlp_gait.gaits.biped.cart_table import Footsteps, cart_table_walk
from nlp_gait.gaits.nao.joints import YAW_PITCHES
from nlp_gait.gaits.nao.recorded import nao_cycles
from nlp_gait.robots import Robot
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import planned_distance, walked_distance
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import Conditions, Push, simulate_plan

PAPER_HEAT, SHEET_HEAT = "K of the paper", "K of the data sheet"
SPECS = {
    PAPER_HEAT: ProblemSpec(name=CYCLE, options={"objective": "power"}),
    SHEET_HEAT: ProblemSpec(name=CYCLE, options={"objective": "power", "motors": "heat"}),
}
HEIGHTS = ("hip_z_lift_off_m", "hip_z_touch_down_m")  # variables
ARMS = "arms"
KINDS = {  # of joints, in words
    **{"KneePitch": "knees", "HipPitch": "hip pitch", "HipRoll": "hip roll", "HipYawPitch": "hip yaw-pitch"},
    **{"AnklePitch": "ankle pitch", "AnkleRoll": "ankle roll", ARMS: ARMS},
}
DIRECTIONS = ((1, 0), (-1, 0), (0, 1), (0, -1))
PUSHES_NS, SLOPES_DEG, FRICTIONS, MASS_FACTORS = (0.5, 1.0), (6.0,), (0.3,), (0.9, 1.1)


def gaits_first(effort: Effort) -> list[Computation]:
    """Optimal gaits over speed, the robot's own walk at other heights, optima whose legs may stretch."""
    found = [
        Computation(
            name=f"speeds-{_word(name)}",
            inputs={**fingerprint(spec.load()), "speeds": effort.speeds_m_s, "starts": effort.starts},
            function=partial(over_speed, spec, effort.speeds_m_s, effort.starts),
        )
        for name, spec in SPECS.items()
    ]
    inputs = {**_own(), "heights": effort.torsos_m}
    found.append(Computation(name="torso-heights", inputs=inputs, function=partial(at_heights, effort.torsos_m)))
    for name, spec in (*((f"{heat:g}", _with_heat(heat)) for heat in effort.heats), ("sheet", SPECS[SHEET_HEAT])):
        found.append(
            Computation(
                name=f"straighter-{name}",
                inputs={**fingerprint(spec.load()), "starts": effort.starts},
                function=partial(free_height, spec, effort.starts),
            )
        )
    return found


def walks_then(effort: Effort, optima: Mapping[str, Mapping[str, float]]) -> list[Computation]:
    """What joints draw in the robot's own walk and in the optima at its speed, by heat; its own walk on softer servos."""
    plain, fed = Drive(feed_forward="none"), Drive()
    gaits: dict[str, tuple[Drive, Mapping[str, float], str]] = {
        "own": (fed, {}, ""),
        "own-plain": (plain, {}, ""),
        **{f"optimum-{_word(name)}": (fed, x, name) for name, x in optima.items()},
    }
    found = [
        Computation(
            name=f"joints-{title}",
            inputs={**_own(), "x": dict(x), "drive": repr(drive), "steps": effort.walked, "K": name},
            function=partial(by_joint, drive, x, name, effort.walked),
        )
        for title, (drive, x, name) in gaits.items()
    ]
    for feed_forward in ("none", "torque"):
        for share in effort.stiffnesses:
            drive = Drive(full_error_rad=fed.full_error_rad / share, feed_forward=feed_forward)
            found.append(
                Computation(
                    name=f"servos-{feed_forward}-{share:g}",
                    inputs={
                        **_own(),
                        "drive": repr(drive),
                        "steps": effort.walked,
                        "lengths": effort.steps_m,
                        "disturbed": effort.disturbed,
                    },
                    function=partial(on_servos, drive, effort.walked, effort.steps_m, effort.disturbed),
                )
            )
    return found


def over_speed(spec: ProblemSpec, speeds: Sequence[float], starts: int) -> list[dict[str, Any]]:
    """Cheapest gait at each speed."""
    gaits = optimal_gaits(spec, Axis(name="speed_m_s", values=tuple(speeds)), starts=starts, seed=0)
    return [
        {
            "speed_m_s": gait.at,
            "feasible": gait.found.feasible,
            "cost_of_transport": gait.indexes["cost_of_transport"],
            "energy_J_per_m": gait.indexes["energy_J_per_m"],
            "x": dict(gait.found.x),
        }
        for gait in gaits
    ]


def at_heights(heights: Sequence[float]) -> list[dict[str, float]]:
    """The robot's own walk with other heights of its torso; those that no leg reaches are left out."""
    found = []
    for height in heights:
        try:
            walk = own_walk(documented(torso_m=height))
        except InputError:
            continue
        plan = make_plan(walk)
        found.append({"torso_m": height, **_model(plan), "knee_deg": knee_deg(walk)})
    return found


def free_height(spec: ProblemSpec, starts: int) -> dict[str, Any]:
    """Cheapest gait at the default speed whose hip may rise until the legs are stretched, and within the paper's bounds."""
    found: dict[str, Any] = {}
    for name, bounds in (("free", {f"{variable}.upper": STRETCHED_M for variable in HEIGHTS}), ("paper", {})):
        problem = spec.load().with_values(speed_m_s=SPEED_M_S, **bounds)
        solution = solve(problem, starts=starts, seed=0)
        result = Result(problem=problem, x=problem.check_x(solution.x))
        found[name] = {
            "success": solution.converged,
            "power_W": solution.objective,
            "hip_m": float(finely_sampled(result).arrays["hip"][:, 2].mean()),
            "knee_deg": knee_deg(result),
        }
    return found


def by_joint(drive: Drive, x: Mapping[str, float], heat: str, steps: int) -> dict[str, Any]:
    """Energy for each metre by kind of joint, in the model and in the engine, with both heat constants [J/m].

    Args:
        drive: of the playback.
        x: of an optimum; empty for the robot's own walk.
        heat: key of ``SPECS`` that the optimum is one of.
        steps: that are played.
    """
    if x:
        problem = SPECS[heat].load().with_values(speed_m_s=SPEED_M_S)
        result = Result(problem=problem, x=problem.check_x(x))
    else:
        result = own_walk(documented())
    plan = make_plan(result, steps)
    trace = simulate_plan(plan, drive=drive)
    during = trace.t <= plan.duration_s
    arrays = plan.signals.arrays
    planned, (walked, _) = planned_distance(plan), walked_distance(trace)
    return {
        "fell_at_s": trace.fell_at_s,
        "planned_m": planned,
        "walked_m": walked,
        "duration_s": plan.duration_s,
        "knee_deg": knee_deg(result),
        "model": _kinds(plan, arrays["tau"], arrays["qd"], arrays["t"], planned),
        "engine": _kinds(plan, trace.torque[during], trace.qd[during], trace.t[during], walked),
    }


def on_servos(drive: Drive, steps: int, lengths: Sequence[float], disturbed: bool) -> dict[str, Any]:
    """The robot's own walk on some servos: energy and way, how often disturbances fell it, the fastest that stays up."""
    plan = make_plan(own_walk(documented()), steps)
    trace = simulate_plan(plan, drive=drive)
    during = trace.t <= plan.duration_s
    walked, _ = walked_distance(trace)
    fell = trace.fell_at_s is not None
    energy = _kinds(plan, trace.torque[during], trace.qd[during], trace.t[during], walked).values()
    worlds = _worlds() if disturbed else []
    falls = sum(simulate_plan(plan, world, drive).fell_at_s is not None for world in worlds)
    fastest = 0.0
    for length in lengths:
        longer = make_plan(own_walk(documented(step_m=length)), steps)
        tried = simulate_plan(longer, drive=drive)
        if tried.fell_at_s is None:
            fastest = max(fastest, walked_distance(tried)[0] / longer.duration_s)
    return {
        "fell": fell,
        "walked_share": None if fell else walked / planned_distance(plan),
        "speed_m_s": None if fell else walked / plan.duration_s,
        "sheet_J_per_m": None if fell else total(energy, "sheet"),
        "paper_J_per_m": None if fell else total(energy, "paper"),
        "tracking_rad": float(np.abs(plan.at("q", trace.t[during]) - trace.q[during]).max()),
        "falls": falls,
        "disturbances": len(worlds),
        "fastest_m_s": fastest,
    }


@cache
def own_walk(footsteps: Footsteps) -> Result:
    """The robot's own walk: preview control of a cart on a table over footsteps."""
    return cart_table_walk(nao_cycles(), footsteps)


def knee_deg(result: Result) -> float:
    """Mean angle of both knees over a step [degrees]."""
    signals = finely_sampled(result)
    t, q = signals.arrays["t"], signals.arrays["q"]
    knees = [column for column, joint in enumerate(signals.joints) if joint.endswith("KneePitch")]
    return math.degrees(float(trapezoid(q[:, knees].mean(axis=1), t) / (t[-1] - t[0])))


def heat_constants(robot: Robot, joints: Sequence[str]) -> Array:
    """K of each joint's motor from the data sheet [W/(Nm)^2]."""
    motors = [robot.joint(joint).motor for joint in joints]
    return np.array([motor.heat_W_per_Nm2 for motor in motors if motor is not None])


def _kinds(plan: Plan, torque: Array, rate: Array, t: Array, way_m: float) -> dict[str, dict[str, float]]:
    """By kind of joint: mechanical energy, and heat with the paper's constant and those of the data sheet [J/m]."""
    mechanical = trapezoid(np.abs(torque * rate), t, axis=0)
    paper = plan.heat_loss * trapezoid(torque**2, t, axis=0)
    by_motor = torque.copy()
    first, second = (plan.joints.index(joint) for joint in YAW_PITCHES)  # one motor turns both
    by_motor[:, first], by_motor[:, second] = torque[:, first] + torque[:, second], 0.0
    sheet = heat_constants(plan.robot, plan.joints) * trapezoid(by_motor**2, t, axis=0)
    found = {kind: dict.fromkeys(("mechanical", "paper", "sheet"), 0.0) for kind in KINDS}
    for column, joint in enumerate(plan.joints):
        parts = found[joint[1:] if joint[1:] in KINDS else ARMS]
        for name, energy in (("mechanical", mechanical), ("paper", paper), ("sheet", sheet)):
            parts[name] += float(energy[column]) / way_m
    return found


def _model(plan: Plan) -> dict[str, float]:
    """Energy for each metre by the model, with the heat constant of the paper and with those of the data sheet [J/m]."""
    arrays = plan.signals.arrays
    kinds = _kinds(plan, arrays["tau"], arrays["qd"], arrays["t"], planned_distance(plan)).values()
    return {f"{heat}_J_per_m": total(kinds, heat) for heat in ("paper", "sheet")}


def total(kinds: Iterable[Mapping[str, float]], heat: str) -> float:
    """Energy of all kinds of joints [J/m]; ``heat`` is ``paper`` or ``sheet``."""
    return sum(parts["mechanical"] + parts[heat] for parts in kinds)


def _worlds() -> list[Conditions]:
    """Disturbances, each by itself."""
    pushes = [Push(impulse_Ns=(x * impulse, y * impulse)) for impulse in PUSHES_NS for x, y in DIRECTIONS]
    slopes = [math.radians(slope) for slope in SLOPES_DEG]
    return [
        *(Conditions(push=push) for push in pushes),
        *(Conditions(slope_rad=(x * slope, y * slope)) for slope in slopes for x, y in DIRECTIONS),
        *(Conditions(friction=friction) for friction in FRICTIONS),
        *(Conditions(mass_factor=factor) for factor in MASS_FACTORS),
    ]


def _own() -> dict[str, Any]:
    """What the robot's own walk depends on; the cycle stands for the robot's data."""
    return {**fingerprint(SPECS[PAPER_HEAT].load()), "footsteps": repr(documented())}


def _with_heat(heat: float) -> ProblemSpec:
    return ProblemSpec(name=CYCLE, options={"objective": "power"}, values={"heat_loss_W_per_Nm2": heat})


def _word(heat: str) -> str:
    return heat.split()[-1]
