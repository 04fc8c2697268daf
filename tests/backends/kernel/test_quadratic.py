"""Forms of degree two hold every value of gaits at sampled points; of single operations see ``test_affine``."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from compare.questions.certainty import power_form as power_form_module
from compare.questions.certainty.power_form import power_form, to_z
from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.kernel.quadratic import QuadraticForms, QuadraticFunction
from nlp_gait.errors import InputError
from nlp_gait.gaitbench.known import known

SEED = 7
POINTS = 200
# Of values as computed in double precision, relative: they err themselves.
ROUNDING = 1e-9


def at(forms: QuadraticForms, e: np.ndarray) -> np.ndarray:
    """(K, M) what the forms of one box give at symbols (K, n), without their errors."""
    pairs = np.stack([e[:, i] * e[:, j] for j in range(e.shape[1]) for i in range(j + 1)])
    return np.asarray(forms.middle[0] + e @ forms.slopes[0].T + pairs.T @ forms.bends[0].T)


@pytest.mark.parametrize(("name", "instance"), [("nao-dsp", "dsp-v5"), ("nao-ssp", "ssp-v5")])
def test_gaits_are_held_at_sampled_points_of_boxes_around_the_best(
    name: str, instance: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[ca.Function] = []

    def reading(function: ca.Function) -> QuadraticFunction:
        read.append(function)
        return QuadraticFunction(function)

    monkeypatch.setattr(power_form_module, "QuadraticFunction", reading)
    problem = nlp_gait.load(name, intervals=2)
    form, rng = power_form(problem), np.random.default_rng(SEED)
    poses, everything = sorted(read, key=lambda function: function.numel_out(0))
    z = to_z(np.array(known()[instance].best_x))
    low, high = form.root.T
    for width in (0.3, 0.03, 1e-4):
        half = width * (high - low) / 2
        box = np.stack([np.maximum(low, z - half), np.minimum(high, z + half)], -1)
        forms = form.function(box[None])
        Z = rng.uniform(box[:, 0], box[:, 1], (POINTS, len(z)))
        values, posed = (evaluated(function, Z) for function in (everything, poses))
        reached = np.all((form.early_lower <= posed) & (posed <= form.early_upper), axis=1)
        e = (Z - box.mean(axis=-1)) / (np.ptp(box, axis=-1) / 2)
        slack = ROUNDING * (1 + np.abs(values))
        inside = (forms.lower <= values + slack) & (values - slack <= forms.upper)
        off = np.abs(at(forms, e) - values) <= forms.error + slack
        assert reached.sum() > POINTS / 10
        assert inside[reached].all() and off[reached].all()
        assert width > 0.1 or np.isfinite(forms.error).all()


def evaluated(function: ca.Function, Z: np.ndarray) -> np.ndarray:
    """(K, M) values at points."""
    return np.array(function.map(len(Z))(Z.T).full().T)


def test_mixed_products_are_kept_and_cancel() -> None:
    x = SX.sym("x", 2)
    function = QuadraticFunction(ca.Function("f", [x], [(x[0] + x[1]) ** 2 - (x[0] - x[1]) ** 2 - 4 * x[0] * x[1]]))
    forms = function(np.array([[[1.0, 2.0], [-3.0, 5.0]]]))
    assert max(abs(forms.lower[0, 0]), abs(forms.upper[0, 0])) < 1e-12


def test_what_is_undefined_on_part_of_a_box_has_no_form() -> None:
    x = SX.sym("x")
    forms = QuadraticFunction(ca.Function("f", [x], [ca.vertcat(1 / x, ca.sqrt(x))]))(np.array([[[-1.0, 1.0]]]))
    assert np.isinf(forms.error).all() and np.isinf(forms.lower).all() and np.isinf(forms.upper).all()


def test_an_operation_without_a_form_is_refused() -> None:
    x = SX.sym("x")
    with pytest.raises(InputError, match="has no quadratic form"):
        QuadraticFunction(ca.Function("f", [x], [ca.sin(x)]))
    with pytest.raises(InputError, match="boxes of 1 inputs expected"):
        QuadraticFunction(ca.Function("f", [x], [x * x]))(np.zeros((3, 2, 2)))


def test_boxes_that_hold_the_best_gait_keep_it_and_have_bounds_that_end_in_its_cost() -> None:
    problem, x = nlp_gait.load("nao-ssp"), np.array(known()["ssp-v5"].best_x)
    cost, form, z = exact_model(problem).at(x, problem.p).cost, power_form(problem), to_z(x)
    half = np.diff(form.root)[:, 0] / 2 * 2.0 ** -np.arange(2.0, 12.0)[:, None]
    boxes = np.stack([np.maximum(form.root[:, 0], z - half), np.minimum(form.root[:, 1], z + half)], -1)
    found = form.assess(boxes, cost * (1 + 1e-6))
    assert found.left.all()
    assert np.all(np.diff(found.lowest[2:]) > 0.0) and cost * (1 - 1e-5) < found.lowest[-1] <= cost
    assert np.all((found.boxes[..., 0] <= z) & (z <= found.boxes[..., 1]))
