"""Make the shipped certificates: GaitBench's instances with a proof, and the walk for each lambda of Table III.

``python -m benchmarks.certificates OUT [NAME ...]`` proves one after the other, by default all that OUT lacks,
and writes them as NAME.json, where NAME is that of an instance or ``walk12-lambda-LAMBDA``. A killed proof
continues. If the time is not enough, the open part stays in OUT and its bound is printed. After certificates in
``nlp_gait/proofs/certificates`` have changed, ``python -m benchmarks.best_known`` ships their bounds.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

import nlp_gait
from compare.papers.walk12.results import TABLE_3
from compare.questions.certainty import MOST_VARIABLES
from nlp_gait.files import write_json
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.facts import get_definition, list_instances, load_facts
from nlp_gait.proofs.bounds import has_power_form
from nlp_gait.proofs.branch_and_bound import TOLERANCE, certify
from nlp_gait.proofs.certificate import make_certificate_file

REPORT_S = 30.0
STARTS = 20  # of IPOPT, for the incumbents of the walk
WALK = "walk12-lambda-"


def make_problem(name: str) -> tuple[GaitProblem, Array]:
    """Return the problem of a certificate in a form that can be enclosed, and its best known x.

    Fixed variables have equal bounds. Two steps of half a second have twice the Q of one, so that one step with twice the
    ``f1max`` has the same objective; the number of steps is a jump, of which an enclosure of 1 / T contains both sides.
    """
    if name.startswith(WALK):
        problem = nlp_gait.load("walk12").with_values(**{"lambda": float(name.removeprefix(WALK))})
        return problem, np.array(list(nlp_gait.solve(problem, starts=STARTS).x.values()))
    definition = get_definition(name)
    problem = nlp_gait.load(definition.problem, **definition.options).with_values(**definition.values)
    if definition.options.get("horizon") == "1s":
        steps = round(1.0 / problem.value("step_time_s"))
        problem = nlp_gait.load(definition.problem, **{**definition.options, "horizon": "step"})
        problem = problem.with_values(**definition.values, f1max=steps * problem.value("f1max"))
    free = iter(load_facts()[name].best_x)
    x = np.array([definition.held[key] if key in definition.held else next(free) for key in problem.names])
    return problem.fix(**definition.held), x


def list_covered() -> list[str]:
    """Return the names of all certificates."""
    problems = {id: make_problem(id)[0] for id in list_instances()}
    covered = [id for id, p in problems.items() if has_power_form(p) or len(p.names) <= MOST_VARIABLES]
    return [*(f"{WALK}{row.weight:g}" for row in TABLE_3), *covered]


def prove(out: Path, name: str, tolerance: float, hours: float) -> None:
    """Write a certificate, or print the bound so far."""
    if (out / f"{name}.json").exists():
        print(f"{name} exists")
        return
    problem, x = make_problem(name)
    reported = 0.0

    def progress(note: str) -> None:
        nonlocal reported
        if time.perf_counter() - reported > REPORT_S:
            reported = time.perf_counter()
            print(f"{name}: {note}", flush=True)

    checkpoint, limit_s = out / f".{name}.open", 3600.0 * hours
    found = certify(problem, x, tolerance=tolerance, time_limit_s=limit_s, progress=progress, checkpoint=checkpoint)
    if found.closed:
        write_json(out / f"{name}.json", asdict(make_certificate_file(problem, found)))
        checkpoint.unlink()
    print(
        f"{name}: objective {found.objective:.9g}, proven {found.bound:.9g}, {found.boxes:,} boxes, {found.left:,} left, "
        f"{found.cpu_s:.1f} s of CPU, {found.time_s:.1f} s",
        flush=True,
    )


def main() -> None:
    """Prove one after the other."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.certificates", description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("name", nargs="*", help="only these")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE)
    parser.add_argument("--hours", type=float, default=24.0, help="for each")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.name or list_covered():
        prove(arguments.out, name, arguments.tolerance, arguments.hours)


if __name__ == "__main__":
    main()
