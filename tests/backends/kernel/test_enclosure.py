"""Enclosures hold every value and slope of the exact functions, over wide and narrow boxes, and are tight for narrow ones."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import MX

import nlp_gait
from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.kernel.enclosure import Enclosure
from nlp_gait.problem import Array, Constraint, GaitProblem
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import row, toy

SEED = 5
POINTS = 40


def every_operation(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """What the intervals know, each term over points of both signs."""
    angle = ca.acos(0.9 * ca.sin(x))
    wave = ca.sin(3 * x) * ca.cos(2 * y) + ca.atan2(y, x + 5) + ca.tanh(x) + ca.exp(-y) + ca.log(y + 1.5) + angle
    kink = ca.fabs(x) + ops.min(x, y) + ca.fmax(x * y, 0.3) + ops.step(x - 0.2, y, 2 * y)
    return wave / (1.1 + x**2) + ca.sqrt(x * x + 0.1) + ca.asin(0.5 * ca.cos(y)), (row(kink, lower=limit),)


def boxes_of(problem: GaitProblem, rng: np.random.Generator) -> list[Array]:
    """Random boxes (n, 2) of falling width within the bounds."""
    found = []
    for width in np.geomspace(1.0, 1e-6, 13):
        middle = rng.uniform(problem.lower, problem.upper)
        half = width * problem.scale / 2
        found.append(np.stack([np.maximum(problem.lower, middle - half), np.minimum(problem.upper, middle + half)], -1))
    return found


@pytest.mark.parametrize("name", ["toy", "walk12"])
def test_enclosures_hold_values_and_slopes_at_random_points(name: str) -> None:
    problem = toy(every_operation) if name == "toy" else nlp_gait.load("walk12", intervals=4)
    enclosure, rng = Enclosure(problem), np.random.default_rng(SEED)
    exact = exact_model(problem).function
    x, p = exact.mx_in()
    cost, _, g, *_ = exact.call([x, p], True, False)
    both = ca.vertcat(cost, g)
    function = ca.Function("f", [x, p], [both, ca.jacobian(both, x)])
    for box in boxes_of(problem, rng):
        values, rows = enclosure.values(box[None])
        gradient, jacobian = enclosure.gradient(box[None]), enclosure.jacobian(box[None])
        held = np.concatenate([values, rows[0]])
        slopes = np.concatenate([gradient, jacobian[0]])
        for point in rng.uniform(box[:, 0], box[:, 1], (POINTS, len(box))):
            exactly, slope = (np.array(v) for v in function(point, problem.p))
            assert np.all((held[:, 0] <= exactly[:, 0]) & (exactly[:, 0] <= held[:, 1]))
            known = np.isfinite(slope)
            assert np.all(((slopes[..., 0] <= slope) & (slope <= slopes[..., 1]))[known])


def test_a_narrow_box_has_a_narrow_enclosure() -> None:
    problem = nlp_gait.load("walk12", intervals=4)
    middle = np.array([0.09, 0.06, 0.06, 0.06])
    widths = []
    for half in (1e-3, 1e-5):
        box = np.stack([middle - half, middle + half], -1)
        widths.append(float(np.diff(Enclosure(problem).values(box[None])[0])[0, 0]))
    assert widths[1] < 0.02 * widths[0]


def test_a_quotient_by_zero_and_a_root_of_something_negative_are_the_whole_line() -> None:
    def singular(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return 1 / x, (row(ca.sqrt(y), lower=limit),)

    values, rows = Enclosure(toy(singular)).values(np.array([[[-1.0, 1.0], [-0.5, 1.0]]]))
    assert values[0].tolist() == [-np.inf, np.inf]
    assert rows[0, 0].tolist() == [-np.inf, np.inf]
