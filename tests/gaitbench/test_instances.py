"""Every instance is what it was when it was published, and one object serves threads, processes and derivatives."""

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.facts import DEFINITIONS, load_facts

# A published value may change by rounding alone: other compilers, other widths of SIMD.
PUBLISHED = 1e-12
# Central differences with steps of 1e-6 of each range.
STEP, DIFFERENCES = 1e-6, 1e-5
QUICK = ("walk12-w015", "ssp-v5", "ssp-v5-time10")
# The others' exact functions are interpreted, which takes less time than to compile them; a compiled kernel is itself checked
# against the interpreted one when it is built.


def points(instance: gaitbench.Instance, count: int = 6) -> Array:
    return np.random.default_rng(3).uniform(instance.lower, instance.upper, (count, len(instance.names)))


@pytest.fixture
def published(id: str, request: pytest.FixtureRequest) -> gaitbench.Instance:
    if id not in QUICK:
        request.getfixturevalue("without_compiler")
    return gaitbench.load(id)


@pytest.mark.parametrize(
    "id", [pytest.param(id, marks=[] if id in QUICK else pytest.mark.slow) for id in gaitbench.list_instances()]
)
def test_probe_values_never_change(id: str, published: gaitbench.Instance) -> None:
    """Held to 1e-12: an instance that has to change gets a new id."""
    instance, probes = published, load_facts()[id].probes
    assert len(probes) >= 4
    X = np.array([probe.x for probe in probes])
    f, violation = instance(X)
    G = instance.rows(X)
    weighted = G @ (1.0 + np.arange(G.shape[1]) % 7)
    for found, name in ((f, "objective"), (violation, "violation"), (weighted, "rows")):
        expected = np.array([getattr(probe, name) for probe in probes])
        np.testing.assert_allclose(found, expected, rtol=PUBLISHED, atol=PUBLISHED, err_msg=f"{id}: {name}")


@pytest.mark.parametrize("id", gaitbench.list_instances())
def test_the_best_known_point_is_feasible_and_has_its_value(published: gaitbench.Instance) -> None:
    """Violation exactly zero; no random point nearby is feasible and better by more than a millionth."""
    instance = published
    f, violation = instance(instance.best_x[None])
    assert violation[0] == 0.0
    assert f[0] == pytest.approx(instance.best_known, rel=PUBLISHED, abs=PUBLISHED)
    width = 1e-4 * (instance.upper - instance.lower)
    near = instance.best_x + np.random.default_rng(0).uniform(
        -width, width, (2000 if instance.id in QUICK else 128, len(width))
    )
    f, violation = instance(np.clip(near, instance.lower, instance.upper))
    better = f[violation == 0.0] - instance.best_known
    assert not better.size or better.min() >= -1e-6 * max(1.0, abs(instance.best_known))


def test_there_are_forty_and_more_and_the_small_ones_are_among_them() -> None:
    assert len(gaitbench.list_instances()) >= 40
    assert len(gaitbench.list_instances("small")) == 10
    assert set(gaitbench.list_instances("small")) < set(gaitbench.list_instances("full")) == set(load_facts())
    assert len({definition.id for definition in DEFINITIONS}) == len(DEFINITIONS)
    ends = [(len(load_facts()[id].best_x), load_facts()[id].best_known) for id in gaitbench.list_instances()]
    assert len(set(ends)) == len(ends)  # no two are the same problem
    counts = [len(load_facts()[id].best_x) for id in gaitbench.list_instances()]
    assert min(counts) <= 9 and max(counts) == 90
    with pytest.raises(UnknownNameError, match="subset"):
        gaitbench.list_instances("huge")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="did you mean 'ssp-v5'"):
        gaitbench.load("ssp-v55")


