"""The climb on stairs in the engine."""

from __future__ import annotations

from collections.abc import Iterator

import nlp_gait
from benchmarks.engine.markdown import cells, header
from compare.papers.stairs.printed import TABLE_3 as STAIRS_TABLE_3
from compare.papers.stairs.printed import TABLE_4 as STAIRS_TABLE_4
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Measurements, measure
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

CASE = 2  # of Table IV, the problems' default


def stairs() -> Iterator[str]:
    """One step up: plans and tracked steps; energies in J, |torque x rate|."""
    yield header("gait", "result", "model J", "engine J", "tilt deg", "slip mm", "CoP mm", "middle", "landing mm")
    for label, result in climbs():
        plan = make_plan(result)
        m = measure(plan, simulate_plan(plan), Drive())
        landing = 1e3 * m.landing_errors_m["right"]
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


def describe_result(m: Measurements) -> str:
    """In two words."""
    return "stays up" if m.fell_at_s is None else f"falls at {m.fell_at_s:.1f} s"


def climbs() -> Iterator[tuple[str, Result]]:
    """Gaits on the stairs, each with its name."""
    plan, track = (nlp_gait.load(f"stairs-{name}") for name in ("plan", "track"))
    for case, printed in STAIRS_TABLE_4.items():
        sized = plan.with_values(stair_length_m=printed.stair_length_m, rise_run_ratio=printed.rise_run_ratio)
        yield f"plan, optimum, case {case}", optimal_climb(sized)
    case_2 = STAIRS_TABLE_4[CASE]
    times = {name: value for name, value in STAIRS_TABLE_3.items() if name in plan.names}
    times["torso_pitch_rad"] = case_2.torso_pitch_rad
    for label, fixed in (("", times), (", hip height free", {k: v for k, v in times.items() if k != "hip_height_m"})):
        yield f"plan, paper's Table III{label}", _at(plan, nlp_gait.solve(plan.fix(**fixed), starts=2, seed=0).x)
    printed_loop = track.with_values(gravity_compensation=0.0)
    yield "tracked, paper's gains", _at(printed_loop, (case_2.kp, case_2.kd, case_2.torso_pitch_rad))
    yield "tracked, optimum", _at(track, nlp_gait.solve(track, starts=1, seed=0).x)


def optimal_climb(problem: GaitProblem) -> Result:
    """Best of three starts of IPOPT."""
    return _at(problem, nlp_gait.solve(problem, starts=3, seed=0).x)


def _at(problem: GaitProblem, x: object) -> Result:
    return Result(problem=problem, x=problem.check_x(x))  # type: ignore[arg-type]
