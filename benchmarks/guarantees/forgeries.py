"""Power of the check of certificates: ``python -m benchmarks.guarantees.forgeries OUT.md [COUNT [NAME ...]]``.

A forged certificate has a feasible incumbent that is worse than the best known one by a given share, and a bound right below its
objective, which is false. The hardest one has another local optimum as incumbent, around which nothing is better: that of the
12-joint walk at lambda = 1, which is 3e-5 worse. The table says how many of COUNT forgeries of each size are refused by the check
as shipped, by the same without shipped certificates, and by paths alone. The command line compares a search by PSO, too.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from unittest import mock

import numpy as np

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.files import write_text
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs import certificate as certificates
from nlp_gait.proofs.branch_and_bound import TOLERANCE, Certificate
from nlp_gait.proofs.certificate import STARTS, CertificateFile, check_certificate, make_certificate_file
from tests.proofs.soundness import best_x, feasible_gaits, load

COUNT, SEED = 10, 11
NAMES = ("walk12", "nao-dsp", "nao-ssp")
SIZES = (2e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.03)
PATHS = 40
LOCAL_STARTS = 20  # of IPOPT, to find the local optimum


def forge(problem: GaitProblem, best: Array, size: float, rng: np.random.Generator) -> CertificateFile:
    """Return a certificate whose bound is false by about ``size``, relatively."""
    model = build_exact_model(problem)
    cost = model.at(best, problem.p).cost
    while True:
        worse = feasible_gaits(problem, best, 1, rng)[0]
        low, high = 0.0, 1.0
        for _ in range(60):
            part = (low + high) / 2
            below = model.at(best + part * (worse - best), problem.p).cost < cost + size * abs(cost)
            low, high = (part, high) if below else (low, part)
        x = best + high * (worse - best)
        at = model.at(x, problem.p)
        if at.violation <= FEASIBILITY_TOLERANCE and abs(at.cost - cost - size * abs(cost)) < 0.1 * size * abs(cost):
            break
    return make_file(problem, x, size / 100)


def make_file(problem: GaitProblem, x: Array, tolerance: float) -> CertificateFile:
    """Return the certificate of a proof that was never made."""
    sign, cost = problem.objective.sign, build_exact_model(problem).at(x, problem.p).cost
    proof = Certificate(
        objective=sign * cost,
        bound=sign * (cost - tolerance * abs(cost)),
        tolerance=tolerance,
        closed=True,
        boxes=100_000,
        left=0,
        time_s=60.0,
        cpu_s=60.0,
        x=tuple(x.tolist()),
    )
    return make_certificate_file(problem, proof)


def forge_local_optimum() -> CertificateFile:
    """Return the false certificate of a local optimum."""
    problem = load("walk12").with_values(**{"lambda": 1.0})
    found = [nlp_gait.solve(problem, starts=1, seed=seed, workers=1) for seed in range(LOCAL_STARTS)]
    best = max(each.objective for each in found if each.feasible)
    local = [each for each in found if each.feasible and 1e-5 < 1.0 - each.objective / best < 1e-4]
    return make_file(problem, problem.check_x(local[0].x), TOLERANCE)


def is_refused(file: CertificateFile, seed: int, starts: int = STARTS, ship: bool = True) -> bool:
    """Return whether a check refuses a certificate."""
    with nullcontext() if ship else mock.patch.object(certificates, "find_certificate", lambda problem: None):
        try:
            check_certificate(file, paths=PATHS, starts=starts, seed=seed)
        except InputError:
            return True
    return False


CHECKS: dict[str, Callable[[CertificateFile, int], bool]] = {
    "all": is_refused,
    "no shipped certificate": lambda file, seed: is_refused(file, seed, ship=False),
    "paths only": lambda file, seed: is_refused(file, seed, starts=0, ship=False),
}


def main() -> None:
    """Write the table."""
    out, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else COUNT
    lines = [f"| problem | size | {' | '.join(CHECKS)} |", f"|---|---|{'---|' * len(CHECKS)}"]
    for name in sys.argv[3:] or NAMES:
        problem, best, rng = load(name), best_x(name), np.random.default_rng(SEED)
        started = time.perf_counter()
        for size in SIZES:
            files = [forge(problem, best, size, rng) for _ in range(count)]
            refused = [sum(one(file, seed) for seed, file in enumerate(files)) for one in CHECKS.values()]
            lines.append(f"| `{name}` | {size:g} | {' | '.join(f'{r} of {count}' for r in refused)} |")
            print(lines[-1], f"{time.perf_counter() - started:.0f} s", flush=True)
    file = forge_local_optimum()
    refused = [sum(one(file, seed) for seed in range(count)) for one in CHECKS.values()]
    lines.append(
        f"| `walk12`, lambda = 1, a local optimum | 3.4e-5 | {' | '.join(f'{r} of {count}' for r in refused)} |"
    )
    print(lines[-1], flush=True)
    write_text(out, "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
