"""``nlp-gait certainty``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_json, stdout
from compare.cli.options import AnyProblem, AsJson, Code, Seed, name_all
from compare.cli.questions.output import Folder, Output
from nlp_gait.errors import InputError


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
        Path | None, typer.Option(help="Certificate to check instead: random paths of its proof are repeated.")
    ] = None,
    paths: Annotated[int, typer.Option(min=1, max=100_000, help="Paths of a proof to check.")] = 200,
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
        _check(check, paths, seed, as_json)
        return
    from compare.questions.certainty import Certainty

    limits = {"tolerance": tolerance, "time_limit_s": time_limit}
    question = Certainty(problem=problem.spec().load(), starts=starts, evaluations=evaluations, **limits, seed=seed)
    Output(out=out, as_json=as_json).answer(question)


def _check(path: Path, paths: int, seed: int, as_json: bool) -> None:
    from nlp_gait.proofs.certificate import check_certificate, read_certificate

    file = read_certificate(path)
    found = check_certificate(file, paths=paths, seed=seed)
    proof = file.certificate
    if as_json:
        print_json({"schema": 1, **asdict(found)})
        return
    stdout.print(
        f"{file.problem['name']}: bound {proof.bound:.8g}, incumbent {proof.objective:.8g}; {found.paths} random paths of up to "
        f"{found.deepest} halvings end, {found.pieces:,} boxes dropped on them are proven to contain nothing better; they "
        f"suggest {found.boxes:,.0f} boxes in total, the certificate has {proof.boxes:,}"
        + ("" if found.same_code else "; it was made by another version of the code"),
        soft_wrap=True,
    )
