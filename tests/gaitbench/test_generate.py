"""Instances by seed: the same numbers everywhere, the same problem in other variables, and optima anywhere in the box."""

import pickle

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import load
from nlp_gait.gaitbench.generated import draw_box, draw_definition, load_families
from nlp_gait.gaitbench.instance import evaluate_interpreted
from nlp_gait.gaitbench.transform import AffineMap, change_variables

PUBLISHED = 1e-12
ID = "gb2:walk12-long:7"
PUBLISHED_OPTIONS = {
    "step_length_m": 0.0795558,
    "robot": "nao-v4@mass=1.17322,torso.mass=0.817078,thigh_m=0.00686869,tibia_m=-0.00675539,sole_front_m=-0.009586,"
    "sole_left_m=0.00675755,sole_right_m=-0.000417913",
}
PUBLISHED_MIDDLE = [-1.0994128246766686, -185.46683670385372]
PUBLISHED_VALUES = {
    "torque_change_limit_Nm": 1.13815,
    "dbm_x_mean_limit_m": 0.0491818,
    "dbm_y_mean_limit_m": 0.0211334,
    "heat_loss_W_per_Nm2": 0.0560716,
}


@pytest.fixture(scope="module")
def walk() -> gaitbench.Instance:
    return gaitbench.generate("walk12-long", 7)


def test_a_seed_gives_the_published_robot_steps_and_limits() -> None:
    drawn = draw_definition("gb2:ssp:3")
    assert drawn.options == PUBLISHED_OPTIONS
    assert drawn.values == PUBLISHED_VALUES
    assert draw_definition("gb2:dsp-timed:3").held == {"double_support_time_s": 0.861532}


def test_published_values_never_change(walk: gaitbench.Instance) -> None:
    """In the middle of the box; held to 1e-12, as those of GaitBench 1."""
    cost, G = evaluate_interpreted(walk, np.full(4, 0.5))
    assert [cost, G @ (1.0 + np.arange(len(G)) % 7)] == pytest.approx(PUBLISHED_MIDDLE, rel=PUBLISHED)


@pytest.mark.parametrize("id", ["gb2:ssp", "gb2:ssp:03", "gb2::3"])
def test_malformed_ids_are_refused(id: str) -> None:
    with pytest.raises(InputError, match="gb2:FAMILY:SEED"):
        gaitbench.load(id)


def test_other_variables_keep_objective_rows_and_feasible_set() -> None:
    """Against the problem itself at the mapped points; the old bounds are rows, in units of the ranges."""
    base = load("walk12", quadrature="simpson").with_values(**{"step_length_m.lower": 0.06})
    rng = np.random.default_rng(0)
    affine = AffineMap(
        matrix=np.diag(base.upper - base.lower) @ (np.eye(4) + 0.2 * rng.normal(size=(4, 4))),
        offset=base.lower + 0.01,
        lower=np.full(4, -0.2),
        upper=np.ones(4),
    )
    changed = change_variables(base, affine)
    assert changed.names == ("z1", "z2", "z3", "z4") and changed.value("lambda") == base.value("lambda")
    z = rng.uniform(affine.lower, affine.upper, (20, 4))
    x = affine.forward(z)
    np.testing.assert_allclose(affine.backward(x), z, atol=1e-12)
    old, new = build_exact_model(base), build_exact_model(changed)
    for xi, zi in zip(x, z, strict=True):
        inside, outside = old.at(xi, base.p), new.at(zi, changed.p)
        assert outside.cost == pytest.approx(inside.cost, rel=1e-12)
        assert outside.violation == pytest.approx(inside.violation, rel=1e-9, abs=1e-12)
    np.testing.assert_allclose(changed.signals(z[0]).arrays["q"], base.signals(x[0]).arrays["q"], atol=1e-12)
    assert changed.dense(2) is not None


def test_a_generated_instance_is_an_instance(walk: gaitbench.Instance) -> None:
    assert (walk.lower == 0.0).all() and (walk.upper == 1.0).all() and walk.id == ID
    f, violation = walk(walk.best_x[None])
    assert violation[0] == 0.0 and f[0] == pytest.approx(walk.best_known, rel=PUBLISHED)
    assert walk.evidence.agreeing >= 9 and "10 starts of IPOPT" in str(walk.evidence)
    near = walk.best_x + np.random.default_rng(0).uniform(-1e-3, 1e-3, (2000, 4))
    f, violation = walk(near)
    assert f[violation == 0.0].min(initial=np.inf) >= walk.best_known - 1e-6
    again = pickle.loads(pickle.dumps(walk))
    assert again.best_known == walk.best_known


def test_best_points_are_neither_at_the_bounds_nor_in_the_middle() -> None:
    """27 % of GaitBench 1's variables are at a bound, and up to 43 % in the middle."""
    z = np.concatenate([gaitbench.generate("walk12-stable", seed).best_x for seed in range(5)])
    assert np.mean((z < 1e-3) | (z > 1 - 1e-3)) <= 0.02
    assert np.histogram(z, 4, (0.0, 1.0))[0].min() >= 1


@pytest.mark.parametrize("family", ["ssp", "humanoid-ssp"])
def test_boxes_place_typical_points_uniformly(family: str) -> None:
    """Variables whose best value hardly depends on the robot are anywhere in the box with equal probability."""
    from scipy.stats import kstest  # costs a second to import

    entry = load_families()[family]
    problem = load(entry.problem)
    ends = np.array([entry.typical[name] for name in problem.names])
    centre = problem.lower + problem.scale * ends.mean(axis=1)
    boxes = [draw_box(problem, f"gb2:{family}:{seed}") for seed in range(400)]
    z = np.array([box.backward(centre) for box in boxes])
    narrow = np.ptp(ends, axis=1) < 1e-3
    assert narrow.sum() >= 2 and kstest(z[:, narrow].ravel(), "uniform").statistic < 0.06
    corners = problem.lower + problem.scale * ends[:, 0]
    assert all((0.0 < (p := box.backward(corners))).all() and (p < 1.0).all() for box in boxes)
    assert np.abs(np.corrcoef(z.T) - np.eye(len(centre))).max() < 0.25
