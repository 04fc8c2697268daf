"""A proven bound as a file, and its check: random paths from the whole box inwards, followed again."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import problem_part, sha256_of
from nlp_gait.decoding import decoded
from nlp_gait.errors import InputError
from nlp_gait.files import read_json, refusing
from nlp_gait.formulation import GaitProblem, load
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs import (
    affine,
    boxes,
    branch_and_bound,
    power_bounds,
    power_form,
    power_instants,
    quadratic,
    quadratic_tape,
)
from nlp_gait.proofs.bounds import bounds_of
from nlp_gait.proofs.boxes import halves
from nlp_gait.proofs.branch_and_bound import Certificate, target_of
from nlp_gait.references import named_as
from nlp_gait.symbolic import world_frame

SCHEMA = 1
PATHS = 200
DEEPEST_PATH = 150
# Of an objective that is computed again on another machine, relative.
SAME_VALUE = 1e-9
# All that decides what happens to a box; with the native sources of the forms.
CODE = (
    affine,
    quadratic,
    quadratic_tape,
    world_frame,
    boxes,
    branch_and_bound,
    power_bounds,
    power_form,
    power_instants,
)


@dataclass(frozen=True, kw_only=True)
class CertificateFile:
    """A certificate with what it is of.

    Attributes:
        schema: of the file.
        problem: name, options, parameters, and the hash of its mathematics.
        code_sha256: of the code that bounds and halves.
        certificate: itself.
    """

    schema: Literal[1] = 1
    problem: Mapping[str, Any]
    code_sha256: str
    certificate: Certificate

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class Check:
    """What following random paths found.

    Attributes:
        paths: followed to boxes of which both halves are dropped.
        pieces: dropped on the way: every one of them is proven to hold nothing better.
        deepest: halvings on the longest.
        boxes: estimate of the boxes in the whole tree from these paths (Knuth 1975).
        same_code: the file was made by this code; with another one, the paths are proofs of today's.
    """

    paths: int
    pieces: int
    deepest: int
    boxes: float
    same_code: bool


def certificate_file(problem: GaitProblem, certificate: Certificate) -> CertificateFile:
    """The certificate of a problem, for a file."""
    return CertificateFile(problem=problem_part(problem), code_sha256=_code(), certificate=certificate)


def read_certificate(path: Path) -> CertificateFile:
    """Raises InputError where the file is no certificate."""
    raw = read_json(path, "certificate")
    with refusing(f"certificate {str(path)!r} is damaged", InputError):
        return decoded(CertificateFile, raw)


def check(file: CertificateFile, *, paths: int = PATHS, seed: int = 0) -> Check:
    """Follow random paths again: both halves of a box are bounded, and the path goes on in one that is not dropped.

    Args:
        file: of a closed proof.
        paths: to follow.
        seed: of the choice.

    Raises:
        InputError: the proof is not closed, the problem is another one today, the incumbent is not feasible or has another
            objective, or a path does not end.
    """
    proof = file.certificate
    problem = _problem(file.problem)
    x = problem.check_x(np.array(proof.x))
    if (np.maximum(problem.lower - x, x - problem.upper) > FEASIBILITY_TOLERANCE * problem.scale).any():
        raise InputError("the certificate's incumbent is outside the bounds of its variables")
    at = build_exact_model(problem).at(x, problem.p)
    objective = problem.objective.sign * at.cost
    if not proof.closed:
        raise InputError("the certificate is of a proof that has not ended: there is nothing to check but its bound")
    if not at.violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the certificate's incumbent is infeasible: total violation {at.violation:.3g}")
    if not abs(objective - proof.objective) <= SAME_VALUE * abs(objective):
        raise InputError(f"the certificate's objective is {proof.objective}, but its incumbent has {objective}")
    target = target_of(at.cost, proof.tolerance)
    if not problem.objective.sign * proof.bound <= target + SAME_VALUE * abs(target):
        raise InputError(f"the certificate's bound {proof.bound} says more than its tolerance {proof.tolerance}")
    bounds, rng = bounds_of(problem), np.random.default_rng(seed)
    open_, _, cut, origin = bounds.assess(np.repeat(bounds.whole, paths, axis=0), target)
    path, weight, sizes, dropped = origin, np.ones(len(origin)), np.ones(paths), paths - len(origin)
    for depth in range(DEEPEST_PATH):
        if not len(path):
            same = file.code_sha256 == _code()
            return Check(paths=paths, pieces=dropped, deepest=depth, boxes=float(sizes.mean()), same_code=same)
        sizes[path] += 2.0 * weight
        found = bounds.assess(halves(open_, cut), target)
        count = len(path)
        dropped += 2 * count - len(found.origin)
        alive = np.full((2, count), -1)
        alive[found.origin // count, found.origin % count] = np.arange(len(found.origin))
        both = (alive >= 0).all(axis=0)
        side = np.where(both, rng.integers(0, 2, count), (alive[0] < 0).astype(int))
        chosen = alive[side, np.arange(count)]
        goes_on = chosen >= 0
        weight = np.where(both, 2.0, 1.0)[goes_on] * weight[goes_on]
        path, open_, cut = path[goes_on], found.boxes[chosen[goes_on]], found.cut[chosen[goes_on]]
    raise InputError(f"{len(path)} of {paths} paths do not end after {DEEPEST_PATH} halvings: the bound is not proven")


def _problem(description: Mapping[str, Any]) -> GaitProblem:
    with refusing("the certificate's problem cannot be made", InputError):
        stored = decoded(StoredProblem, description, "problem")
        name = named_as(stored.name, "problem", "the certificate")
        problem = load(name, **stored.options).with_values(**stored.parameters)
    if problem_part(problem) != dict(description):
        raise InputError(f"problem {problem.name!r} is another one today than in the certificate; prove it anew")
    return problem


def _code() -> str:
    native = files("nlp_gait.proofs") / "native"
    texts = [inspect.getsource(module) for module in CODE]
    texts += [
        (native / name).read_text(encoding="utf-8") for name in ("intervals.hpp", "affine.hpp", *quadratic.SOURCES)
    ]
    return sha256_of(texts)
