"""``nlp-gait certainty``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_json, progress_bar, stdout
from compare.cli.options import AnyProblem, AsJson, Code, Seed, name_all
from compare.cli.questions.output import Folder, Output
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder


@command
def certainty(
    *,
    starts: Annotated[int, typer.Option(min=1, max=1_000_000, help="Random starts of IPOPT.")] = 10_000,
    evaluations: Annotated[
        int, typer.Option(min=0, max=10**12, help="Budget of one long CMA-ES with restarts; 0 for none.")
    ] = 1_000_000,
    tolerance: Annotated[float, typer.Option(help="Relative gap at which the proof may end.")] = 1e-6,
    time_limit: Annotated[
        float, typer.Option(min=0.0, help="Of the proof [s], for at most four variables and NAO's phases; 0 for none.")
    ] = 1800.0,
    seed: Seed = 0,
    problem: AnyProblem,
    check: Annotated[
        Path | None,
        typer.Option(help="Certificate to check instead: look for a better point, then repeat paths of its proof."),
    ] = None,
    paths: Annotated[int, typer.Option(min=1, max=100_000, help="Paths of a proof to check.")] = 200,
    complete: Annotated[
        bool, typer.Option("--complete", help="With --check: also repeat the whole proof; rerun to continue.")
    ] = False,
    code: Code = None,
    out: Folder = Path("certainty"),
    as_json: AsJson = False,
) -> None:
    """Gather evidence that the best optimum is the global one: many starts, a long search, and a proof for few variables.

    Examples: `nlp-gait certainty walk12 --set lambda=1`, `nlp-gait certainty nao-ssp --starts 1000 --evaluations 0`,
    `nlp-gait certainty --check certainty/walk12-certificate.json`
    """
    if check is not None:
        if problem != AnyProblem():
            raise InputError("--check takes the problem and its options from the certificate; leave them out")
        name_all(code)
        _check(check, paths, seed, out if complete else None, as_json)
        return
    if complete:
        raise InputError("--complete repeats the proof of a certificate; name its file by --check FILE")
    from compare.questions.certainty import Certainty

    limits = {"tolerance": tolerance, "time_limit_s": time_limit}
    question = Certainty(problem=problem.spec().load(), starts=starts, evaluations=evaluations, **limits, seed=seed)
    Output(out=out, as_json=as_json).answer(question)


def _check(path: Path, paths: int, seed: int, repeat_in: Path | None, as_json: bool) -> None:
    from compare.questions.certainty import search_point
    from nlp_gait.proofs.certificate import read_certificate
    from nlp_gait.proofs.check import check_certificate, load_problem, repeat_proof

    file = read_certificate(path)
    proof, points = file.certificate, {"a search": search_point(load_problem(file), seed)}
    found, repeated = check_certificate(file, points=points, paths=paths, seed=seed), None
    if repeat_in is not None:
        make_writable_folder(repeat_in)
        with progress_bar("boxes", None) as advance:
            repeated = repeat_proof(file, progress=advance, checkpoint=repeat_in / f".{path.stem}.open")
    if as_json:
        print_json({"schema": 1, **asdict(found), "repeated": None if repeated is None else asdict(repeated)})
        return
    stdout.print(
        f"{file.problem['name']}: bound {proof.bound:.9g}, incumbent {proof.objective:.9g}. No better point was found; the best "
        f"one is of {found.source}, {found.best:.9g}. {found.paths} paths of up to {found.deepest} halvings end; "
        f"{found.pieces:,} boxes dropped on them are proven to contain nothing better; they suggest about {found.boxes:,.0f} "
        f"boxes in total (within a factor of ten), the certificate has {proof.boxes:,}"
        + ("" if found.same_code else "; it was made by another version of the code"),
        soft_wrap=True,
    )
    if repeated is not None:
        stdout.print(
            f"The whole proof was repeated: {repeated.boxes:,} boxes, {repeated.cpu_s:.0f} s of the processor; no feasible "
            f"point is better than {repeated.bound:.9g}",
            soft_wrap=True,
        )
