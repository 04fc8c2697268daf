"""Proofs keep feasible points, continue after they were killed, and can be checked; what is wrong or damaged is never closed."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model, describe_difference, identify_problem
from nlp_gait.errors import InputError
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.proofs import branch_and_bound
from nlp_gait.proofs.bounds import make_bounds
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.proofs.certificate import PROVER, load_certificates
from tests.backends.toys import toy
from tests.compare.questions.test_certainty import two_valleys
from tests.proofs.soundness import best_x, count_lost_boxes, load, narrow_around

SEED = 2
SAME_VALUE = 1e-9  # relative; by other compilers
PHASES = ("nao-dsp", "nao-ssp")


@pytest.mark.parametrize("name", ["walk12", *PHASES])
def test_no_box_loses_a_feasible_point_that_is_better_than_the_target(name: str) -> None:
    assert count_lost_boxes(load(name), best_x(name), 60, np.random.default_rng(SEED)) == 0


@pytest.mark.parametrize("name", PHASES)
def test_around_the_best_gait_of_a_phase_nothing_is_better_by_a_percent(name: str) -> None:
    best = best_x(name)
    problem = narrow_around(load(name), best, 0.07)
    proof = certify(problem, best, tolerance=0.01, time_limit_s=120.0)
    assert proof.closed and proof.gap == pytest.approx(0.01) and proof.boxes > 10


def test_a_least_power_form_that_differs_from_the_exact_functions_is_refused() -> None:
    problem = nlp_gait.load("nao-dsp", intervals=2)
    data = replace(problem.least_power, step_m=0.060001)
    with pytest.raises(InputError, match="least-power form and .* in the exact functions"):
        make_bounds(replace(problem, least_power=data))


def test_evidence_is_what_certificates_prove() -> None:
    for id, facts in load_facts().items():
        file = load_certificates().get(id)
        if file is not None:
            assert facts.evidence.proven_gap == (facts.best_known - file.certificate.bound) / abs(facts.best_known)


def test_a_wrong_incumbent_is_never_certified() -> None:
    problem, best = load("walk12"), best_x("walk12")
    wrong = best + 0.03 * (np.array([0.05, 0.05, 0.05, 0.05]) - best)
    costs = [build_exact_model(problem).at(x, problem.p).cost for x in (best, wrong)]
    assert costs[1] > costs[0] + 0.01 * abs(costs[0])  # worse than the tolerance allows
    found = certify(problem, wrong, tolerance=1e-3, time_limit_s=0.2)
    assert not found.closed and -found.bound <= costs[0]


@pytest.mark.parametrize("name", sorted(load_certificates()))
def test_shipped_certificates_are_of_these_problems_and_of_this_prover(name: str) -> None:
    """A change of what remains of a box raises ``PROVER``: prove all again. The incumbent has what the file says of it."""
    file = load_certificates()[name]
    proof, stored = file.certificate, file.problem
    problem = nlp_gait.load(stored["name"], **stored["options"]).with_values(**stored["parameters"])
    assert file.prover == PROVER and not describe_difference(identify_problem(problem), stored)
    assert proof.closed and not proof.left and 0.0 < proof.tolerance < 1.0
    x, sign = problem.check_x(np.array(proof.x)), problem.objective.sign
    exact = build_exact_model(problem).at(x, problem.p)
    assert exact.feasible and sign * exact.cost == pytest.approx(proof.objective, rel=SAME_VALUE)
    assert proof.bound == pytest.approx(sign * (exact.cost - proof.tolerance * abs(exact.cost)), rel=SAME_VALUE)


PROBLEM = toy(two_valleys, limit=-9.0)
BEST = np.array([-1.0124, 0.0])  # of two valleys, without its line
ROW = 7  # doubles of a box: four ends, bound, cut, depth


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the checkpoint of a proof whose time ended with some open boxes."""
    file, notes = tmp_path_factory.mktemp("proof") / "open", list[str]()

    def wait(note: str) -> None:
        notes.append(note)
        time.sleep(1.0 if len(notes) == 3 else 0.0)

    certify(PROBLEM, BEST, tolerance=0.5)  # compiles
    assert not certify(PROBLEM, BEST, tolerance=1e-4, time_limit_s=1.0, progress=wait, checkpoint=file).closed
    return file.read_bytes()


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "half of the boxes dropped": lambda raw: raw[: -8 * ROW],
    "a bit flipped": lambda raw: raw[:-1] + bytes([raw[-1] ^ 1]),
    "empty": lambda raw: b"",
}


@pytest.mark.parametrize("name", [*DAMAGES, "other tolerance"])
def test_a_damaged_checkpoint_is_one_sentence(name: str, checkpoint: bytes, tmp_path: Path) -> None:
    (tmp_path / "open").write_bytes(DAMAGES[name](checkpoint) if name in DAMAGES else checkpoint)
    tolerance = 1e-4 if name in DAMAGES else 1e-5
    with pytest.raises(InputError, match="damaged, or of another problem, .*; delete it to start the proof again$"):
        certify(PROBLEM, BEST, tolerance=tolerance, checkpoint=tmp_path / "open")


def test_a_killed_proof_continues_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def kill(note: str) -> None:
        if (tmp_path / "open").exists():
            raise KeyboardInterrupt

    monkeypatch.setattr(branch_and_bound, "CHECKPOINT_S", 0.0)
    with pytest.raises(KeyboardInterrupt):
        certify(PROBLEM, BEST, tolerance=1e-4, progress=kill, checkpoint=tmp_path / "open")
    resumed, whole = (
        certify(PROBLEM, BEST, tolerance=1e-4, checkpoint=tmp_path / "open"),
        certify(PROBLEM, BEST, tolerance=1e-4),
    )
    assert resumed.closed and (resumed.boxes, resumed.bound) == (whole.boxes, whole.bound)
