"""Certificates: files of proven bounds, the shipped ones, and a check that follows random paths of a proof again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import HASH, identify_problem
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_json
from nlp_gait.formulation import GaitProblem, load
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs.bounds import make_bounds
from nlp_gait.proofs.boxes import halve
from nlp_gait.proofs.branch_and_bound import Certificate, target_cost
from nlp_gait.proofs.checkpoint import hash_code
from nlp_gait.user_code import resolve_code

CERTIFICATES = Path(str(files("nlp_gait.proofs") / "certificates"))
PATHS = 200
DEEPEST_PATH = 150
# Relative difference of an objective that is computed on another machine.
SAME_VALUE = 1e-9


@dataclass(frozen=True, kw_only=True)
class CertificateFile:
    """A certificate and its problem."""

    schema: Literal[1] = 1  # version of the file format
    problem: Mapping[str, Any]  # name, options, parameters, and the hash of its mathematics
    code_sha256: str  # hash of the code that made the proof, see ``hash_code``
    certificate: Certificate  # the proven bound

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class Check:
    """Result of following random paths."""

    paths: int  # number of paths, each from the root to a box of which both halves are dropped
    pieces: int  # number of boxes dropped on the way; each is proven to contain nothing better
    deepest: int  # number of halvings on the longest path
    boxes: float  # estimated number of boxes of the whole tree (Knuth 1975)
    same_code: bool  # whether this code made the file; otherwise the paths prove what this code would prove


def make_certificate_file(problem: GaitProblem, certificate: Certificate) -> CertificateFile:
    """Return the certificate of a problem with its problem and code."""
    return CertificateFile(
        problem=identify_problem(problem), code_sha256=hash_code(make_bounds(problem)), certificate=certificate
    )


def read_certificate(path: Path) -> CertificateFile:
    """Read a certificate; raises InputError if the file is not one."""
    raw = read_json(path, "certificate")
    with convert_errors(f"certificate {str(path)!r} is damaged", InputError):
        return decode(CertificateFile, raw)


@cache
def load_certificates() -> Mapping[str, CertificateFile]:
    """Read the shipped certificates by file name without suffix: an instance of GaitBench, or ``walk12-lambda-LAMBDA``."""
    return {path.stem: read_certificate(path) for path in sorted(CERTIFICATES.glob("*.json"))}


def find_certificate(problem: Mapping[str, Any]) -> CertificateFile | None:
    """Return the shipped certificate of a problem with the smallest gap, see ``identify_problem``; None if there is none."""
    found = [file for file in load_certificates().values() if file.problem[HASH] == problem.get(HASH)]
    return min(found, key=lambda file: file.certificate.gap, default=None)


def proven_bound(problem: Mapping[str, Any]) -> float | None:
    """Return the objective that no feasible point of a problem betters; None without a shipped certificate."""
    found = find_certificate(problem)
    return None if found is None else found.certificate.bound


def check_certificate(file: CertificateFile, *, paths: int = PATHS, seed: int = 0) -> Check:
    """Follow random paths of a closed proof: both halves of a box are bounded, and the path continues in one that remains.

    Raises:
        InputError: the proof is not closed, the problem has changed, the incumbent is infeasible or has another objective, or a
            path does not end.
    """
    problem = _load_problem(file.problem)
    target = _check_incumbent(problem, file.certificate)
    bounds, rng = make_bounds(problem), np.random.default_rng(seed)
    open_, _, cut, origin = bounds.prune(np.repeat(bounds.root, paths, axis=0), target)
    path, weight, sizes, dropped = origin, np.ones(len(origin)), np.ones(paths), paths - len(origin)
    for depth in range(DEEPEST_PATH):
        if not len(path):
            same = file.code_sha256 == hash_code(bounds)
            return Check(paths=paths, pieces=dropped, deepest=depth, boxes=float(sizes.mean()), same_code=same)
        sizes[path] += 2.0 * weight
        found = bounds.prune(halve(open_, cut), target)
        count = len(path)
        dropped += 2 * count - len(found.origin)
        alive = np.full((2, count), -1)
        alive[found.origin // count, found.origin % count] = np.arange(len(found.origin))
        both = (alive >= 0).all(axis=0)
        side = np.where(both, rng.integers(0, 2, count), (alive[0] < 0).astype(int))
        chosen = alive[side, np.arange(count)]
        continues = chosen >= 0
        weight = np.where(both, 2.0, 1.0)[continues] * weight[continues]
        path, open_, cut = path[continues], found.boxes[chosen[continues]], found.cut[chosen[continues]]
    raise InputError(f"{len(path)} of {paths} paths do not end after {DEEPEST_PATH} halvings: the bound is not proven")


def _check_incumbent(problem: GaitProblem, proof: Certificate) -> float:
    """Compare a certificate with its incumbent; returns the cost that was proven as a lower bound."""
    x = problem.check_x(np.array(proof.x))
    if (np.maximum(problem.lower - x, x - problem.upper) > FEASIBILITY_TOLERANCE * problem.scale).any():
        raise InputError("the certificate's incumbent is outside the bounds of its variables")
    at = build_exact_model(problem).at(x, problem.p)
    objective = problem.objective.sign * at.cost
    if not proof.closed:
        raise InputError("the certificate is of a proof that was not finished; only its bound can be used")
    if not at.violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the certificate's incumbent is infeasible: total violation {at.violation:.3g}")
    if not abs(objective - proof.objective) <= SAME_VALUE * abs(objective):
        raise InputError(f"the certificate's objective is {proof.objective}, but its incumbent has {objective}")
    target = target_cost(at.cost, proof.tolerance)
    if not problem.objective.sign * proof.bound <= target + SAME_VALUE * abs(target):
        raise InputError(
            f"the certificate's bound {proof.bound} is tighter than its tolerance {proof.tolerance} allows"
        )
    return target


def _load_problem(description: Mapping[str, Any]) -> GaitProblem:
    with convert_errors("the certificate's problem cannot be made", InputError):
        stored = decode(StoredProblem, description, "problem")
        name = resolve_code(stored.name, "problem", "the certificate")
        problem = load(name, **stored.options).with_values(**stored.parameters)
    if identify_problem(problem) != dict(description):
        raise InputError(
            f"problem {problem.name!r} has changed since the certificate was made; rerun `nlp-gait certainty` on it"
        )
    return problem
