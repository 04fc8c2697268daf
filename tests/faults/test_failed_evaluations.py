"""An objective that returns NaN or inf: counted as failed, ranked last, in every algorithm under every constraint handling."""

from __future__ import annotations

import numpy as np
import pytest

from metaheuristics import ADAPTERS, ALGORITHMS, Deb, EpsilonLevel, StaticPenalty, make_algorithm, minimize
from metaheuristics.adapters.pymoo import MODULES
from metaheuristics.interface import Array
from tests.metaheuristics.problems import Function

OTHERS = ("cma", "de")
NAMES = sorted({*ALGORITHMS, *OTHERS, *(f"pymoo:{name}" for name in MODULES)})
BUDGET = 600
BAD = {
    "f is NaN": (np.nan, 0.0),
    "f is inf": (np.inf, 0.0),
    "f is -inf": (-np.inf, 0.0),
    "violation is NaN": (-1e9, np.nan),
    "violation is inf": (-1e9, np.inf),
    "both are NaN": (np.nan, np.nan),
}


def test_every_adapter_is_among_them() -> None:
    assert {name.partition(":")[0] for name in ADAPTERS} <= {name.partition(":")[0] for name in NAMES}


@pytest.mark.slow
@pytest.mark.parametrize("handling", [Deb(), StaticPenalty(weight=0.5), EpsilonLevel()], ids=lambda h: h.name)
@pytest.mark.parametrize("name", NAMES)
def test_failures_are_counted_and_never_win(name: str, handling: Deb | StaticPenalty | EpsilonLevel) -> None:
    """The optimum without failures lies among them: x0 < 0 fails, in another manner in every sixth part of x1."""
    kinds = np.array(list(BAD.values()))
    failures = 0

    def function(X: Array) -> tuple[Array, Array]:
        nonlocal failures
        kind = kinds[np.minimum((X[:, 1] * len(kinds)).astype(int), len(kinds) - 1)]
        failed = X[:, 0] < 0.0
        failures += int(failed.sum())
        f = (X[:, 0] + 0.5) ** 2 + X[:, 1]
        violation = np.maximum(0.0, 0.1 - X[:, 0])
        return np.where(failed, kind[:, 0], f), np.where(failed, kind[:, 1], violation)

    problem = Function(function, [-1.0, 0.0], [1.0, 1.0])
    result = minimize(problem, make_algorithm(name), evaluations=BUDGET, handling=handling, seed=2)
    assert result.failed_evaluations == failures > 0
    assert np.isfinite([result.objective, result.violation]).all() and result.x[0] >= 0.0
    assert result.evaluations == BUDGET
