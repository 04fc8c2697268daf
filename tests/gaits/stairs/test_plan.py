"""The planner: feasible on a dense grid, never beaten by a search, clear about what forbids a stair; and a climb's steps."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import scipy.integrate
from casadi import DM, MX, SX

import nlp_gait
from compare.judge import evaluate
from compare.papers.stairs.printed import TABLE_3, TABLE_4
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.stairs.planar_biped import GRAVITY, MOVING, load_toe_foot_biped
from nlp_gait.gaits.stairs.planned_motion import Stair, StairPlan, locate_ankle, locate_hip, move_in_time
from nlp_gait.gaits.stairs.stair import PAPER_TIMES, limit_knees
from nlp_gait.simulation.plan import make_plan
from tests.evaluation import evaluated

# Best of 20 starts, case 2 of Table IV.
BEST_ENERGY_J = 110.880
# Best known governing parameters rounded: a start from which the optimum is found in a second or two, without the run that
# finds the rows that matter.
NEAR_BEST = (0.69, 0.09, 0.24, 0.09, 0.7, 1.45, 0.58, 0.8, 1.3, 0.32, 0.12)
SOLVER = nlp_gait.IpoptSettings(compiled=False, hessian="limited-memory")

# Lower and upper limit of each link's angle and of both knees' [rad], and what counts as a violation of 1.
LIMITS = {
    **{"HK": (0.2, 2.4), "KA": (0.3, 3.2), "HK'": (0.3, 2.4), "K'A'": (0.8, 2.8), "UH": (0.8, 1.75)},
    **{"AS": (-0.6, 1.2), "ST": (-0.6, 1.2), "knee": (0.1, 2.5), "knee'": (0.1, 2.5)},
}
SCALES = {
    **{"reach": 0.1, "link_angle": 0.1, "knee_angle": 0.1, "link_acceleration": 10.0, "stance_load": 100.0},
    **{"friction": 100.0, "stance_zmp": 0.01, "clearance": 0.01, "phase_duration": 0.1},
}


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("stairs-plan")


@pytest.fixture(scope="module")
def solution(problem: GaitProblem) -> nlp_gait.Solution:
    return nlp_gait.solve(problem, x0=NEAR_BEST, solver=SOLVER)


def test_stairs_and_times_are_those_that_the_paper_prints(problem: GaitProblem) -> None:
    """As entered a second time, for the report on the paper."""
    assert {name: problem.value(name) for name in TABLE_4[2].stair} == TABLE_4[2].stair
    assert PAPER_TIMES == tuple(TABLE_3[name] for name in ("t1_s", "t2_s", "t_bc_s", "t3_s"))


def test_limits_and_scales_of_rows(problem: GaitProblem) -> None:
    model = build_exact_model(problem)
    at = model.at(np.array(NEAR_BEST), problem.p)
    rows = zip(model.row_names, at.lower, at.upper, model.row_scales, strict=True)
    found = [(*name.rstrip("]").partition("["), *numbers) for name, *numbers in rows]
    limits = {of.partition(",")[0]: (low, high) for row, _, of, low, high, _ in found if "_angle" in row}
    assert limits == LIMITS
    assert {row: scale for row, _, _, _, _, scale in found if row != "bounds"} == SCALES
    (zmp,) = {(low, high) for row, _, _, low, high, _ in found if row == "stance_zmp"}
    assert zmp == pytest.approx((0.01, load_toe_foot_biped().foot_m - 0.01))


def test_optimum_is_known_and_feasible_on_the_dense_grid(problem: GaitProblem, solution: nlp_gait.Solution) -> None:
    assert solution.converged, solution.status
    assert solution.objective == pytest.approx(BEST_ENERGY_J, rel=1e-4)
    judged = evaluate(problem, solution.x, prove=False)
    assert judged.feasible
    assert not judged.dense_violations
    assert judged.dense is not None
    assert judged.dense["energy_J"] == pytest.approx(solution.objective, rel=0.01)


def test_an_impossible_stair_names_what_forbids_it(problem: GaitProblem) -> None:
    steep = problem.with_values(stair_length_m=0.508, rise_run_ratio=0.5 / 0.254)
    refused = nlp_gait.solve(steep, x0=NEAR_BEST, solver=replace(SOLVER, iterations=15))
    assert not refused.converged
    assert "violated: " in refused.status
    assert refused.worst_violations[0].name.startswith(("reach", "link_", "knee_angle"))


def test_energy_is_the_integral_of_power() -> None:
    """Against SciPy, phase by phase; both ends of a phase are samples."""
    problem = nlp_gait.load("stairs-plan")
    x = problem.check_x(NEAR_BEST)
    arrays = problem.signals(x).arrays
    t, power = (np.split(values, 4) for values in (arrays["t"], np.abs(arrays["power"]).sum(axis=1)))
    energy = sum(scipy.integrate.trapezoid(p, x=instants) for p, instants in zip(power, t, strict=True))
    assert evaluate(problem, x).metrics["energy_J"] == pytest.approx(energy, rel=1e-12)


PLAN = dict.fromkeys(StairPlan._fields, 0.1)
PLAN |= {"hip_height": 0.69, "hip_start": 0.09, "zmp_start": 0.24, "zmp_end": 0.09}
TIMES = {"t1": 0.5, "t2": 1.4, "t_bc": 2.2, "t3": 3.5}
TREAD_M, RISE_M = 0.254, 0.1778


@pytest.mark.parametrize("speed", [1.0, 10.0])
@pytest.mark.parametrize("phase", range(4))
def test_the_hip_is_a_pendulum_over_the_planned_zmp(phase: int, speed: float) -> None:
    """Its acceleration is w^2 (x - zmp), also in a step so fast that neither of its exponentials has faded."""
    times = {name: value / speed for name, value in TIMES.items()}
    fast = StairPlan(**{name: SX(value) for name, value in {**PLAN, **times}.items()})
    s, passing = SX.sym("s", 4), SX.sym("passing", 4)
    motion = move_in_time(locate_hip(fast, Stair(SX(TREAD_M), SX(RISE_M)), s), s, passing / fast.durations)
    at = ca.Function("hip", [s, passing], [motion.position[0], motion.acceleration[0], ca.dot(fast.durations, s)])
    x, acceleration, t = (float(part) for part in at([1.0] * phase + [0.3] + [0.0] * (3 - phase), np.eye(4)[phase]))
    way, passed = TREAD_M + PLAN["zmp_end"] - PLAN["zmp_start"], t / times["t3"]
    zmp = PLAN["zmp_start"] + way * passed**2 * (3 - 2 * passed)
    assert acceleration == pytest.approx(GRAVITY / PLAN["hip_height"] * (x - zmp), rel=1e-9, abs=1e-9)
    ends = [float(at([end] * 4, [0] * 4)[0]) for end in (0, 1)]
    assert ends == pytest.approx([PLAN["hip_start"], PLAN["hip_start"] + TREAD_M], abs=1e-12)


def test_the_ankle_goes_on_from_the_bridge_to_the_cycloid_with_one_velocity() -> None:
    plan, s, h = StairPlan(**{k: SX(v) for k, v in {**PLAN, **TIMES}.items()}), SX.sym("s", 4), 1e-6
    ankle = ca.Function("ankle", [s], [locate_ankle(plan, Stair(SX(TREAD_M), SX(RISE_M)), s)])
    before, at, after = (np.array(ankle([1, 1, *ends])).ravel() for ends in ((1 - h, 0), (1, 0), (1, h)))
    bridge, track = (float(duration) for duration in ca.vertsplit(plan.durations)[2:])
    assert (at - before) / bridge == pytest.approx((after - at) / track, rel=1e-4)


def test_a_knee_is_its_shank_less_its_thigh() -> None:
    q = {link: float(k**2) for k, link in enumerate(MOVING)}
    knees = np.array(ca.evalf(limit_knees("knee_angle", MX(DM(list(q.values())))).value)).ravel()
    assert knees.tolist() == [q["KA"] - q["HK"], q["K'A'"] - q["HK'"]]


def test_feet_alternate_from_the_floor_to_the_last_stair() -> None:
    problem = nlp_gait.load("stairs-climb", stairs=3, intervals=12)
    plan = make_plan(Result(problem=problem, x=problem.start_point(np.random.default_rng(1))))
    steps = plan.duration_s / 4 * np.arange(5)
    feet = {side: plan.at(f"{side}_foot", steps) for side in ("left", "right")}
    for side, levels in (("left", [0, 0, 2, 2, 3]), ("right", [0, 1, 1, 3, 3])):
        # A start point has noise: the swing foot lands centimetres off.
        np.testing.assert_allclose(feet[side][:, 0], np.multiply(TREAD_M, levels), atol=0.06)
        np.testing.assert_allclose(feet[side][:, 2], np.multiply(RISE_M, levels), atol=0.06)
    assert [tread.height_m for tread in plan.ground] == pytest.approx([RISE_M, 2 * RISE_M, 3 * RISE_M])


def test_the_effort_counts_every_step_and_no_step_is_computed_twice() -> None:
    two, five = (nlp_gait.load("stairs-climb", stairs=stairs, intervals=12) for stairs in (2, 5))
    x = two.start_point(np.random.default_rng(1))
    assert two.names == five.names
    one_more = nlp_gait.load("stairs-climb", stairs=3, intervals=12)
    efforts = [evaluated(problem, x).cost for problem in (two, one_more, five)]
    assert efforts[2] - efforts[1] == pytest.approx(2 * (efforts[1] - efforts[0]))


def test_a_search_and_a_single_stair_are_refused() -> None:
    with pytest.raises(InputError, match="use solve"):
        nlp_gait.compile_objective(nlp_gait.load("stairs-climb", stairs=2, intervals=12))
    with pytest.raises(InputError, match=">= 2"):
        nlp_gait.load("stairs-climb", stairs=1)
