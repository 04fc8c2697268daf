"""Forms of degree two enclose gaits at sampled points, and bounds from them keep feasible points (see also ``test_affine``)."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.gaits.nao.problems import LeastPower
from nlp_gait.proofs.nao.phases import make_power_form
from nlp_gait.proofs.power_form import PowerForm, PowerRows
from nlp_gait.proofs.quadratic import QuadraticForms, QuadraticFunction
from tests.proofs.soundness import best_x

SEED = 7
POINTS = 200
# Relative rounding error of values in double precision.
ROUNDING = 1e-9


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