@pytest.mark.parametrize("id", QUICK)
def test_violation_is_the_sum_of_rows_and_bounds(id: str) -> None:
    """Within the bounds the rows alone, and zero if and only if none is positive; outside, the bounds count too."""
    instance = gaitbench.load(id)
    X = points(instance, 500)
    G = instance.rows(X)
    _, violation = instance(X)
    np.testing.assert_allclose(np.maximum(G, 0.0).sum(axis=1), violation, rtol=1e-12, atol=1e-14)
    assert ((violation == 0.0) == (G.max(axis=1) <= 0.0)).all()
    assert G.shape[1] == len(instance.row_names) == len(set(instance.row_names))
    outside = instance.best_x.copy()
    outside[0] = instance.upper[0] + (instance.upper[0] - instance.lower[0])
    beyond_bounds = instance(outside[None])[1][0] - np.maximum(instance.rows(outside[None]), 0.0).sum()
    assert beyond_bounds == pytest.approx(1.0)
    outside[0] = np.nan
    assert np.isinf(instance(outside[None])).all()


@pytest.mark.parametrize("id", QUICK)
def test_derivatives_are_those_of_central_differences(id: str) -> None:
    instance = gaitbench.load(id)
    x = instance.lower + 0.37 * (instance.upper - instance.lower)
    step = STEP * (instance.upper - instance.lower)
    above, below = x + np.diag(step), x - np.diag(step)
    slope = (instance(above)[0] - instance(below)[0]) / (2 * step)
    np.testing.assert_allclose(instance.gradient(x), slope, rtol=DIFFERENCES, atol=DIFFERENCES * np.abs(slope).max())
    slopes = ((instance.rows(above) - instance.rows(below)) / (2 * step[:, None])).T
    found = instance.jacobian(x)
    assert found.shape == (len(instance.row_names), len(instance.names))
    kinks = np.abs(found - slopes) > DIFFERENCES * np.abs(slopes).max()
    assert kinks.mean() < 1e-3
    with pytest.raises(InputError, match="must have"):
        instance.gradient(x[:-1])


def test_a_constant_is_not_a_variable() -> None:
    """A phase of one second: the time is gone from x, and the same power comes out as with it."""
    instance = gaitbench.load("ssp-v5-time10")
    free = gaitbench.load("ssp-v5")
    assert "single_support_time_s" not in instance.names and len(instance.names) == len(free.names) - 1
    X = points(instance)
    position = free.names.index("single_support_time_s")
    np.testing.assert_allclose(instance(X)[0], free(np.insert(X, position, 1.0, axis=1))[0], rtol=1e-13)
    whole = np.insert(X, position, 1.0, axis=1)[0]
    for constant, found in ((instance, X[0]), (free, whole)):
        assert constant.gait_problem.name == "gaitbench"
        np.testing.assert_allclose(
            constant.gait_problem.signals(found).arrays["tau"], free.gait_problem.signals(whole).arrays["tau"]
        )
    dense = instance.gait_problem.dense(2)
    assert dense is not None and dense.names == instance.names


@pytest.mark.usefixtures("without_compiler")
def test_the_one_equation_of_splines_is_a_band() -> None:
    """The foot passes the middle of its path within a tenth of a millimetre to either side."""
    instance = gaitbench.load("ssp-v5-quintic")
    rows = [k for k, name in enumerate(instance.row_names) if name.startswith("foot_middle")]
    G = instance.rows(points(instance))[:, rows]
    assert len(rows) == 2
    np.testing.assert_allclose(G.sum(axis=1), -2 * 1e-2, rtol=1e-9)  # of the scale, a centimetre


def test_evidence_says_what_it_rests_on() -> None:
    for id in gaitbench.list_instances():
        text, evidence = str(gaitbench.load(id).evidence), gaitbench.load(id).evidence
        assert f"{evidence.agreeing} of {evidence.starts} starts" in text
        assert evidence.agreeing > 1 or "best known" in text or evidence.proven_gap is not None
        assert evidence.cma_gap is None or evidence.cma_gap > -1e-6  # nothing better was found and left out
