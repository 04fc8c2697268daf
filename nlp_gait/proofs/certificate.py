"""Certificates: files of proven bounds, the shipped ones, and their checks.

A check looks for a better point, follows paths of the proof again, or repeats it as a whole. Boxes that refute a false bound
surround the better points, and random paths seldom meet them: so half of the paths lead towards the best point that is known.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import describe_difference, identify_problem
from nlp_gait.backends.solve import solve
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_json
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.progress import Progress
from nlp_gait.proofs.bounds import make_bounds
from nlp_gait.proofs.boxes import halve
from nlp_gait.proofs.branch_and_bound import Certificate, certify, target_cost
from nlp_gait.proofs.checkpoint import PROVER

CERTIFICATES = Path(str(files("nlp_gait.proofs") / "certificates"))
PATHS, STARTS = 200, 5
DEEPEST_PATH = 150
# Relative difference of an objective that is computed on another machine.
SAME_VALUE = 1e-9
# Paths lead to points whose distances from the best one are these powers of ten of the variables' ranges.
NEAREST, FARTHEST = -6.0, -1.0


@dataclass(frozen=True, kw_only=True)
class CertificateFile:
    """A certificate and its problem."""

    schema: Literal[2] = 2  # version of the file format
    problem: Mapping[str, Any]  # see ``identify_problem``
    prover: int  # version that made the proof, see ``PROVER``
    certificate: Certificate  # the proven bound


def make_certificate_file(problem: GaitProblem, certificate: Certificate) -> CertificateFile:
    """Return the certificate of a problem with the problem and the version of the prover."""
    return CertificateFile(problem=identify_problem(problem), prover=PROVER, certificate=certificate)


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
    """Return the shipped certificate with the smallest gap of an equal problem, which may have another name; None for none."""
    equal = [file for file in load_certificates().values() if not describe_difference(file.problem, problem)]
    return min(equal, key=lambda file: file.certificate.gap, default=None)


@dataclass(frozen=True, kw_only=True)
class CertificateCheck:
    """Result of a search for better points, and of following paths."""

    best: float  # best feasible objective found; it does not contradict the bound
    source: str  # of its point
    paths: int  # number of paths, each from the root to a box of which both halves are dropped
    pieces: int  # number of boxes dropped on the way; each is proven to contain nothing better
    deepest: int  # number of halvings on the longest path
    boxes: float  # estimated number of boxes of the whole tree (Knuth 1975)
    #: Whether this version of the prover made the file; otherwise the paths prove what this one would prove
    same_prover: bool


def load_certified_problem(file: CertificateFile) -> GaitProblem:
    """Return the problem of a certificate; raises InputError if it cannot be made or has changed."""
    with convert_errors("the certificate's problem cannot be made", InputError):
        stored = decode(StoredProblem, file.problem, "problem")
        name, options = resolve_stored(stored.name, stored.options, "the certificate")
        problem = load(name, **options).with_values(**stored.parameters)
    difference = describe_difference(file.problem, identify_problem(problem))
    if difference:
        raise InputError(
            f"problem {problem.name!r} has changed since the certificate was made: {difference}; its bound is not used, "
            "rerun `nlp-gait certainty`"
        )
    return problem


def check_certificate(
    file: CertificateFile,
    *,
    points: Mapping[str, Array] | None = None,
    starts: int = STARTS,
    paths: int = PATHS,
    seed: int = 0,
) -> CertificateCheck:
    """Look for a point that is better than the bound, then follow paths of the proof.

    IPOPT's first start is the incumbent; ``points`` are more points (n,) to compare with the bound, by their source
    in words. On each path both halves of a box are bounded, and the path continues in one that remains: half of the paths in a
    random one, the others in the one that contains a point near the best one.

    Raises InputError that says what is wrong with the certificate, which point is better, or that a path does not end.
    """
    problem, target = _check_numbers(file)
    candidates = {"the incumbent": np.array(file.certificate.x), **_check_shipped(problem, file), **(points or {})}
    if starts:
        solution = solve(problem, starts=starts, seed=seed, x0=candidates["the incumbent"])
        candidates["a start of IPOPT"] = problem.check_x(solution.x)
    best, source = _find_best(problem, file.certificate, candidates)
    bounds, rng = make_bounds(problem), np.random.default_rng(seed)
    reach = 10.0 ** rng.uniform(NEAREST, FARTHEST, (paths, 1)) * (problem.upper - problem.lower)
    goals = candidates[source] + reach * rng.standard_normal((paths, len(problem.names)))
    goals = bounds.to_z(np.clip(goals, problem.lower, problem.upper))
    goals[: (paths + 1) // 2] = np.nan  # random paths
    open_, _, cut, origin = bounds.prune(np.repeat(bounds.root, paths, axis=0), target)
    path = origin
    weight = np.ones(len(origin))
    sizes = np.ones(paths)
    dropped = paths - len(origin)
    for depth in range(DEEPEST_PATH):
        if not len(path):
            size = float(sizes[: (paths + 1) // 2].mean())
            same = file.prover == PROVER
            return CertificateCheck(
                best=best, source=source, paths=paths, pieces=dropped, deepest=depth, boxes=size, same_prover=same
            )
        sizes[path] += 2.0 * weight
        halves = bounds.prune(halve(open_, cut), target)
        count = len(path)
        dropped += 2 * count - len(halves.origin)
        alive = np.full((2, count), -1)
        alive[halves.origin // count, halves.origin % count] = np.arange(len(halves.origin))
        both = (alive >= 0).all(axis=0)
        side = np.where(both, rng.integers(0, 2, count), (alive[0] < 0).astype(int))
        if both.any():
            boxes = halves.boxes[alive[:, both]]  # (2, B, n, 2)
            goal = goals[path[both]]
            inside = ((boxes[..., 0] <= goal) & (goal <= boxes[..., 1])).all(axis=-1)
            side[both] = np.where(inside[0] ^ inside[1], inside[1], side[both])
        chosen = alive[side, np.arange(count)]
        continues = chosen >= 0
        weight = np.where(both, 2.0, 1.0)[continues] * weight[continues]
        path, open_, cut = path[continues], halves.boxes[chosen[continues]], halves.cut[chosen[continues]]
    raise InputError(f"{len(path)} of {paths} paths do not end after {DEEPEST_PATH} halvings: the bound is not proven")


def repeat_proof(file: CertificateFile, progress: Progress, checkpoint: Path) -> Certificate:
    """Prove the bound of a certificate again, as a whole; arguments and errors as ``certify`` and ``check_certificate``."""
    (problem, _), proof = _check_numbers(file), file.certificate
    limits = {"tolerance": proof.tolerance, "time_limit_s": math.inf}
    return certify(problem, np.array(proof.x), **limits, progress=progress, checkpoint=checkpoint)


def _check_numbers(file: CertificateFile) -> tuple[GaitProblem, float]:
    """Compare a certificate with its incumbent; return its problem and the cost that was proven as a lower bound."""
    proof = file.certificate
    if not proof.closed or proof.left:
        raise InputError("the certificate is of a proof that was not finished; only its bound can be used")
    if not 0.0 < proof.tolerance < 1.0:
        raise InputError(f"the certificate's tolerance must be between 0 and 1, got {proof.tolerance}")
    bound, objective = proof.bound, proof.objective
    if not (math.isfinite(bound) and math.isfinite(objective)):
        raise InputError(f"the certificate's bound and objective must be finite, got {bound} and {objective}")
    if not (proof.boxes >= 1 and 0.0 <= proof.time_s < math.inf and 0.0 <= proof.cpu_s < math.inf):
        raise InputError(
            f"the certificate's proof must have at least one box and 0 s, got {proof.boxes}, {proof.time_s} s, "
            f"{proof.cpu_s} s of the processor"
        )
    problem = load_certified_problem(file)
    x, sign = problem.check_x(np.array(proof.x)), problem.objective.sign
    if _is_outside(problem, x):
        raise InputError("the certificate's incumbent is outside the bounds of its variables")
    exact = build_exact_model(problem).at(x, problem.p)
    objective = sign * exact.cost
    if not exact.violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the certificate's incumbent is infeasible: total violation {exact.violation:.3g}")
    if not abs(objective - proof.objective) <= SAME_VALUE * abs(objective):
        raise InputError(f"the certificate's objective is {proof.objective}, but its incumbent has {objective}")
    if sign * proof.bound > exact.cost:
        raise InputError(f"the certificate's bound {proof.bound} is contradicted by its own incumbent, {objective}")
    target = target_cost(exact.cost, proof.tolerance)
    if not abs(sign * proof.bound - target) <= SAME_VALUE * abs(target):
        raise InputError(
            f"the certificate's bound {proof.bound} does not follow from objective and tolerance, which give {sign * target}"
        )
    return problem, target


def _is_outside(problem: GaitProblem, x: Array) -> bool:
    return bool((np.maximum(problem.lower - x, x - problem.upper) > FEASIBILITY_TOLERANCE * problem.scale).any())


def _check_shipped(problem: GaitProblem, file: CertificateFile) -> dict[str, Array]:
    """Return the incumbent of the shipped certificate of the same problem, whose bound must not contradict this one."""
    shipped = find_certificate(file.problem)
    if shipped is None:
        return {}
    sign, bound, objective = problem.objective.sign, shipped.certificate.bound, file.certificate.objective
    if sign * objective < sign * bound - SAME_VALUE * abs(bound):
        raise InputError(
            f"the certificate's objective {objective} is better than the bound {bound} of the shipped certificate"
        )
    return {"the shipped certificate": np.array(shipped.certificate.x)}


def _find_best(problem: GaitProblem, proof: Certificate, points: Mapping[str, Array]) -> tuple[float, str]:
    """Return the best objective of the feasible points and its source; raises InputError if it is better than the bound."""
    model, sign = build_exact_model(problem), problem.objective.sign
    costs = dict[str, float]()
    for source, x in points.items():
        exact = model.at(x, problem.p)
        if exact.violation <= FEASIBILITY_TOLERANCE and not _is_outside(problem, x):
            costs[source] = exact.cost
    source = min(costs, key=lambda name: costs[name])
    best = sign * costs[source]
    if costs[source] < sign * proof.bound:
        raise InputError(f"the certificate's bound {proof.bound} is wrong: {source} is feasible and has {best}")
    return best, source
