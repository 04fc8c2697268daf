"""Collect the best known value of every problem and instance: ``python -m benchmarks.best_known``.

Sources are the facts of GaitBench, ``docs/difficulty.json``, the shipped certificates and the files ``better-*.json`` given as
arguments. Every point is evaluated again; of equal problems the best point is kept. The result is
``compare/study/best_known.json``, with the proven bounds of the certificates: run it again after a certificate has changed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import compare.study
from nlp_gait import gaitbench
from nlp_gait.backends.exact import build_exact_model, describe_difference, identify_problem
from nlp_gait.decoding import decode
from nlp_gait.files import read_json, write_json
from nlp_gait.formulation import GaitProblem, load
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, StoredProblem, load_result
from nlp_gait.proofs.certificate import find_certificate, load_certificates

FILE = Path(str(compare.study.__file__)).with_name("best_known.json")
DIFFICULTY = Path(__file__).parents[1] / "docs" / "difficulty.json"
# A point with a violation below the tolerance may be better than the optimum by about this, relatively.
ALIKE = 1e-6


class Found(NamedTuple):
    """A point and who found it."""

    problem: GaitProblem
    x: Sequence[float]
    found_by: str
    proven_as: str = ""  # name of a certificate in another form; "" for the problem's own


def from_gaitbench() -> Iterator[Found]:
    """Yield the instances; their points have no violation at all, so they come first."""
    for id in gaitbench.list_instances():
        instance = gaitbench.load(id)
        evidence, runs = instance.evidence, instance.evidence.cma_runs
        found_by = f"{evidence.starts} start{'s' * (evidence.starts > 1)} of IPOPT"
        yield Found(
            instance.gait_problem,
            instance.best_x.tolist(),
            found_by + f" and {runs} long runs of CMA-ES" * (runs > 0),
            id if id in load_certificates() else "",
        )


def from_difficulty() -> Iterator[Found]:
    """Yield the problems with their defaults."""
    for name, found in read_json(DIFFICULTY, "difficulty").items():
        runs = [f"{solver['runs']} runs of {title}" for title, solver in found["solvers"].items()]
        yield Found(load(name), list(found["best"]["x"].values()), ", ".join(runs))


def from_files() -> Iterator[Found]:
    """Yield the contributed points, see ``compare.analysis.better_points``."""
    for path in sys.argv[1:]:
        result, found_by = load_result(Path(path)), read_json(Path(path), "result")["found_by"]
        yield Found(result.problem, result.x.tolist(), f"{found_by['solver']}, seed {found_by['seed']}")


def from_certificates() -> Iterator[Found]:
    """Yield the points of the proven problems."""
    for file in load_certificates().values():
        stored = decode(StoredProblem, file.problem)
        problem = load(stored.name, **stored.options).with_values(**stored.parameters)
        yield Found(problem, file.certificate.x, "the starts of its certificate")


def main() -> None:
    """Write the file."""
    entries: dict[str, dict[str, Any]] = {}  # by description; equal problems of different names share their values
    for problem, x, found_by, proven_as in (*from_gaitbench(), *from_difficulty(), *from_files(), *from_certificates()):
        if len(x) != len(problem.names):
            print(f"{problem.load_name}: the point has {len(x)} values instead of {len(problem.names)}")
            continue
        values = build_exact_model(problem).at(np.array(x), problem.p)
        if not values.violation <= FEASIBILITY_TOLERANCE:
            print(f"{problem.load_name}: the point found by {found_by} is infeasible by {values.violation:.3g}")
            continue
        problem_part, cost = identify_problem(problem), values.cost
        equal = (entry for entry in entries.values() if not describe_difference(entry["problem"], problem_part))
        before = next(equal, None)
        if before is None or cost < problem.objective.sign * before["objective"] - ALIKE * abs(before["objective"]):
            name = proven_as or next(
                (n for n, f in load_certificates().items() if f is find_certificate(problem_part)), ""
            )
            bound = load_certificates()[name].certificate.bound if name else None
            best = {"objective": problem.objective.sign * cost, "x": list(x), "found_by": found_by}
            best |= {"bound": bound, "proven_as": name}
            print(
                f"{problem.load_name} {dict(problem.values)}: {best['objective']:.9g}, was {before and before['objective']}"
            )
            for entry in entries.values():
                if not describe_difference(entry["problem"], problem_part):
                    entry |= best
        else:
            best = {key: value for key, value in before.items() if key != "problem"}
        entries.setdefault(json.dumps(problem_part, sort_keys=True), {"problem": problem_part, **best})
    write_json(FILE, list(entries.values()))


if __name__ == "__main__":
    main()
