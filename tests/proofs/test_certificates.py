"""Proofs keep feasible points, continue after they were killed, and can be checked; a wrong proof is never closed."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError, UserCodeError
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.proofs import branch_and_bound
from nlp_gait.proofs.bounds import make_bounds
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.proofs.certificate import (
    CERTIFICATES,
    check_certificate,
    load_certificates,
    load_certified_problem,
    make_certificate_file,
    read_certificate,
)
from nlp_gait.proofs.checkpoint import PROVER
from tests.backends.toys import toy
from tests.compare.questions.test_certainty import two_valleys
from tests.proofs.soundness import best_x, count_lost_boxes, feasible_gaits, load, narrow_around, narrow_bounds

SEED = 2
PROBLEM = toy(two_valleys, limit=-9.0)
BEST = np.array([-1.0124, 0.0])  # of two valleys, without its line
PHASES = ("nao-dsp", "nao-ssp")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walk12", *PHASES])
def test_no_box_loses_a_feasible_point_that_is_better_than_the_target(name: str) -> None:
    assert count_lost_boxes(load(name), best_x(name), 100, np.random.default_rng(SEED)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", PHASES)
def test_around_the_best_gait_of_a_phase_nothing_is_better_by_a_percent(name: str) -> None:
    best = best_x(name)
    problem = narrow_around(load(name), best, 0.07)
    proof = certify(problem, best, tolerance=0.01, time_limit_s=120.0)
    assert proof.closed and proof.gap == pytest.approx(0.01) and proof.boxes > 10


@pytest.mark.slow
def test_a_gait_that_is_three_percent_worse_is_never_certified() -> None:
    problem, best = load("nao-dsp"), best_x("nao-dsp")
    gaits = [best, *feasible_gaits(problem, best, 60, np.random.default_rng(SEED))]
    costs = [build_exact_model(problem).at(x, problem.p).cost for x in gaits]
    wrong = gaits[int(np.argmin(np.abs(np.array(costs) / costs[0] - 1.03)))]
    cost = build_exact_model(problem).at(wrong, problem.p).cost
    assert 1.02 * costs[0] < cost < 1.04 * costs[0]
    half = 2.0**-7 * (problem.upper - problem.lower)
    ends = (
        np.maximum(problem.lower, np.minimum(best, wrong) - half),
        np.minimum(problem.upper, np.maximum(best, wrong) + half),
    )
    narrow = narrow_bounds(problem, *ends)
    assert certify(narrow, best, tolerance=0.01, time_limit_s=120.0).closed
    proof = certify(narrow, wrong, tolerance=0.01, time_limit_s=0.2)
    assert not proof.closed and proof.bound <= costs[0]


def test_an_infeasible_gait_is_not_an_incumbent_of_a_phase() -> None:
    problem, best = load("nao-dsp"), best_x("nao-dsp")
    cheat = best.copy()
    cheat[5] *= 0.9  # less sway: too small a margin
    at = build_exact_model(problem).at(cheat, problem.p)
    assert at.violation > 1e-5
    with pytest.raises(InputError, match="infeasible"):
        certify(problem, cheat)


@pytest.mark.slow
def test_a_least_power_form_that_differs_from_the_exact_functions_is_refused() -> None:
    problem = nlp_gait.load("nao-dsp", intervals=2)
    form = problem.power_form(problem)
    z = ca.SX.sym("z", len(problem.names))
    wrong = [1.000001 * value for value in form.indexes.call([z])]
    indexes = ca.Function("indexes", [z], wrong, ["z"], form.indexes.name_out())
    with pytest.raises(InputError, match="least-power form and .* in the exact functions"):
        make_bounds(replace(problem, power_form=lambda _: replace(form, indexes=indexes)))


def test_other_mathematics_has_no_least_power_form() -> None:
    assert nlp_gait.load("nao-dsp", trajectory="quintic").power_form is None
    assert load("nao-dsp").with_values(reach_margin=0.02).power_form is not None
    assert load("nao-dsp").derive(change=lambda assembly, point, ops: assembly).power_form is None


@pytest.mark.slow
def test_walk12_is_proven_and_its_certificate_checked(tmp_path: Path) -> None:
    problem, best = load("walk12"), best_x("walk12")
    proof = certify(problem, best, tolerance=0.05, time_limit_s=120.0)
    assert proof.closed and proof.gap == pytest.approx(0.05)
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(asdict(make_certificate_file(problem, proof))))
    found = check_certificate(read_certificate(path), starts=1, paths=40)
    assert found.paths == 40 and found.same_prover
    assert 0.2 * proof.boxes < found.boxes < 5 * proof.boxes  # an estimate


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dsp-v5", "walk12-lambda-1"])
def test_a_random_path_of_a_shipped_proof_ends(name: str) -> None:
    assert check_certificate(load_certificates()[name], starts=1, paths=1).paths == 1


def test_shipped_certificates_load_the_problems_that_they_name() -> None:
    """Options that are newer than a certificate have their defaults."""
    for name, file in load_certificates().items():
        assert file.certificate.closed, name
        options = nlp_gait.load(file.problem["name"], **file.problem["options"]).options
        assert file.problem["options"].items() <= options.items(), name


def test_evidence_is_what_certificates_prove() -> None:
    for id, facts in load_facts().items():
        file = load_certificates().get(id)
        if file is not None:
            assert facts.evidence.proven_gap == (facts.best_known - file.certificate.bound) / abs(facts.best_known)


def test_a_killed_proof_continues_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(branch_and_bound, "BATCH", 4)
    monkeypatch.setattr(branch_and_bound, "CHECKPOINT_S", 0.0)
    whole = certify(PROBLEM, BEST, tolerance=1e-4)
    file, told = tmp_path / "open.npz", list[str]()

    def kill(note: str) -> None:
        told.append(note)
        if len(told) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        certify(PROBLEM, BEST, tolerance=1e-4, progress=kill, checkpoint=file)
    resumed = certify(PROBLEM, BEST, tolerance=1e-4, checkpoint=file)
    assert resumed.closed and (resumed.boxes, resumed.bound) == (whole.boxes, whole.bound)
    with pytest.raises(InputError, match="belongs to another problem, incumbent or tolerance"):
        certify(PROBLEM, BEST, tolerance=1e-3, checkpoint=file)


def test_a_wrong_incumbent_is_never_certified() -> None:
    problem, best = load("walk12"), best_x("walk12")
    wrong = best + 0.03 * (np.array([0.05, 0.05, 0.05, 0.05]) - best)
    costs = [build_exact_model(problem).at(x, problem.p).cost for x in (best, wrong)]
    assert costs[1] > costs[0] + 0.01 * abs(costs[0])  # worse than the tolerance allows
    found = certify(problem, wrong, tolerance=1e-3, time_limit_s=0.2)
    assert not found.closed and -found.bound <= costs[0]


def test_a_certificate_runs_no_code_that_was_not_named(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("raise SystemExit('it ran')\n")
    raw = json.loads((CERTIFICATES / "walk12-lambda-1.json").read_text())
    raw["problem"]["name"] = f"{tmp_path / 'own.py'}:problem"
    (tmp_path / "certificate.json").write_text(json.dumps(raw))
    with pytest.raises(UserCodeError, match="certificate needs your code.*--code"):
        check_certificate(read_certificate(tmp_path / "certificate.json"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"problem": {"parameters": 0}}, r"problem\.parameters must be an object, got 0"),
        ({"problem": {"options": None}}, r"problem\.options must be an object"),
        ({"certificate": {"x": [0.05, 0.1]}}, "walk12 must have 4 values"),
        ({"certificate": {"x": [-1.0, 0.1, 0.001, 0.008]}}, "outside the bounds"),
    ],
    ids=["parameters", "options", "too short", "outside"],
)
def test_a_damaged_certificate_is_refused(change: dict[str, dict[str, object]], message: str, tmp_path: Path) -> None:
    raw = json.loads((CERTIFICATES / "walk12-lambda-1.json").read_text())
    for part, values in change.items():
        raw[part] |= values
    (tmp_path / "certificate.json").write_text(json.dumps(raw))
    with pytest.raises(InputError, match=message):
        check_certificate(read_certificate(tmp_path / "certificate.json"))


def test_a_certificate_of_another_problem_is_refused() -> None:
    problem = load("walk12")
    honest = certify(PROBLEM, BEST, tolerance=1e-3)
    part = {
        **make_certificate_file(problem, honest).problem,
        "probes": make_certificate_file(PROBLEM, honest).problem["probes"],
    }
    with pytest.raises(
        InputError, match="has changed since the certificate was made: it has 4 variables, not 2; its bound"
    ):
        check_certificate(replace(make_certificate_file(problem, honest), problem=part))


@pytest.mark.parametrize("name", sorted(load_certificates()))
def test_shipped_certificates_are_of_these_problems_and_of_this_prover(name: str) -> None:
    """A change of what remains of a box raises ``PROVER``: prove all again."""
    assert load_certificates()[name].prover == PROVER
    load_certified_problem(load_certificates()[name])
