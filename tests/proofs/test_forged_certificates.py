"""Forged certificates are refused, each with its reason: changed numbers, worse incumbents, false bounds, other problems."""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.progress import ignore_progress
from nlp_gait.proofs import certificate as certificates
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.proofs.certificate import (
    CertificateFile,
    check_certificate,
    make_certificate_file,
    read_certificate,
    repeat_proof,
)
from tests.backends.toys import toy
from tests.compare.questions.test_certainty import two_valleys
from tests.proofs.soundness import feasible_gaits

Raw = dict[str, Any]
LAMBDA = 0.1  # of the 12-joint walk, whose proof is the shortest
SEED = 4
PATHS = 10


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("walk12", quadrature="simpson").with_values(**{"lambda": LAMBDA})


@pytest.fixture(scope="module")
def honest(problem: GaitProblem) -> CertificateFile:
    best = nlp_gait.solve(problem, starts=3, workers=1)
    proof = certify(problem, problem.check_x(best.x), tolerance=0.02)
    return make_certificate_file(problem, proof)


def write(raw: Raw, folder: Path) -> CertificateFile:
    (folder / "certificate.json").write_text(json.dumps(raw))
    return read_certificate(folder / "certificate.json")


def change(part: str, **values: Any) -> Callable[[Raw], None]:
    return lambda raw: raw[part].update(values)


def scale(key: str, factor: float) -> Callable[[Raw], None]:
    return lambda raw: raw["certificate"].update({key: factor * raw["certificate"][key]})


