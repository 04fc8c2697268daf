"""What holds for every problem: total exact functions, a violation that means what it says, and an NLP that agrees."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import WIDTHS, NlpModel, build_nlp
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Outcome
from nlp_gait.providers import PROBLEMS
from tests.evaluation import evaluated

# Left out of all but the first test, with the reason.
TRANSCRIBED = {
    "stairs-climb": "thousands of variables tied by equations: no candidate of a search is feasible",
    "nao-walk": "five pairs of states tied by seven phases: planned from a walk of NAO, no random candidate is feasible",
    "humanoid-walk": "likewise",
}
SEARCHABLE = [name for name in PROBLEMS if name not in TRANSCRIBED]
# A start of the others takes seconds; the tests of stairs, humanoids and walking solve them.
SOLVABLE = [name for name in SEARCHABLE if not name.startswith("stairs-") and not name.endswith("-cycle")]
INTERVALS = {"nao-ssp": 4, "nao-dsp": 4, "humanoid-ssp": 4, "humanoid-dsp": 4}
SOLVER = IpoptSettings(compiled=False, hessian="limited-memory")
DERIVATIVES = {"nao-ssp": ("analytic", "finite-difference"), "nao-dsp": ("analytic", "finite-difference")}
VARIANTS = [(name, kind) for name in SEARCHABLE for kind in DERIVATIVES.get(name, (None,))]
of_every_variant = pytest.mark.parametrize(
    ("name", "kind"), VARIANTS, ids=[f"{n} {k or ''}".strip() for n, k in VARIANTS]
)

# The other is a closed loop with contacts that begin and end: a difference across one of them is no derivative.
SMOOTH = [name for name in SEARCHABLE if name != "stairs-track"]

# Squares of squares of squares stay below 1e308; beyond, a candidate overflows and counts as a failed evaluation.
FARTHEST = 1e30
# The same sums in another order.
ROUNDING = 1e-12
# IPOPT's tolerance of 1e-8 on scaled rows, times the number of lifted variables in the sum and slopes of order ten.
SOLVED = 1e-5
# Central differences with this step on functions of order one, whose third derivatives reach 1e5; rounding gives 1e-9.
DIFFERENCE_STEP, DIFFERENCE_TOLERANCE = 1e-6, 1e-5


@cache
def problem_of(name: str, kind: str | None = None) -> GaitProblem:
    return load(name) if kind is None else load(name, derivatives=kind)


def test_what_is_left_out_is_left_out_for_its_reason() -> None:
    assert set(TRANSCRIBED) == {name for name in PROBLEMS if not problem_of(name).searchable}


far = (
    st.floats(-FARTHEST, FARTHEST) | st.floats(-10.0, 10.0) | st.sampled_from([0.0, -0.0, 1e-300, FARTHEST, -FARTHEST])
)


@of_every_variant
@settings(max_examples=20)
@given(data=st.data())
def test_every_output_is_finite_for_every_finite_x(name: str, kind: str | None, data: st.DataObject) -> None:
    problem = problem_of(name, kind)
    x = np.array(data.draw(st.lists(far, min_size=len(problem.names), max_size=len(problem.names))))
    found = evaluated(problem, x)
    assert np.isfinite([found.cost, found.violation, *found.g, *found.metrics.values()]).all()


@of_every_variant
@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), outside=st.booleans())
def test_a_violation_is_zero_if_and_only_if_every_row_holds(
    name: str, kind: str | None, seed: int, outside: bool
) -> None:
    """Also with limits so wide that many candidates are feasible; and it is the sum over rows in units of their scales."""
    problem = problem_of(name, kind)
    rng = np.random.default_rng(seed)
    share = rng.uniform(-0.1, 1.1, len(problem.names)) if outside else rng.random(len(problem.names))
    x = problem.lower + share * problem.scale
    for candidate in (problem, relaxed(problem)):
        found = evaluated(candidate, x)
        excess = np.maximum(np.maximum(found.lower - found.g, found.g - found.upper), 0.0)
        assert (found.violation == 0.0) == (not found.broken)
        assert found.violation == pytest.approx(
            float(excess @ (1 / build_exact_model(problem).row_scales)), rel=ROUNDING
        )


def relaxed(problem: GaitProblem) -> GaitProblem:
    """The problem with every limit far away, so that most candidates within the bounds are feasible."""
    wide = {}
    for parameter in problem.own_parameters:
        if parameter.name.endswith((".lower", "_min_limit_m", "_mean_limit_m")):
            wide[parameter.name] = max(-1e3, parameter.minimum)
        elif parameter.name.endswith((".upper", "_limit_Nm")):
            wide[parameter.name] = min(1e3, parameter.maximum)
    return problem.with_values(**wide)


@cache
def solve_once(name: str) -> tuple[GaitProblem, Outcome]:
    """On a coarse grid where there is a choice, from one start, with all rows at once, without second derivatives."""
    problem = load(name, intervals=INTERVALS[name]) if name in INTERVALS else problem_of(name)
    return problem, SOLVER.run(problem, problem.start_point(np.random.default_rng(0)))


@pytest.mark.parametrize("name", SOLVABLE)
def test_at_an_optimum_the_lifted_objective_is_the_exact_one(name: str) -> None:
    problem, end = solve_once(name)
    assert end.converged and end.guess is not None
    model = build_nlp(problem)
    lifted = ca.Function("lifted", [model.nlp["x"], model.nlp["p"]], [model.nlp["f"]])
    cost = float(lifted(end.guess.primal, np.append(problem.p, WIDTHS[-1])))
    assert cost == pytest.approx(end.cost, rel=SOLVED)
    assert end.violation <= FEASIBILITY_TOLERANCE


@pytest.mark.parametrize("name", SOLVABLE)
def test_no_start_ends_below_what_the_exact_functions_find_around_it(name: str) -> None:
    """Feasible neighbours of an optimum are not better."""
    problem, end = solve_once(name)
    rng = np.random.default_rng(1)
    for size in (1e-2, 1e-3, 1e-4):
        for _ in range(100):
            x = np.clip(end.x + size * problem.scale * rng.normal(size=end.x.size), problem.lower, problem.upper)
            found = evaluated(problem, x)
            if found.violation == 0.0:
                assert found.cost >= end.cost * (1 - np.sign(end.cost) * SOLVED)


def inside(name: str) -> tuple[NlpModel, Array, Array]:
    """NLP, a start point of its variables within the bounds, and its parameters with the widest sigmoid."""
    problem = problem_of(name)
    model = build_nlp(problem)
    start = model.start(problem, problem.start_point(np.random.default_rng(0)), WIDTHS[0])
    return model, start, np.append(problem.p, WIDTHS[0])


def assert_derivative(function: ca.Function, slope: ca.Function, at: Array, rest: tuple[Array, ...]) -> None:
    """A slope (w, direction, ...) against central differences of a function (w, ...) along random directions."""
    rng = np.random.default_rng(2)
    for _ in range(3):
        direction = rng.normal(size=at.size)
        up, down = (np.array(function(at + s * DIFFERENCE_STEP * direction, *rest)).ravel() for s in (1, -1))
        expected = np.array(slope(at, direction, *rest)).ravel()
        tolerance = DIFFERENCE_TOLERANCE * np.abs(expected).max()
        np.testing.assert_allclose((up - down) / (2 * DIFFERENCE_STEP), expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", SMOOTH)
def test_the_hessian_is_the_difference_of_gradients(name: str) -> None:
    """Of the Lagrangian with random multipliers."""
    model, at, values = inside(name)
    x, p, f, g = (model.nlp[key] for key in "xpfg")
    multipliers, direction = ca.MX.sym("multipliers", g.shape[0]), ca.MX.sym("direction", x.shape[0])
    gradient = ca.gradient(f + ca.dot(multipliers, g), x)
    slope = ca.Function("slope", [x, p, multipliers], [gradient])
    bend = ca.Function("bend", [x, direction, p, multipliers], [ca.jtimes(gradient, x, direction)])
    assert_derivative(slope, bend, at, (values, np.random.default_rng(3).normal(size=g.shape[0])))


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in ("humanoid-dsp", "humanoid-cycle") else [])
        for name in SMOOTH
    ],
)
def test_gradient_and_jacobian_are_differences_of_values(name: str) -> None:
    model, at, values = inside(name)
    x, p, f, g = (model.nlp[key] for key in "xpfg")
    both, direction = ca.vertcat(f, g), ca.MX.sym("direction", x.shape[0])
    value = ca.Function("value", [x, p], [both])
    slope = ca.Function("slope", [x, direction, p], [ca.jtimes(both, x, direction)])
    assert_derivative(value, slope, at, (values,))


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_row_and_index_has_its_own_name(name: str) -> None:
    model = build_exact_model(problem_of(name))
    for names in (model.row_names, model.metric_names):
        assert len(set(names)) == len(names)
    assert len(model.row_names) == len(model.row_units) == len(model.row_scales)
    assert (model.row_scales > 0.0).all()


UNITS = {
    "hip z": "m",
    "power knee": "W",
    "link_q UH": "rad",
    "stance_force z": "N",
    "reach swing knee": "1",
    "zmp x": "m",
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_time_history_has_its_unit_and_is_drawn(name: str) -> None:
    problem = problem_of(name)
    signals = problem.signals(problem.start_point(np.random.default_rng(0)))
    table = list(signals.named_columns())
    units = {column: unit for column, unit, _ in table}
    assert len(units) == len(table) == sum(a.size for a in signals.arrays.values()) // len(signals.arrays["t"])
    assert all(units.get(column, unit) == unit for column, unit in UNITS.items())
    assert name != "stairs-plan" or UNITS.keys() <= units.keys()
    if problem.display.skeleton is None:
        assert name == "stairs-climb"
        return
    skeleton = problem.display.skeleton(signals, problem.parameter_values)
    low, high = skeleton.box()
    assert np.isfinite(low).all() and (high - low).max() > 0.1
    assert all(len(limb.points) == len(skeleton.t) for limb in skeleton.limbs)


RICHER = [("nao-ssp", {"trajectory": "spline-2"}), ("nao-dsp", {"trajectory": "quintic"})]
# Central differences on a hundredth of the grid's steps, relative to the largest rate; at switches of phases rates may jump.
RATE_TOLERANCE, SMOOTH_SHARE = 1e-4, 0.95
# Without a denser grid; and a walk of noise, which it takes many more samples to follow.
NO_RATES = ("stairs-track", "stairs-climb", "humanoid-walk")


@pytest.mark.parametrize(("name", "options"), [*((name, {}) for name in PROBLEMS if name not in NO_RATES), *RICHER])
def test_velocities_and_accelerations_are_the_derivatives_of_the_angles(name: str, options: dict[str, str]) -> None:
    problem = load(name, **options).dense(100)
    arrays = problem.signals(problem.start_point(np.random.default_rng(0))).arrays
    steps = np.diff(arrays["t"])
    within = (steps[1:] > 0.0) & (steps[:-1] > 0.0)
    for value, rate in (("q", "qd"), ("qd", "qdd")):
        change, largest = arrays[value][2:] - arrays[value][:-2], np.abs(arrays[rate]).max()
        slope = change[within] / (steps[1:] + steps[:-1])[within, None]
        error = np.abs(slope - arrays[rate][1:-1][within]).max(axis=1)
        assert largest > 0.01 and np.quantile(error, SMOOTH_SHARE) < RATE_TOLERANCE * largest
