"""Certificates of GaitBench's instances with a proof, and of the 12-joint walk for each lambda of Table III.

``python -m benchmarks.guarantees.certificates OUT [NAME ...] [--tolerance TOLERANCE] [--hours HOURS] [--part PART]`` proves one
after the other, by default all that OUT lacks, and writes them as NAME.json, where NAME is that of an instance or
``walk12-lambda-LAMBDA``. A killed proof continues. If the time is not enough, the open part stays in OUT and its bound is
printed. With a part, the bounds of the variables are this part of their ranges around the best known gait. After certificates
in ``nlp_gait/proofs/certificates`` have changed, ``python -m benchmarks.best_known`` writes their bounds to the shipped values.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

import nlp_gait
from compare.papers.walk12.walk12_paper import TABLE_3
from compare.questions.certainty import MOST_VARIABLES
from nlp_gait.files import write_json
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.facts import get_definition, list_instances, load_facts
from nlp_gait.proofs.bounds import has_power_form
from nlp_gait.proofs.branch_and_bound import TOLERANCE, certify
from nlp_gait.proofs.certificate import load_certificates, make_certificate_file
from tests.proofs.soundness import narrow_around

REPORT_S = 30.0
STARTS = 20  # of IPOPT, for the incumbents of the walk
WALK = "walk12-lambda-"


def make_instance(id: str) -> tuple[GaitProblem, Array]:
    """Return the problem of an instance in a form that can be enclosed, and its best known x.

    Fixed variables have equal bounds. Two steps of half a second have twice the Q of one, so that one step with twice the
    ``f1max`` has the same objective; the number of steps is a jump, of which an enclosure of 1 / T contains both sides.
    """
    definition = get_definition(id)
    problem = nlp_gait.load(definition.problem, **definition.options).with_values(**definition.values)
    if definition.options.get("horizon") == "1s":
        steps = round(1.0 / problem.value("step_time_s"))
        problem = nlp_gait.load(definition.problem, **{**definition.options, "horizon": "step"})
        problem = problem.with_values(**definition.values, f1max=steps * problem.value("f1max"))
    free = iter(load_facts()[id].best_x)
    x = np.array([definition.held[name] if name in definition.held else next(free) for name in problem.names])
    return problem.fix(**definition.held), x


def make_problem(name: str) -> tuple[GaitProblem, Array]:
    """Return the problem of a certificate and its best known x."""
    if not name.startswith(WALK):
        return make_instance(name)
    problem = nlp_gait.load("walk12").with_values(**{"lambda": float(name.removeprefix(WALK))})
    best = nlp_gait.solve(problem, starts=STARTS)
    return problem, np.array(list(best.x.values()))


def list_covered() -> list[str]:
    """Return the names of all certificates."""
    instances = [id for id in list_instances() if is_covered(make_instance(id)[0])]
    return [*(f"{WALK}{row.weight:g}" for row in TABLE_3), *instances]


def is_covered(problem: GaitProblem) -> bool:
    """Return whether a problem can be proven."""
    return has_power_form(problem) or len(problem.names) <= MOST_VARIABLES


def prove(out: Path, name: str, tolerance: float, hours: float, part: float | None) -> None:
    """Write a certificate, or print the bound so far."""
    stem = name + (f"-around-{part:.3g}" if part else "")
    if (out / f"{stem}.json").exists():
        print(f"{stem} exists")
        return
    problem, x = make_problem(name)
    problem, reported = problem if part is None else narrow_around(problem, x, part), 0.0

    def progress(note: str) -> None:
        nonlocal reported
        if time.perf_counter() - reported > REPORT_S:
            reported = time.perf_counter()
            print(f"{stem}: {note}", flush=True)

    checkpoint = out / f".{stem}.open"
    found = certify(
        problem, x, tolerance=tolerance, time_limit_s=3600.0 * hours, progress=progress, checkpoint=checkpoint
    )
    if found.closed:
        write_json(out / f"{stem}.json", asdict(make_certificate_file(problem, found)))
        checkpoint.unlink()
    print(
        f"{stem}: objective {found.objective:.9g}, proven {found.bound:.9g}, {found.boxes:,} boxes, {found.left:,} left, "
        f"{found.cpu_s:.1f} s of CPU, {found.time_s:.1f} s",
        flush=True,
    )


def format_table() -> str:
    """Return the shipped certificates as a table in Markdown."""
    lines = ["| certificate | best known | proven bound | gap | boxes | s of one core |", "|---|--:|--:|--:|--:|--:|"]
    for name, file in load_certificates().items():
        proof = file.certificate
        values = f"{proof.objective:.7g} | {proof.bound:.7g} | {proof.gap:.1g} | {proof.boxes:,} | {proof.cpu_s:.0f}"
        lines.append(f"| `{name}` | {values} |")
    return "\n".join(lines)


def main() -> None:
    """Prove one after the other."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.guarantees.certificates", description=__doc__.splitlines()[0]
    )
    parser.add_argument("out", type=Path, nargs="?", help="none: print the shipped certificates as a table")
    parser.add_argument("name", nargs="*", help="only these")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE)
    parser.add_argument("--hours", type=float, default=24.0, help="for each")
    parser.add_argument("--part", type=float, help="of every range, around the best known gait")
    arguments = parser.parse_args()
    if arguments.out is None:
        print(format_table())
        return
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.name or list_covered():
        prove(arguments.out, name, arguments.tolerance, arguments.hours, arguments.part)


if __name__ == "__main__":
    main()
