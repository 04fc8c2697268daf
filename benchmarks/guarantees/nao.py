"""Proofs of NAO's phases: a certificate for an instance of GaitBench, or the bound that was reached.

``python -m benchmarks.guarantees.nao OUT TOLERANCE [--instance ID ...] [--hours HOURS] [--part PART]`` writes them, by default
for all instances with a least-power form. Existing certificates are skipped; a killed proof continues. If the time is not enough,
the open part stays in OUT and its bound is printed. With a part, the bounds of the variables are this part of their ranges around
the best known gait.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import nlp_gait
from nlp_gait.files import write_json
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.definitions import get_definition, names
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.proofs.bounds import has_power_form
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.proofs.certificate import make_certificate_file
from tests.proofs.soundness import narrow_around

REPORT_S = 30.0


def instance_problem(id: str) -> tuple[GaitProblem, Array]:
    """Return the problem of an instance, with its fixed variables in equal bounds, and its best known x."""
    definition = get_definition(id)
    problem = nlp_gait.load(definition.problem, **definition.options).with_values(**definition.values)
    free = iter(load_facts()[id].best_x)
    x = np.array([definition.held[name] if name in definition.held else next(free) for name in problem.names])
    return problem.fix(**definition.held), x


def prove(out: Path, id: str, tolerance: float, hours: float, part: float | None) -> None:
    """Write the certificate of an instance, or print the bound so far."""
    stem = f"{id}-{100 * tolerance:g}-percent" + (f"-around-{part:.3g}" if part else "")
    if (out / f"{stem}.json").exists():
        print(f"{stem} exists")
        return
    problem, x = instance_problem(id)
    problem, reported = problem if part is None else narrow_around(problem, x, part), time.perf_counter()

    def progress(note: str) -> None:
        nonlocal reported
        if time.perf_counter() - reported > REPORT_S:
            reported = time.perf_counter()
            print(note, flush=True)

    checkpoint = out / f".{stem}.open.npz"
    found = certify(
        problem, x, tolerance=tolerance, time_limit_s=3600.0 * hours, progress=progress, checkpoint=checkpoint
    )
    if found.closed:
        write_json(out / f"{stem}.json", make_certificate_file(problem, found).to_json())
        checkpoint.unlink()
    print(
        f"{stem}: f {found.objective:.7g}, proven {found.bound:.7g}, {found.boxes:,} boxes, {found.left:,} left, "
        f"{found.cpu_s:.1f} s of CPU, {found.time_s:.1f} s",
        flush=True,
    )


def main() -> None:
    """Prove one after the other."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.guarantees.nao", description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("tolerance", type=float)
    parser.add_argument("--instance", action="append", help="only this one; repeatable")
    parser.add_argument("--hours", type=float, default=24.0, help="for each")
    parser.add_argument("--part", type=float, help="of every range, around the best known gait")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for id in arguments.instance or [id for id in names() if has_power_form(instance_problem(id)[0])]:
        prove(arguments.out, id, arguments.tolerance, arguments.hours, arguments.part)


if __name__ == "__main__":
    main()