FORGERIES: dict[str, tuple[Callable[[Raw], None], str]] = {
    "bound tighter than proven": (scale("bound", 0.995), "does not follow from objective and tolerance"),
    "bound below its own incumbent": (scale("bound", 0.97), "contradicted by its own incumbent"),
    "tolerance negative": (change("certificate", tolerance=-0.01), "tolerance must be between 0 and 1, got -0.01"),
    "tolerance zero": (change("certificate", tolerance=0.0), "tolerance must be between 0 and 1, got 0.0"),
    "tolerance huge": (change("certificate", tolerance=1e300), "tolerance must be between 0 and 1, got 1e[+]300"),
    "tolerance not a number": (change("certificate", tolerance=None), "tolerance must be between 0 and 1, got nan"),
    "smaller tolerance for the same bound": (
        change("certificate", tolerance=1e-6),
        "does not follow from objective and tolerance",
    ),
    "objective better than the incumbent's": (scale("objective", 1.001), "but its incumbent has"),
    "objective worse than the incumbent's": (scale("objective", 0.999), "but its incumbent has"),
    "objective and bound better": (
        lambda raw: (scale("objective", 1.001)(raw), scale("bound", 1.001)(raw)) and None,
        "but its incumbent has",
    ),
    "bound not a number": (change("certificate", bound=None), "must be finite"),
    "open boxes left": (change("certificate", left=7), "not finished"),
    "not closed": (change("certificate", closed=False), "not finished"),
    "no boxes": (change("certificate", boxes=0), "at least one box"),
    "negative time": (change("certificate", cpu_s=-1.0), "at least one box and 0 s"),
    "incumbent too short": (lambda raw: raw["certificate"]["x"].pop(), "must have 4 values"),
    "incumbent outside": (lambda raw: raw["certificate"]["x"].__setitem__(0, -1.0), "outside the bounds"),
    "incumbent infeasible": (change("certificate", x=[0.05, 0.13, 0.001, 0.001]), "incumbent is infeasible"),
    "parameters a number": (change("problem", parameters=0), r"problem\.parameters must be an object, got 0"),
    "no options": (change("problem", options=None), r"problem\.options must be an object"),
    "another lambda": (change("problem", parameters={"lambda": 1.0}), "but its incumbent has"),
    "another problem": (change("problem", name="nao-dsp"), "unknown option"),
    "formulas of another version": (change("problem", mathematics=2), "its version of the formulas is 1, not 2"),
    "probes": (change("problem", probes=[]), "unknown key of problem 'probes'"),
    "another schema": (lambda raw: raw.update(schema=1), "schema must be 2"),
    "extra key": (change("certificate", verified=True), "unknown key"),
    "key missing": (lambda raw: raw["certificate"].pop("left"), "certificate.left is missing"),
    "text for a number": (change("certificate", bound="1.0"), "bound must be a number"),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_changed_numbers_are_named(name: str, honest: CertificateFile, tmp_path: Path) -> None:
    forge, message = FORGERIES[name]
    raw = json.loads(json.dumps(asdict(honest)))
    forge(raw)
    with pytest.raises(GaitError, match=message) as refusal:
        check_certificate(write(raw, tmp_path), paths=PATHS, starts=0)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("size", [1e-5, 1e-4, 1e-3, 0.01, 0.03])
def test_a_false_bound_is_refuted_by_a_better_point(size: float, problem: GaitProblem, honest: CertificateFile) -> None:
    forged = forge_bound(problem, honest, size)
    with pytest.raises(InputError, match="is wrong: a start of IPOPT is feasible and has"):
        check_certificate(forged, paths=PATHS)
    points = {"the known one": np.array(honest.certificate.x)}
    with pytest.raises(InputError, match="is wrong: the known one is feasible and has"):
        check_certificate(forged, paths=PATHS, starts=0, points=points)


def forge_bound(problem: GaitProblem, honest: CertificateFile, size: float) -> CertificateFile:
    """Return a certificate with an incumbent that is worse by this share, and a bound that is false by half of it."""
    best, model = np.array(honest.certificate.x), build_exact_model(problem)
    cost = model.at(best, problem.p).cost
    worse = feasible_gaits(problem, best, 1, np.random.default_rng(SEED))[0]
    low, high = 0.0, 1.0
    for _ in range(60):
        part = (low + high) / 2
        better = model.at(best + part * (worse - best), problem.p).cost < cost + size * abs(cost)
        low, high = (part, high) if better else (low, part)
    x = best + high * (worse - best)
    at = model.at(x, problem.p).cost
    sign, tolerance = problem.objective.sign, size / 2
    proof = replace(
        honest.certificate,
        x=tuple(x.tolist()),
        objective=sign * at,
        bound=sign * (at - tolerance * abs(at)),
        tolerance=tolerance,
    )
    return replace(honest, certificate=proof)


def test_a_contradiction_to_a_shipped_certificate_is_named(
    problem: GaitProblem, honest: CertificateFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "find_certificate", lambda description: honest)
    with pytest.raises(InputError, match="is wrong: the shipped certificate is feasible and has"):
        check_certificate(forge_bound(problem, honest, 1e-3), paths=PATHS, starts=0)
    proof = honest.certificate
    impossible = replace(honest, certificate=replace(proof, bound=0.999 * proof.objective))
    monkeypatch.setattr(certificates, "find_certificate", lambda description: impossible)
    with pytest.raises(InputError, match="better than the bound .* of the shipped certificate"):
        check_certificate(honest, paths=PATHS, starts=0)


def test_paths_refute_a_false_bound_without_a_better_point(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = toy(two_valleys, limit=-9.0)
    monkeypatch.setattr(certificates, "load_certified_problem", lambda file: problem)
    honest = make_certificate_file(problem, certify(problem, np.array([-1.0124, 0.0]), tolerance=1e-3))
    assert check_certificate(honest, paths=20, starts=0).paths == 20
    valley = np.array([0.987, 0.0])  # the worse one
    cost = build_exact_model(problem).at(valley, problem.p).cost
    proof = replace(honest.certificate, objective=cost, bound=cost * (1 - 1e-3), x=tuple(valley.tolist()))
    with pytest.raises(InputError, match="do not end"):
        check_certificate(replace(honest, certificate=proof), paths=20, starts=0)


@pytest.mark.slow
def test_an_honest_certificate_passes_and_its_proof_repeats(
    problem: GaitProblem, honest: CertificateFile, tmp_path: Path
) -> None:
    found = check_certificate(honest, paths=40)
    assert (
        found.same_prover and found.paths == 40 and found.best == pytest.approx(honest.certificate.objective, rel=1e-6)
    )
    assert 0.2 * honest.certificate.boxes < found.boxes < 5 * honest.certificate.boxes  # an estimate
    repeated = repeat_proof(honest, ignore_progress, checkpoint=tmp_path / "open")
    assert repeated.closed
    assert (repeated.boxes, repeated.bound) == (honest.certificate.boxes, honest.certificate.bound)
