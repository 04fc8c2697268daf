"""Certainty: proofs for problems whose optimum is known, clusters, estimates with known answers, and resumption."""

import numpy as np
import pytest
from casadi import MX

import nlp_gait
from compare.questions.certainty import Certainty, StartEnd, bound_missed, cluster_ends
from compare.questions.question import find
from compare.study.references import find_reference
from nlp_gait.backends.exact import identify_problem
from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import row, toy


def two_valleys(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """10 + (x^2 - 1)^2 + x / 10 + y^2 above the line x + y = limit; valleys near x = -1 and x = 1."""
    return 10 + (x**2 - 1) ** 2 + x / 10 + y**2, (row(x + y, lower=limit),)


def test_an_infeasible_incumbent_is_refused() -> None:
    with pytest.raises(InputError, match="infeasible"):
        certify(toy(two_valleys, limit=2.0), np.array([0.0, 0.0]))


def make_end(x: float, objective: float, feasible: bool) -> StartEnd:
    return StartEnd(x=(x, 0.0), objective=objective, feasible=feasible, status="")


def test_ends_of_equal_value_far_apart_are_two_optima_and_failures_count_for_none() -> None:
    pairs = ((1.0, 2.0), (-1.0, 2.0), (1.001, 2.00001))
    ends = [*(make_end(x, objective, True) for x, objective in pairs), make_end(0.5, 1.0, False)]
    found = cluster_ends(toy(two_valleys), ends)
    assert [optimum.count for optimum in found] == [2, 1]
    assert [optimum.objective for optimum in found] == [2.0, 2.0]
    assert sum(optimum.share for optimum in found) == pytest.approx(1.0)


def test_the_largest_missed_optimum_by_hand() -> None:
    assert (1 - bound_missed(10)) ** 10 == pytest.approx(0.05)


def test_gaps_and_proofs_begin_at_the_shipped_point_and_not_at_a_worse_start() -> None:
    problem = nlp_gait.load("walk12").with_values(**{"lambda": 1.0})
    known = find_reference(identify_problem(problem))
    question = Certainty(problem=problem, starts=1, time_limit_s=1e-9)
    evidence = find(question)
    answer = question.add_best_known(evidence)
    assert known.objective is not None and evidence.certificate is not None
    assert evidence.optima[0].objective < 0.999 * known.objective  # the start ends at another local optimum
    assert "(shipped, proven to six digits); the optimum found here is 0.16 % from it" in answer.headline[-1]
    assert answer.data["best_known"] == known.objective and answer.data["best_known_source"] == known.source
    assert evidence.certificate.objective == pytest.approx(known.objective, abs=1e-12)
    assert not evidence.certificate.closed and np.isnan(evidence.certificate.bound)
    assert "nothing: the time limit was reached before a finite bound" in evidence.proven


def test_evidence_is_proven_or_supported() -> None:
    problem = toy(two_valleys, limit=-9.0)
    question = Certainty(problem=problem, starts=12, time_limit_s=20.0)
    evidence = find(question)
    assert len(evidence.optima) == 2
    assert evidence.optima[0].x[0] < 0.0 < evidence.optima[1].x[0]
    assert evidence.certificate is not None and evidence.certificate.closed
    assert "no feasible x falls below" in evidence.proven
