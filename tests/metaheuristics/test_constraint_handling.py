"""Constraint rules are total preorders, and each prefers what its definition says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metaheuristics import ConstraintHandling, Deb, StaticPenalty
from metaheuristics.interface import Array
from metaheuristics.minimize import mark_failed

HANDLINGS: list[ConstraintHandling] = [Deb(), StaticPenalty(weight=2.0)]
every_rule = pytest.mark.parametrize("handling", HANDLINGS, ids=lambda handling: handling.name)

# Few distinct values, so that ties of all kinds occur; and everything that marks a failure.
value = st.sampled_from([-2.0, -1.0, 0.0, 1.0, 1.5, np.nan, np.inf, -np.inf]) | st.floats(-1e6, 1e6)
violation = st.sampled_from([0.0, 0.0, 0.5, 1.0, 2.0, np.nan, np.inf]) | st.floats(0.0, 1e6)
populations = st.lists(st.tuples(value, violation), min_size=1, max_size=12)
repeatable = settings(derandomize=True, deadline=None)


def columns(population: list[tuple[float, float]]) -> tuple[Array, Array]:
    """Split into f and violation."""
    f, v = np.array(population, dtype=float).T
    return f, v


@every_rule
@repeatable
@given(population=populations)
def test_order_agrees_with_pairs(handling: ConstraintHandling, population: list[tuple[float, float]]) -> None:
    f, v, failed = mark_failed(*columns(population))
    rule = handling.rule()
    better = rule.better(f[:, None], v[:, None], f, v)
    order = rule.order(f, v)
    assert sorted(order) == list(range(len(f))) and rule.best(f, v) == order[0]
    assert not (better & better.T).any()  # asymmetric
    # A strict weak order, listed best first: nothing later is better than anything earlier ...
    in_order = better[np.ix_(order, order)]
    assert not np.tril(in_order).any()
    # ... and "neither is better" is transitive: the classes of equals are blocks along the order.
    equal = ~(in_order | in_order.T)
    classes = np.cumsum(~np.concatenate([[True], np.diagonal(equal, 1)]))
    np.testing.assert_array_equal(equal, classes[:, None] == classes)
    # Failed evaluations come last, all equal.
    assert not failed[order[: len(f) - failed.sum()]].any()
    assert better[np.ix_(~failed, failed)].all() and not better[failed].any()


@repeatable
@given(population=populations)
def test_deb(population: list[tuple[float, float]]) -> None:
    f, v, failed = mark_failed(*columns(population))
    better = Deb().rule().better(f[:, None], v[:, None], f, v)
    for i in np.flatnonzero(~failed):
        for j in np.flatnonzero(~failed):
            if v[i] == 0.0 and v[j] == 0.0:
                assert better[i, j] == (f[i] < f[j])
            elif v[i] != v[j]:
                assert better[i, j] == (v[i] < v[j])


def test_marking_copies_and_marks_both() -> None:
    f, v = np.array([1.0, np.nan, 2.0, -np.inf]), np.array([0.0, 0.0, np.inf, 1.0])
    marked_f, marked_v, failed = mark_failed(f, v)
    assert failed.tolist() == [False, True, True, True]
    assert marked_f.tolist() == [1.0, np.inf, np.inf, np.inf] and marked_v.tolist() == [0.0, np.inf, np.inf, np.inf]
    assert np.isnan(f[1]) and v[0] == 0.0
