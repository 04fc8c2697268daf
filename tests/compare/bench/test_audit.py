"""The audit finds planted biases and accuses no unbiased search."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import metaheuristics
from compare.bench.audit import (
    CENTRE,
    CHANGES,
    Audit,
    Effect,
    MovedProblem,
    Noise,
    audit_search,
    compare_stratified,
    make_change,
)
from metaheuristics.interface import Algorithm, Start
from metaheuristics.registry import make_algorithm
from nlp_gait import gaitbench

INSTANCE = "gb2:walk12-long:0"


@dataclass(frozen=True)
class Planted:
    """A search of which a share of the proposed coordinates is put into the middle or onto a bound."""

    base: Algorithm
    bias: str
    share: float = 0.08

    @property
    def name(self) -> str:
        return f"{self.base.name} {self.bias}"

    @property
    def population(self) -> int:
        return self.base.population

    def start(self, start: Start) -> Any:
        inner, ask = self.base.start(start), [0]
        proposed = inner.ask

        def propose_biased() -> np.ndarray:
            ask[0] += 1
            X = proposed()
            chosen = start.rng.random(X.shape) < (self.share if ask[0] > 1 else 0.0)
            side = start.rng.random(X.shape) < 0.5
            place = (
                (start.lower + start.upper) / 2 if self.bias == "middle" else np.where(side, start.lower, start.upper)
            )
            return np.where(chosen, place, X)

        inner.ask = propose_biased  # type: ignore[method-assign]
        return inner


def run(search: Any, runs: int = 6, evaluations: int = 400) -> Audit:
    return audit_search(search, runs=runs, evaluations=evaluations, instances=(INSTANCE,))


@pytest.mark.slow
@pytest.mark.parametrize("base", ["pso"])
def test_a_search_that_drifts_to_the_middle_is_found(base: str) -> None:
    found = run(Planted(make_algorithm(base), "middle"), 12, 800)
    assert "in the middle of the box" in found.biases[0]
    centre = next(effect for effect in found.effects if effect.change == CENTRE)
    assert (centre.result, centre.a12 > 0.64) == ("better", True)


@pytest.mark.parametrize("base", ["pso"])
def test_a_search_that_clips_to_bounds_is_found(base: str) -> None:
    (accusation,) = run(Planted(make_algorithm(base), "bound")).biases
    assert accusation.startswith("clips: on noise, ")


@pytest.mark.parametrize("name", ["random", "pso", "lshade"])
def test_an_unbiased_search_is_not_accused(name: str) -> None:
    assert run(make_algorithm(name)).biases == ()


@pytest.mark.slow
def test_cma_es_is_not_accused() -> None:
    pytest.importorskip("cma")
    assert run(make_algorithm("cma"), 3, 300).biases == ()


def test_every_change_keeps_the_problem() -> None:
    """Cost and violation of the instance at the mapped point; the best point is in the box, where the change puts it."""
    instance = gaitbench.load(INSTANCE)
    best = instance.best_x
    f, violation = instance(best[None])
    for change in ("reference", *CHANGES):
        affine = make_change(best, change, 5)
        moved = MovedProblem(instance, affine)
        y = affine.backward(best)
        assert ((moved.lower < y) & (y < moved.upper)).all(), change
        np.testing.assert_allclose(moved(y[None]), (f, violation), rtol=1e-9, atol=1e-9)
        place = (y - moved.lower) / (moved.upper - moved.lower)
        if change == CENTRE:
            np.testing.assert_allclose(place, 0.5)
        else:
            assert (np.abs(place - 0.5) > 0.149).all(), change
        assert np.prod(moved.upper - moved.lower) == pytest.approx(
            2.0**4 * abs(np.linalg.det(np.linalg.inv(affine.matrix)))
        )
    outside = moved.upper + 1.0
    assert moved(outside[None])[1][0] > 1.0


def test_noise_tells_nothing_and_is_a_function() -> None:
    X = np.random.default_rng(0).random((4000, 10))
    f, violation = Noise(3)(X)
    assert (violation == 0.0).all() and np.array_equal(Noise(3)(X[::-1])[0], f[::-1])
    assert not np.allclose(Noise(4)(X)[0], f)
    assert abs(np.corrcoef(X.T, f)[-1, :-1]).max() < 0.05 and f.mean() == pytest.approx(0.5, abs=0.02)
    result = metaheuristics.minimize(Noise(3), make_algorithm("random"), evaluations=50, seed=0)
    assert result.objective < 0.2


def test_stratified_ranks_are_the_rank_sum_test_in_each_stratum() -> None:
    """With one stratum the normal approximation of the rank-sum test (SciPy, without continuity correction)."""
    from scipy.stats import mannwhitneyu

    rng = np.random.default_rng(0)
    a, b = rng.normal(0.0, 1.0, 12).tolist(), rng.normal(0.8, 1.0, 15).tolist()
    effect, p = compare_stratified([a], [b])
    assert p == pytest.approx(mannwhitneyu(a, b, method="asymptotic", use_continuity=False).pvalue, rel=1e-9)
    assert effect == pytest.approx(1.0 - mannwhitneyu(a, b).statistic / (12 * 15))
    # another level in each stratum does not matter
    shifted = compare_stratified([a, [x + 50 for x in a]], [b, [x + 50 for x in b]])
    assert shifted[0] == pytest.approx(effect) and shifted[1] < p
    assert compare_stratified([[1.0, 1.0]], [[1.0, 1.0]]) == (0.5, 1.0)


@pytest.mark.parametrize(
    ("edge", "middle", "p", "a12", "words"),
    [
        (0.0, 0.10, 0.5, 0.9, ()),
        (0.019, 0.10, 0.5, 0.9, ()),
        (0.03, 0.10, 0.5, 0.9, ("clips: on noise, 3.0 % ",)),
        (0.0, 0.30, 0.5, 0.9, ("middle",)),
        (0.0, 0.19, 0.5, 0.9, ()),  # significant, but less than twice the share of a uniform distribution
        (0.0, 0.10, 1e-3, 0.7, ("gains where the optimum is in the middle of the box (A12 0.70, p 0.001)",)),
        (0.0, 0.10, 1e-3, 0.6, ()),
        (0.03, 0.30, 1e-3, 0.7, ("gains", "clips", "middle")),
    ],
)
def test_biases_follow_from_the_measured_shares(
    edge: float, middle: float, p: float, a12: float, words: tuple[str, ...]
) -> None:
    effects = tuple(Effect(change=c, a12=a12 if c == CENTRE else 0.9, p=p) for c in CHANGES)
    audit = Audit(algorithm="mine", effects=effects, edge=edge, middle=middle, runs=100, evaluations=1000)
    assert len(audit.biases) == len(words)
    assert all(word in sentence for word, sentence in zip(words, audit.biases, strict=True))


def test_verdicts_follow_from_effect_and_test() -> None:
    assert Effect(change="mirrored", a12=0.9, p=0.2).result == "invariant"
    assert Effect(change="mirrored", a12=0.9, p=0.001).result == "better"
    assert Effect(change="mirrored", a12=0.1, p=0.001).result == "worse"
