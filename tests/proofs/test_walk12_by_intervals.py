"""The 12-joint walk's second proof, from the printed formulas, agrees with the judge, proves a bound, and refuses a false one."""

from __future__ import annotations

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.gaitbench.facts import load_facts
from tests.proofs.walk12_by_intervals import ROOT, Ends, evaluate, evaluate_knees, make_step, prove

SEED = 6
LAMBDA = 0.1
BEST = 0.98056  # f at this lambda, rounded up


@pytest.mark.parametrize("rule", ["simpson", "gauss"])
def test_the_printed_formulas_enclose_the_judge(rule: str) -> None:
    problem, step = nlp_gait.load("walk12", quadrature=rule), make_step(rule)
    low, high = np.array(ROOT).T
    X = np.random.default_rng(SEED).uniform(low, high, (8, 4))
    X[0] = load_facts()["walk12-w015"].best_x
    costs, knees = evaluate(Ends(X, X), step, 0.15, gradients=False), evaluate_knees(Ends(X, X), step, gradients=False)
    model, compared = build_exact_model(problem), 0
    for x, lo, hi, reach in zip(X, costs.value.lo, costs.value.hi, knees.value.lo, strict=True):
        at = model.at(x, problem.p)
        assert np.allclose(np.sort(reach), np.sort(at.g[:22]), rtol=0.0, atol=1e-13)
        if at.violation == 0.0:
            compared += 1
            assert lo - 1e-13 <= at.cost <= hi + 1e-13 and hi - lo < 1e-12
    assert compared >= 5


@pytest.mark.slow
def test_a_true_bound_is_proven_and_a_false_one_is_not() -> None:
    step = make_step("simpson")
    assert prove(step, LAMBDA, 1.4 * BEST).left == 0
    around = [(0.12, 0.13), (0.11, 0.117), (0.001, 0.004), (0.009, 0.012)]
    assert prove(step, LAMBDA, 0.999 * BEST, root=around, at_most=200).left > 0
