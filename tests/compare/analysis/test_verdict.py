"""Reports mention a certificate with its problem, and with no other."""

from __future__ import annotations

import pytest

import nlp_gait
from compare.analysis.verdict import describe_bound
from nlp_gait.backends.identity import identify_problem
from nlp_gait.proofs.certificate import proven_bound


def test_the_closest_of_several_proofs_is_used() -> None:
    walk = identify_problem(nlp_gait.load("walk12").with_values(**{"lambda": 1.0}))  # proven to 1 % and to 0.1 %
    assert proven_bound(walk) == pytest.approx(1.063938 * 1.001, rel=1e-5)
    phase = identify_problem(nlp_gait.load("nao-ssp"))
    assert proven_bound(phase) == pytest.approx(0.845869 * 0.99, rel=1e-5)
    assert describe_bound(phase, 0.854, "W") == "no feasible point is better than 0.837410 W, 1.9 % from it (proven)"


@pytest.mark.parametrize("change", [{"reach_margin": 0.02}, {"hip_height_m.upper": 0.3}])
def test_nothing_is_proven_of_another_problem(change: dict[str, float]) -> None:
    problem = nlp_gait.load("nao-ssp")
    assert proven_bound(identify_problem(problem.with_values(**change))) is None
    assert describe_bound(identify_problem(problem.with_values(**change)), 1.0, "W") == ""
