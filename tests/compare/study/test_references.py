"""Shipped best known values: each is found by its problem, follows from its point, and has the bound of its certificate."""

import numpy as np
import pytest

import nlp_gait
from compare.study.references import Reference, describe_gap, find_reference, load_shipped
from nlp_gait import gaitbench
from nlp_gait.backends.exact import build_exact_model, describe_difference, identify_problem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.proofs.certificate import find_certificate, load_certificates


def test_every_shipped_value_has_the_bound_of_its_tightest_certificate() -> None:
    """Else run ``python -m benchmarks.best_known``."""
    certificates, named = load_certificates(), set[str]()
    for entry in load_shipped().values():
        proof = find_certificate(entry.problem) or certificates.get(entry.proven_as)
        assert entry.bound == (proof and proof.certificate.bound)
        if proof is not None:
            named.add(entry.proven_as)
            assert certificates[entry.proven_as].certificate.bound == entry.bound
    assert named == certificates.keys()


@pytest.mark.parametrize("key", load_shipped())
def test_a_shipped_value_is_of_its_problem(key: str) -> None:
    """Points of instances and of certificates are evaluated by the tests of these."""
    entry = load_shipped()[key]
    stored = entry.problem
    problem = nlp_gait.load(stored["name"], **stored["options"]).with_values(**stored["parameters"])
    assert describe_difference(stored, identify_problem(problem)) == ""
    facts, proof = load_facts().get(stored["options"].get("instance")), load_certificates().get(entry.proven_as)
    if facts is not None and facts.best_x == entry.x:
        objective = problem.objective.sign * facts.best_known
    elif proof is not None and proof.certificate.x == entry.x:
        objective = proof.certificate.objective
    else:
        values = build_exact_model(problem).at(entry.x, problem.p)
        assert values.violation <= FEASIBILITY_TOLERANCE
        objective = problem.objective.sign * values.cost
    assert objective == pytest.approx(entry.objective, rel=1e-9)


def test_a_generated_instance_has_its_own_point_unless_a_parameter_is_changed() -> None:
    instance = gaitbench.load("gb2:walk12-long:0")
    described = identify_problem(instance.gait_problem)
    known = find_reference(described)
    assert known.objective == instance.gait_problem.objective.sign * instance.best_known and known.bound is None
    assert known.x == tuple(instance.best_x) and known.source == f"generated with {instance.evidence}"
    changed = instance.gait_problem.with_values(**{"lambda": 0.5})
    assert find_reference(identify_problem(changed)).objective is None


@pytest.mark.parametrize("id", ["ssp-v5-time10", "dsp-v5-time05", "walk12-fast-w015", "walk12-fast-w100"])
def test_a_certificate_in_another_form_is_of_the_same_problem(id: str) -> None:
    instance, stored = gaitbench.load(id), load_certificates()[id].problem
    own = instance.gait_problem
    form = nlp_gait.load(stored["name"], **stored["options"]).with_values(**stored["parameters"])
    held = instance.definition.held
    for x in np.random.default_rng(0).uniform(own.lower, own.upper, (20, len(own.names))):
        free = iter(x)
        z = np.array([held[name] if name in held else next(free) for name in form.names])
        found, wanted = build_exact_model(form).at(z, form.p), build_exact_model(own).at(x, own.p)
        assert found.cost == pytest.approx(wanted.cost, rel=1e-12)
        assert found.violation == pytest.approx(wanted.violation, rel=1e-9, abs=1e-12)


def test_every_instance_has_its_shipped_value() -> None:
    assert load_facts().keys() <= {entry.problem["options"].get("instance") for entry in load_shipped().values()}


def test_other_settings_have_no_reference() -> None:
    phase = nlp_gait.load("nao-ssp")
    for change in ({"reach_margin": 0.02}, {"hip_height_m.upper": 0.3}):
        known = find_reference(identify_problem(phase.with_values(**change)))
        assert known == Reference(source="the best of this study; none is shipped for these settings")
    assert "for this problem" in find_reference({"name": "mine", "options": {}, "parameters": {}}).source


def test_the_gap_of_a_proof_is_relative() -> None:
    assert describe_gap(49.0, 50.0) == describe_gap(-51.0, -50.0) == "2 %"
    assert describe_gap(50.0 * (1 + 1e-6), 50.0) == "six digits" != describe_gap(50.0 * (1 + 1e-5), 50.0)


def test_other_formulas_or_files_have_no_reference() -> None:
    walk = identify_problem(nlp_gait.load("walk12"))
    assert find_reference(walk).bound is not None
    for change in ({"mathematics": 2}, {"files": {"robot": "0" * 64}}, {"parameters": {"lambda": 0.3}}):
        assert find_reference({**walk, **change}).objective is None
    derived = nlp_gait.load("walk12").derive(change=lambda assembly, point, ops: assembly)
    assert find_reference(identify_problem(derived)).objective is None  # no name loads it
