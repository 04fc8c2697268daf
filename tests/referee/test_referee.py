"""The papers' problems against themselves, written once more from the papers: every value by name, at many random x.

What a paper does not define (a pose out of reach, the centre of pressure under a foot that nothing loads) is left out, and the
number of points says how much that is.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem
from tests.referee import nao, stairs, walk12

POINTS = 250
AGREEMENT = 1e-9  # of a row's scale, or of its value where that is larger

Referee = Callable[[Array], Mapping[str, Array]]


def drawn(
    problem: GaitProblem, referee: Referee, drafts: int, allowed: Callable[[Array], Array] | None = None
) -> Array:
    """Random x (P, n) within the bounds whose legs reach at every sample."""
    X = np.random.default_rng(21).uniform(problem.lower, problem.upper, (drafts, len(problem.names)))
    if allowed is not None:
        X = X[allowed(X)]
    with np.errstate(invalid="ignore", divide="ignore"):
        rows = referee(X)
    reached = np.all([rows[name] < 1.0 for name in rows if name.startswith("reach")], axis=0)
    assert reached.sum() >= POINTS
    return X[reached][:POINTS]


def compared(problem: GaitProblem, referee: Referee, X: Array, of: str = "") -> dict[str, float]:
    """Largest disagreement by name of row or index, the objective among them; every row but the bounds of x has one.

    Args:
        problem: of the package.
        referee: of these tests.
        X: (P, n).
        of: only rows whose names begin so.
    """
    model = build_exact_model(problem)
    cost, _, g, _, _, metrics = (np.array(value) for value in model.function(X.T, problem.p))
    with np.errstate(invalid="ignore"):  # beyond the arc of the hip, between samples
        expected = referee(X)
    named = [*zip(model.row_names, model.row_scales, g, strict=True)]
    named += [(name, 1.0, values) for name, values in zip(model.metric_names, metrics, strict=True)]
    objective = problem.objective.name if problem.objective.name in expected else model.metric_names[0]
    named.append((objective, 1.0, problem.objective.sign * cost[0]))
    found: dict[str, float] = {}
    for name, scale, values in named:
        if name.startswith("bounds[") or not name.startswith(of):
            continue
        known = ~np.isnan(expected[name])
        assert known.sum() > POINTS // 2, name
        error = np.abs(values - expected[name])[known] / np.maximum(scale, np.abs(values[known]))
        found[name] = max(found.get(name, 0.0), float(np.nan_to_num(error, nan=np.inf).max()))
    return found


def worst(found: Mapping[str, float]) -> tuple[float, str]:
    """Largest disagreement and where it is."""
    return max((error, name) for name, error in found.items())


READINGS = [
    (nao.Reading(), {}),
    (nao.Reading(samples=10, as_printed=True), {"intervals": 9, "zmp_gravity": "printed"}),
    (
        nao.Reading(samples=10, as_printed=True, lumped=True),
        {"intervals": 9, "zmp_gravity": "printed", "zmp_masses": 23},
    ),
]
PHASES = {"single_support": "nao-ssp", "double_support": "nao-dsp"}


@pytest.mark.parametrize(
    ("phase", "reading", "options"),
    [
        pytest.param(
            phase, *reading, marks=() if reading is READINGS[0] and phase == "single_support" else pytest.mark.slow
        )
        for phase in PHASES
        for reading in READINGS
        if phase == "double_support" or not reading[0].lumped
    ],
)
def test_nao_phases_by_momentum_alone(phase: str, reading: nao.Reading, options: dict[str, Any]) -> None:
    """All rows, and power, against links whose momenta are Taylor series in time; no recursion of forces, no symbols."""
    problem = nlp_gait.load(PHASES[phase], **options)
    robot = nao.robot()

    def referee(X: Array) -> Mapping[str, Array]:
        return getattr(nao, phase)(X, robot, reading)  # type: ignore[no-any-return]

    found = compared(problem, referee, drawn(problem, referee, 300))
    n = reading.samples
    assert len(found) == 12 * n + 22 * (n - 1) + 2 * (n + 1) + 6
    assert worst(found)[0] < AGREEMENT, worst(found)


@pytest.mark.parametrize(("reading", "static"), [("exact", True), ("moment-free", False)])
def test_the_walk_of_twelve_joints(reading: str, static: bool) -> None:
    """Objective, both parts of it, the ZMP's extremes and reach, for eq. (14) and with the true vertical load."""
    problem = nlp_gait.load("walk12", zmp=reading)

    def referee(X: Array) -> Mapping[str, Array]:
        return walk12.walk(X, static_load=static)

    found = compared(problem, referee, drawn(problem, referee, 300))
    assert len(found) == 22 + 10
    assert worst(found)[0] < AGREEMENT, worst(found)


def in_order(X: Array) -> Array:
    """Steps on stairs whose four phases each take time."""
    return np.all(np.diff(X[:, 6:9], axis=1) > 0.05, axis=1)


@pytest.mark.parametrize(("length", "ratio", "agreement"), [(0.508, 0.70, AGREEMENT), (0.5588, 0.60, 1e-8)])
def test_the_planned_step_on_stairs(length: float, ratio: float, agreement: float) -> None:
    """Energy, jerk and all rows on a stair of Table IV, and on a flatter one, which stretches its cycloid.

    Where that begins, rounding leaves angle - sin(angle) = 1e-15 open by 1e-11 rad.
    """
    problem = nlp_gait.load("stairs-plan").with_values(stair_length_m=length, rise_run_ratio=ratio)

    def referee(X: Array) -> Mapping[str, Array]:
        return stairs.step(X, length, ratio)

    found = compared(problem, referee, drawn(problem, referee, 900, in_order))
    assert len(found) == 44 * 22 + 3 * 82 + 4 + 5
    assert worst(found)[0] < agreement, worst(found)


def test_reach_is_judged_alike_out_of_reach() -> None:
    """Also where the legs do not reach, and at knots out of order, what the papers still define is the same."""
    ssp, robot = nlp_gait.load("nao-ssp"), nao.robot()
    X = np.random.default_rng(3).uniform(ssp.lower, ssp.upper, (POINTS, len(ssp.names)))
    with np.errstate(invalid="ignore"):
        assert worst(compared(ssp, lambda X: nao.single_support(X, robot), X, "reach"))[0] < AGREEMENT
    plan = nlp_gait.load("stairs-plan")
    X = np.random.default_rng(3).uniform(plan.lower, plan.upper, (POINTS, len(plan.names)))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        assert worst(compared(plan, stairs.step, X, "phase_duration"))[0] < AGREEMENT
