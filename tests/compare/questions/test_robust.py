"""Robust optima, and boxes of robots."""

import pytest

from compare.questions.question import Work
from compare.questions.robust_gait import make_boxes, solve_robust
from nlp_gait import load
from nlp_gait.backends.exact import build_exact_model


def test_a_gait_for_every_sole() -> None:
    problem = load("nao-ssp")
    box = make_boxes(problem, 0.05, 0.002)["soles"]
    gait = solve_robust(problem, "soles", box, starts=1, seed=0, samples=20, work=Work())
    assert gait.settled
    # The mean lateral margin counts to the sole's edge: a sole that may be 2 mm off takes these 2 mm.
    assert gait.nominal_worst.row == "dbm_y_mean"
    assert gait.nominal_worst.violation == pytest.approx(0.002, abs=1e-6)
    assert gait.worst.violation == gait.random_worst.violation == 0.0
    # It costs what its price says, and a little more where the price grows.
    price = 23.7325
    assert gait.power_W - gait.nominal_W == pytest.approx(0.002 * price, rel=0.01)
    # Solved independently: the nominal problem with a limit that is 2 mm stricter has the same optimum.
    stricter = problem.with_values(dbm_y_mean_limit_m=0.022)
    values = build_exact_model(stricter).at(stricter.check_x(gait.x), stricter.p)
    assert values.violation < 1e-6
    assert values.cost == pytest.approx(gait.power_W)


def test_boxes_grow_and_name_every_link() -> None:
    soles, whole, links = make_boxes(load("nao-ssp"), 0.05, 0.002).values()
    assert set(soles) < set(whole) and set(soles) < set(links)
    assert links["LThigh.mass"] == 0.05 and whole["mass"] == 0.05 and soles["sole_y_m"] == 0.002
