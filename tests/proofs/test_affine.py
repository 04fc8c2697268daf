"""Affine and quadratic forms enclose every value: single operations against exact ones, problems at sampled points."""

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.gaits.nao.problems import LeastPower
from nlp_gait.proofs.affine import AffineForms, AffineFunction
from nlp_gait.proofs.nao.phases import make_power_form
from nlp_gait.proofs.quadratic import QuadraticForms, QuadraticFunction
from nlp_gait.proofs.quadratic_tape import PowerForm, PowerRows
from tests.proofs.soundness import best_x

flint = pytest.importorskip("flint")
arb, ctx, fmpq = flint.arb, flint.ctx, flint.fmpq
PRECISION = 200  # bits
Array = np.ndarray[Any, np.dtype[np.float64]]
Range = tuple[float, float]
# The operation in CasADi, the same in arb, and the range of its arguments.
Operation = tuple[Callable[..., Any], Callable[..., Any], Range]


def remainder(x: arb, divisor: float) -> arb:
    """Return the remainder of a division with the sign of x."""
    exact, part = exact_ends(x)[0], Fraction(divisor)
    rest = exact - (1 if exact > 0 else -1) * (abs(exact) // part) * part
    return arb(fmpq(rest.numerator, rest.denominator))


def unary(name: str, range_: Range, exact: str = "") -> Operation:
    return lambda x, y: getattr(ca, name)(x), lambda x, y: getattr(x, exact or name)(), range_


def same(formula: Callable[..., Any], range_: Range) -> Operation:
    return formula, formula, range_


BOTH: dict[str, Operation] = {
    "add": same(lambda x, y: x + y, (-1e3, 1e3)),
    "sub": same(lambda x, y: x - y, (-1e3, 1e3)),
    "mul": same(lambda x, y: x * y, (-1e3, 1e3)),
    "div": same(lambda x, y: x / y, (0.01, 1e3)),
    "divided by a negative": same(lambda x, y: x / (-y), (0.01, 1e3)),
    "tiny product": same(lambda x, y: x * 1e-200 * (y * 1e-200) * 1e300, (-1.0, 1.0)),
    "sq": same(lambda x, y: x**2, (-1e3, 1e3)),
    "sqrt": unary("sqrt", (0.0, 1e3)),
    "fabs": unary("fabs", (-1.0, 1.0), "__abs__"),
}
AFFINE: dict[str, Operation] = {
    **BOTH,
    "cube": same(lambda x, y: x**3, (-10.0, 10.0)),
    **{name: unary(name, (-10.0, 10.0)) for name in ("sin", "cos")},
    "tan": unary("tan", (-1.5, 1.5)),
    **{name: unary(name, (-1.0, 1.0)) for name in ("asin", "acos")},
    **{name: unary(name, (-20.0, 20.0)) for name in ("atan", "exp")},
    "atan2": (lambda x, y: ca.atan2(x, y), lambda x, y: arb.atan2(x, y), (-5.0, 5.0)),
    "log": unary("log", (1e-3, 1e3)),
    **{name: unary(name, (-5.0, 5.0)) for name in ("tanh", "sinh", "cosh", "floor")},
    "fmin": (lambda x, y: ca.fmin(x, y), lambda x, y: x.min(y), (-1.0, 1.0)),
    "fmax": (lambda x, y: ca.fmax(x, y), lambda x, y: x.max(y), (-1.0, 1.0)),
    "sign": unary("sign", (-1.0, 1.0), "sgn"),
    "fmod": (lambda x, y: ca.fmod(x, 0.7), lambda x, y: remainder(x, 0.7), (-5.0, 5.0)),
    "if_else_zero": (lambda x, y: ca.if_else(x >= 0, y, 0), lambda x, y: y if x >= 0 else arb(0), (-1.0, 1.0)),
    "composed": (
        lambda x, y: ca.sin(x * y) / (1.5 + ca.cos(x) * y) - ca.sqrt(x * x + 1) * (x - y),
        lambda x, y: (x * y).sin() / (1.5 + x.cos() * y) - (x * x + 1).sqrt() * (x - y),
        (-1.0, 1.0),
    ),
}
# The minimum of x and a number is taken as x: only points at which that is true count.
QUADRATIC: dict[str, Operation] = {
    **BOTH,
    "larger than a number": (lambda x, y: ca.fmax(x, 0.1), lambda x, y: x.max(arb(0.1)), (-1.0, 1.0)),
    "at most a number": (lambda x, y: ca.fmin(x, 2.0) * y, lambda x, y: x * y, (-1.0, 1.0)),
    "only below a number": (
        lambda x, y: ca.if_else(x < 0.1, y, 0),
        lambda x, y: y if x < arb(0.1) else arb(0),
        (-1.0, 1.0),
    ),
    "composed": (
        lambda x, y: x * y / (1.5 + x * y * y) - ca.sqrt(x * x + 1) * (x - y) * y,
        lambda x, y: x * y / (1.5 + x * y * y) - (x * x + 1).sqrt() * (x - y) * y,
        (-1.0, 1.0),
    ),
    "composed of squares": same(lambda x, y: (x - y) ** 2 - x**2 + 2 * x * y - y**2 + 1 / (2 + x), (-1.0, 1.0)),
}


def exact_ends(value: arb) -> tuple[Fraction, Fraction]:
    """Return the rational ends of a ball."""
    ends = (end.man_exp() for end in (value.lower(), value.upper()))
    low, high = (Fraction(int(m)) * Fraction(2) ** int(e) for m, e in ends)
    return low, high


def random_boxes(range_: Range, count: int, rng: np.random.Generator) -> Array:
    """Return (count, 2, 2) boxes of two arguments: points, tiny ones, and up to the whole range."""
    low, high = range_
    middle = rng.uniform(low, high, (count, 2))
    half = (high - low) * 10.0 ** rng.uniform(-17, 0.3, (count, 1)) * rng.uniform(0.1, 1.0, (count, 2))
    half[rng.random((count, 2)) < 0.1] = 0.0
    middle[rng.random((count, 2)) < 0.02] = low
    return np.stack([np.clip(middle - half, low, high), np.clip(middle + half, low, high)], -1)


def find_lost_values(name: str, count: int, rng: np.random.Generator, *, quadratic: bool = False) -> Iterator[str]:
    """Describe random points of random boxes at which the exact value of an operation is not enclosed."""
    operation, exact, range_ = (QUADRATIC if quadratic else AFFINE)[name]
    x = ca.SX.sym("x", 2)
    expression = ca.Function("operation", [x], [ca.SX(operation(x[0], x[1]))])
    boxes = random_boxes(range_, count, rng)
    forms = QuadraticFunction(expression)(boxes) if quadratic else AffineFunction(expression)(boxes, np.arange(2))
    for k, box in enumerate(boxes):
        point = np.clip(rng.uniform(box[:, 0], box[:, 1]), box[:, 0], box[:, 1])
        if rng.random() < 0.2:
            point = box[np.arange(2), rng.integers(0, 2, 2)]
        with ctx.workprec(PRECISION):
            value = exact(*(arb(v) for v in point.tolist()))
            if not value.is_finite():
                continue
            low, high = exact_ends(value)
        in_range = forms.lower[k, 0] <= high and low <= forms.upper[k, 0]
        if not (in_range and is_in_form(forms, k, box, point, low, high)):
            yield f"{name} at {point.tolist()} of {box.tolist()}: {value}"


def is_in_form(
    forms: AffineForms | QuadraticForms, k: int, box: Array, point: Array, low: Fraction, high: Fraction
) -> bool:
    """Return whether a value between two ends is enclosed by a form at a point of its box, in exact arithmetic."""
    if not np.isfinite(forms.error[k, 0]):
        return True
    half_width = quadratic_reach if isinstance(forms, QuadraticForms) else affine_reach
    e = []
    for (lower, upper), at in zip(box.tolist(), point.tolist(), strict=True):
        centre = 0.5 * lower + 0.5 * upper
        half = half_width(lower, upper, centre)
        e.append((Fraction(at) - Fraction(centre)) / Fraction(half) if half else Fraction(0))
    value = Fraction(float(forms.middle[k, 0]))
    value += sum(Fraction(slope) * at for slope, at in zip(forms.slopes[k, 0].tolist(), e, strict=True))
    if isinstance(forms, QuadraticForms):
        pairs = [e[i] * e[j] for j in range(len(e)) for i in range(j + 1)]
        value += sum(Fraction(bend) * pair for bend, pair in zip(forms.bends[k, 0].tolist(), pairs, strict=True))
    error = Fraction(float(forms.error[k, 0]))
    return value - error <= high and low <= value + error


def affine_reach(low: float, high: float, centre: float) -> float:
    """Return half the width of a box as ``reach`` in native/affine.hpp rounds it up."""
    if low == high:
        return 0.0
    far = max(high - centre, centre - low)
    for _ in range(2):
        far += 2.0**-52 * abs(far) + 2.0**-1074
    return far


def quadratic_reach(low: float, high: float, centre: float) -> float:
    """Return the same for ``reach`` in native/quadratic.hpp."""
    far = max(high - centre, centre - low)
    return far + (2.0**-51 * abs(far) + 1e-290)


SEED = 7
EACH = 50  # points of each operation
POINTS = 200
# Of values as computed in double precision, relative: they err themselves.
ROUNDING = 1e-9


@pytest.mark.parametrize(
    "quadratic", [pytest.param(False, id="affine"), pytest.param(True, id="quadratic", marks=pytest.mark.slow)]
)
def test_every_operation_encloses_exact_values_at_random_points(quadratic: bool) -> None:
    rng = np.random.default_rng(SEED)
    for name in QUADRATIC if quadratic else AFFINE:
        assert not list(find_lost_values(name, EACH, rng, quadratic=quadratic))


@pytest.mark.parametrize("name", [pytest.param("walk12", marks=pytest.mark.slow), "nao-dsp"])
def test_problems_hold_every_value_at_sampled_points_of_random_boxes(name: str) -> None:
    problem = nlp_gait.load(name, intervals=2)
    model, rng = build_exact_model(problem), np.random.default_rng(SEED)
    function, n = AffineFunction(model.kernel), len(problem.names)
    symbols = np.r_[np.arange(n), np.full(len(problem.p), -1)]
    finite = 0
    for width in (0.5, 0.1, 0.01, 1e-3, 1e-6):
        middle, half = rng.uniform(problem.lower, problem.upper), width * problem.scale / 2
        box = np.stack([np.maximum(problem.lower, middle - half), np.minimum(problem.upper, middle + half)], -1)
        forms = function(np.concatenate([box, np.stack([problem.p] * 2, -1)])[None], symbols)
        X = rng.uniform(box[:, 0], box[:, 1], (POINTS, n))
        values = np.vstack([part.full() for part in model.kernel.map(POINTS)(X.T, problem.p)]).T
        slack = ROUNDING * (1 + np.abs(values))
        assert np.all((forms.lower <= values + slack) & (values - slack <= forms.upper))
        share = (X - box.mean(axis=-1)) / (np.ptp(box, axis=-1) / 2)
        known = np.isfinite(forms.error[0])
        finite += int(known.sum())
        off = np.abs(forms.middle + share @ forms.slopes[0].T - values)
        assert np.all((off <= forms.error + slack)[:, known])
    assert finite > function.outputs  # most boxes have forms


def test_slopes_cancel_what_intervals_count_twice() -> None:
    x = SX.sym("x")
    function = AffineFunction(ca.Function("f", [x], [ca.vertcat(x - x, x * x - 2 * x * x + x**2)]))
    forms = function(np.array([[[1.0, 2.0]]]), np.array([0]))
    assert forms.slopes.shape == (1, 2, 1)
    np.testing.assert_allclose(forms.lower[0, 0], 0.0, atol=1e-14)
    assert forms.upper[0, 1] - forms.lower[0, 1] < 1.1  # intervals give a width of 9


def test_a_half_open_input_does_not_reach_its_upper_end() -> None:
    x = SX.sym("x")
    jump = ca.Function("f", [x], [SX(0.5 <= x)])  # noqa: SIM300  as splines ask
    box, symbols = np.array([[[0.0, 0.5]], [[0.5, 1.0]]]), np.array([0])
    forms = AffineFunction(jump, half_open=[0])(box, symbols)
    np.testing.assert_array_equal(forms.lower[:, 0], [0.0, 1.0])
    np.testing.assert_array_equal(forms.upper[:, 0], [0.0, 1.0])
    assert AffineFunction(jump)(box, symbols).upper[0, 0] == 1.0


def test_what_is_undefined_on_part_of_a_box_is_the_whole_line() -> None:
    x = SX.sym("x")
    function = AffineFunction(ca.Function("f", [x], [ca.vertcat(1 / x, ca.sqrt(x), ca.log(x), x / (x + x**3))]))
    forms = function(np.array([[[-1.0, 1.0]]]), np.array([0]))
    assert np.all(np.isinf(forms.lower)) and np.all(np.isinf(forms.upper)) and np.all(np.isinf(forms.error))


def test_boxes_of_the_wrong_shape_and_unknown_operations_are_refused() -> None:
    x = SX.sym("x")
    function = AffineFunction(ca.Function("f", [x], [x + 1]))
    with pytest.raises(InputError, match="boxes and symbols of 1 inputs"):
        function(np.zeros((1, 2, 2)), np.array([0]))
    with pytest.raises(InputError, match="cannot be enclosed"):
        AffineFunction(ca.Function("f", [x], [ca.erf(x)]))


def at(forms: QuadraticForms, e: np.ndarray) -> np.ndarray:
    """Return (K, M) values of the forms of one box at symbols (K, n), without their errors."""
    pairs = np.stack([e[:, i] * e[:, j] for j in range(e.shape[1]) for i in range(j + 1)])
    return np.asarray(forms.middle[0] + e @ forms.slopes[0].T + pairs.T @ forms.bends[0].T)


def evaluate(function: ca.Function, Z: np.ndarray) -> np.ndarray:
    """Return (K, M) values at points."""
    return np.array(function.map(len(Z))(Z.T).full().T)


def power_form(name: str) -> PowerForm:
    problem = nlp_gait.load(name, intervals=2)
    assert isinstance(problem.least_power, LeastPower)
    return make_power_form(problem, problem.least_power)


@pytest.mark.parametrize("name", ["nao-dsp", "nao-ssp"])
def test_gaits_are_enclosed_at_sampled_points_of_boxes_around_the_best(name: str) -> None:
    form, rng = power_form(name), np.random.default_rng(SEED)
    function, z, (low, high) = QuadraticFunction(form.function), form.to_z(best_x(name)), form.box.T
    _, pose_lower, pose_upper = form.rows.limits[form.pose_rows].T
    for width in (0.3, 0.03, 1e-4):
        half = width * (high - low) / 2
        box = np.stack([np.maximum(low, z - half), np.minimum(high, z + half)], -1)
        forms = function(box[None])
        Z = rng.uniform(box[:, 0], box[:, 1], (POINTS, len(z)))
        values, poses = (evaluate(f, Z) for f in (form.function, form.poses))
        reached = np.all((pose_lower <= poses) & (poses <= pose_upper), axis=1)
        e = (Z - box.mean(axis=-1)) / (np.ptp(box, axis=-1) / 2)
        slack = ROUNDING * (1 + np.abs(values))
        inside = (forms.lower <= values + slack) & (values - slack <= forms.upper)
        off = np.abs(at(forms, e) - values) <= forms.error + slack
        assert reached.sum() > POINTS / 10
        assert inside[reached].all() and off[reached].all()
        assert width > 0.1 or np.isfinite(forms.error).all()


def test_mixed_products_are_kept_and_cancel() -> None:
    x = SX.sym("x", 2)
    function = QuadraticFunction(ca.Function("f", [x], [(x[0] + x[1]) ** 2 - (x[0] - x[1]) ** 2 - 4 * x[0] * x[1]]))
    forms = function(np.array([[[1.0, 2.0], [-3.0, 5.0]]]))
    assert max(abs(forms.lower[0, 0]), abs(forms.upper[0, 0])) < 1e-12


def test_an_operation_without_a_form_is_refused() -> None:
    x = SX.sym("x")
    with pytest.raises(InputError, match="has no quadratic form"):
        QuadraticFunction(ca.Function("f", [x], [ca.sin(x)]))
    with pytest.raises(InputError, match="boxes of 1 inputs expected"):
        QuadraticFunction(ca.Function("f", [x], [x * x]))(np.zeros((3, 2, 2)))


def least_power(rng: np.random.Generator) -> tuple[ca.Function, PowerRows]:
    """A made-up problem of four terms in three variables and a duration, with powers of known, vague and unknown signs."""
    z = SX.sym("z", 4)
    a = 1.0 + z[:3].T @ rng.uniform(-0.3, 0.3, 3)
    nothing = (a * a * a) * (a * a * a) - (a * a) * (a * a) * (a * a)  # but its form has an error

    def quantity() -> SX:
        bent = z[:3].T @ rng.uniform(-1.0, 1.0, (3, 3)) @ z[:3]
        plain = rng.uniform(-3, 3) + z[:3].T @ rng.uniform(-1, 1, 3)
        return plain + 10.0 ** rng.uniform(-1, 0.5) * bent + 10.0 ** rng.uniform(-1, 1) * nothing

    torques, rates = ([quantity() for _ in range(4)] for _ in range(2))
    powers = [torque * rate for torque, rate in zip(torques, rates, strict=True)]
    heats = [torque**2 for torque in torques[:2]]
    limited = quantity()
    outputs = ca.vertcat(*powers, *torques, *rates, *heats, limited)
    numbers, weights, losses = np.arange(4), 10.0 ** rng.uniform(-1.0, 0.0, 4), 10.0 ** rng.uniform(-1.0, 1.0, 2)
    rows = PowerRows(
        limits=np.array([[14, -2.0, 2.0]]),
        terms=np.column_stack([numbers, 4 + numbers, 8 + numbers, weights]),
        heats=np.column_stack([[12, 13], losses]),
        duration=3,
        ranges=np.ones(4),
    )
    return ca.Function("least_power", [z], [outputs]), rows


def test_no_feasible_point_of_a_box_costs_less_than_its_bound_or_is_cut_off() -> None:
    rng, tight = np.random.default_rng(SEED), 0
    for _ in range(80):
        function, rows = least_power(rng)
        centre, half = rng.uniform(-0.5, 0.5, 4) + [0, 0, 0, 2.0], 10.0 ** rng.uniform(-2.0, -0.2, 4)
        box = np.stack([centre - half, centre + half], axis=-1)
        corners = rng.choice([-1.0, 1.0], (100, 4))
        Z = centre + half * np.concatenate([corners, rng.uniform(-1.0, 1.0, (400, 4))])
        values = evaluate(function, Z)
        cost = np.abs(values[:, :4]) @ rows.terms[:, 3] / Z[:, 3] + values[:, 12:14] @ rows.heats[:, 1]
        feasible = np.abs(values[:, 14]) <= 2.0
        if not feasible.any():
            continue
        least, enclosed = cost[feasible].min(), QuadraticFunction(function)
        for target in (100.0, np.quantile(cost[feasible], 0.3)):
            found = enclosed.prune(box[None], target, rows)
            kept = Z[feasible & (cost < target * (1.0 - ROUNDING))]
            if len(kept):
                assert found.lowest.item() <= least * (1.0 + ROUNDING)
                assert ((found.boxes[0, :, 0] <= kept) & (kept <= found.boxes[0, :, 1])).all()
        tight += not len(found.origin) or found.lowest.item() > 0.7 * least
    assert tight > 6  # bounds that are far off would hide an error
