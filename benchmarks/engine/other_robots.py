"""The robots of the other two papers in the engine: the 12-joint walk, and the climb on stairs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

import nlp_gait
from benchmarks.engine.agreement import STEPS
from benchmarks.engine.markdown import cells, header
from benchmarks.engine.sensitivity import engine_step
from compare.papers.stairs.stairs_paper import TABLE_3 as STAIRS_TABLE_3
from compare.papers.stairs.stairs_paper import TABLE_4 as STAIRS_TABLE_4
from compare.papers.walk12.walk12_paper import TABLE_3, TABLE_4, PaperRow, find_row
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.walk12 import walk12_display
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Measurements, Walk, measure, measure_walk
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import Conditions, simulate_plan

CASE = 2  # of Table IV, the problems' default
# What the ideal step keeps in reserve: ZMP 4 cm inside the foot, 100 N on it, friction that exists.
RESERVES = {"zmp_margin_m": 0.04, "least_stance_force_N": 100.0, "stance_friction": 0.6}
VARIANTS = {
    "default": Drive(),
    **{f"largest torque at {error:g} rad": Drive(full_error_rad=error) for error in (0.16, 0.04)},
    **{f"damping / stiffness {seconds:g} s": Drive(time_constant_s=seconds) for seconds in (0.01, 0.05)},
    "velocity feed-forward only": Drive(feed_forward="velocity"),
    "no feed-forward": Drive(feed_forward="none"),
}

# Radius of a point mass [m], and the sole's share of the foot's mass.
SPHERES = {"SPHERE_RADIUS": (0.01, 0.03), "SOLE_SHARE": (0.03, 0.3)}


def walk12() -> Iterator[str]:
    """The 12-joint walk, ten steps: the paper's gaits (Tables III and IV), our optima, a circle."""
    yield header(
        "gait",
        "ZMP in the sole, share",
        "result",
        "steps",
        "distance",
        "tilt, first step",
        "CoP mm",
        "model J/m",
        "engine",
    )
    for label, result in walks().items():
        plan = make_plan(result, STEPS)
        trace = simulate_plan(plan)
        found = measure_walk(plan, trace, Drive(), STEPS)
        m = found.measurements
        first = trace.t <= plan.duration_s / STEPS
        yield cells(
            label,
            f"{_stable_share(result):.2f}",
            describe_result(m),
            f"{found.steps_done}",
            "-" if found.walked_m is None else f"{found.walked_m / found.planned_m:.2f}",
            f"{math.degrees(float(trace.tilt[first].max())):.1f}",
            f"{1e3 * (m.pressure_rms_m or np.nan):.0f}",
            f"{found.model_J_per_m:.1f}",
            "-" if found.engine_J_per_planned_m is None else f"{found.engine_J_per_planned_m:.1f}",
        )


def stairs() -> Iterator[str]:
    """One step up: plans, tracked steps and the ideal; energies in J, |torque x rate|."""
    yield header("gait", "result", "model J", "engine J", "tilt deg", "slip mm", "CoP mm", "middle", "landing mm")
    for label, result in climbs():
        plan = make_plan(result)
        m = measure(plan, simulate_plan(plan), Drive())
        landing = 1e3 * m.landings["right"].error_m
        yield cells(
            label,
            describe_result(m),
            f"{m.predicted.mechanical_W * plan.duration_s:.1f}",
            "-" if m.fallen else f"{m.measured.mechanical_W * plan.duration_s:.1f}",
            f"{m.largest_tilt_deg:.1f}",
            f"{1e3 * m.slip_m:.1f}",
            *("-" if v is None else f"{1e3 * v:.1f}" for v in (m.pressure_rms_m, m.pressure_middle_rms_m)),
            f"{landing:.1f}",
        )


def other_gains() -> Iterator[str]:
    """How both fare with other gains, feed-forward, friction and steps of the engine."""
    climb = make_plan(optimal_climb(nlp_gait.load("stairs-plan")))
    fast, slow = find_row(0.15), TABLE_4[0]
    yield header(
        "variant",
        "stairs-plan J",
        "result",
        "CoP, middle mm",
        *(f"walk12, {printed.step_time_s:g} s: steps" for printed in (fast, slow)),
        "distance",
        "J per planned m",
    )

    def row(label: str, drive: Drive, conditions: Conditions | None = None) -> str:
        m = measure(climb, simulate_plan(climb, conditions, drive), drive)
        first, second = (_walked(printed, drive, conditions) for printed in (fast, slow))
        return cells(
            label,
            "-" if m.fallen else f"{m.measured.mechanical_W * climb.duration_s:.1f}",
            describe_result(m),
            f"{1e3 * (m.pressure_middle_rms_m or np.nan):.1f}",
            f"{first.steps_done}",
            f"{second.steps_done}",
            "-" if second.walked_m is None else f"{second.walked_m / second.planned_m:.2f}",
            "-" if second.engine_J_per_planned_m is None else f"{second.engine_J_per_planned_m:.1f}",
        )

    for label, drive in VARIANTS.items():
        yield row(label, drive)
    yield row("friction 0.4", Drive(), Conditions(friction=0.4))
    with engine_step(0.00025):
        yield row("engine step 0.25 ms", Drive())
    for name, values in SPHERES.items():
        for value in values:
            with spheres(name, value):
                yield row(f"walk12: {name.lower().replace('_', ' ')} {value:g}", Drive())


@contextmanager
def spheres(name: str, value: float) -> Iterator[None]:
    """Other bodies of the 12-joint biped's point masses."""
    before = getattr(walk12_display, name)
    setattr(walk12_display, name, value)
    walk12_display.make_rigid_bodies.cache_clear()
    try:
        yield
    finally:
        setattr(walk12_display, name, before)
        walk12_display.make_rigid_bodies.cache_clear()


def describe_result(m: Measurements) -> str:
    """In two words."""
    return "stays up" if m.fell_at_s is None else f"falls at {m.fell_at_s:.1f} s"


def _walked(printed: PaperRow, drive: Drive, conditions: Conditions | None) -> Walk:
    problem = nlp_gait.load("walk12").with_values(step_time_s=printed.step_time_s)
    plan = make_plan(_at(problem, printed.x), STEPS)
    return measure_walk(plan, simulate_plan(plan, conditions, drive), drive, STEPS)


def walks() -> dict[str, Result]:
    """Gaits of the 12-joint walk."""
    problem = nlp_gait.load("walk12")
    found = {f"paper, lambda {row.weight:g}": _at(problem, row.x) for row in TABLE_3}
    for row in TABLE_4:
        found[f"paper, {row.step_time_s:g} s"] = _at(problem.with_values(step_time_s=row.step_time_s), row.x)
    for values in ({"lambda": 0.15}, {"lambda": 0.15, "step_time_s": 2.0}, {"lambda": 1.0}):
        variant = problem.with_values(**values)
        name = ", ".join(
            f"{value:g} s" if key == "step_time_s" else f"{key} {value:g}" for key, value in values.items()
        )
        found[f"optimum, {name}"] = _at(variant, nlp_gait.solve(variant, starts=5, seed=0).x)
    turning = problem.with_values(turn_rad=math.radians(8.0))
    return found | {"paper, lambda 0.9, on a circle of 8 degrees a step": _at(turning, find_row(0.9).x)}


def climbs() -> Iterator[tuple[str, Result]]:
    """Gaits on the stairs, each with its name."""
    plan, track, ideal = (nlp_gait.load(f"stairs-{name}") for name in ("plan", "track", "ideal"))
    for case, printed in STAIRS_TABLE_4.items():
        sized = plan.with_values(stair_length_m=printed.stair_length_m, rise_run_ratio=printed.rise_run_ratio)
        yield f"plan, optimum, case {case}", optimal_climb(sized)
    case_2 = STAIRS_TABLE_4[CASE]
    times = {name: value for name, value in STAIRS_TABLE_3.items() if name in plan.names}
    times["torso_pitch_rad"] = case_2.torso_pitch_rad
    for label, fixed in (("", times), (", hip height free", {k: v for k, v in times.items() if k != "hip_height_m"})):
        yield f"plan, paper's Table III{label}", _at(plan, nlp_gait.solve(plan, starts=2, seed=0, fix=fixed).x)
    printed_loop = track.with_values(gravity_compensation=0.0)
    yield "tracked, paper's gains", _at(printed_loop, (case_2.kp, case_2.kd, case_2.torso_pitch_rad))
    yield "tracked, optimum", _at(track, nlp_gait.solve(track, starts=1, seed=0).x)
    for label, variant in (("ideal", ideal), ("ideal with reserves", ideal.with_values(**RESERVES))):
        yield label, _at(variant, nlp_gait.solve(variant, starts=1, seed=0).x)


def optimal_climb(problem: GaitProblem) -> Result:
    """Best of three starts of IPOPT."""
    return _at(problem, nlp_gait.solve(problem, starts=3, seed=0).x)


def _at(problem: GaitProblem, x: object) -> Result:
    return Result(problem=problem, x=problem.check_x(x))  # type: ignore[arg-type]


def _stable_share(result: Result) -> float:
    """Share of the step's time in which the planned ZMP is within the standing sole."""
    plan = make_plan(result, 1)
    foot, x, y = plan.robot.feet["left"], *plan.signals.arrays["zmp"].T
    within = (x >= -foot.back_m) & (x <= foot.front_m) & (y >= -foot.right_m) & (y <= foot.left_m)
    return float(within.mean())
