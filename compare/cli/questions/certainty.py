"""``nlp-gait certainty``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import with_unit
from compare.cli.command import command
from compare.cli.common import print_result, print_rows, print_table, progress_bar, stdout
from compare.cli.interrupts import resumable
from compare.cli.options import AsJson, NamedProblem, Seed
from nlp_gait.files import without_nan, writable_folder, write_json

if TYPE_CHECKING:
    from compare.questions.certainty.study import Certainty

SHOWN = 10


@command
def certainty(
    *,
    starts: Annotated[int, typer.Option(min=1, help="Random starts of IPOPT.")] = 10_000,
    evaluations: Annotated[
        int, typer.Option(min=0, help="Budget of one long CMA-ES with restarts; 0 for none.")
    ] = 1_000_000,
    tolerance: Annotated[float, typer.Option(help="Relative gap at which the proof may end.")] = 0.01,
    time_limit: Annotated[
        float, typer.Option(min=0.0, help="Of the proof [s], for at most four variables; 0 for none.")
    ] = 600.0,
    seed: Seed = 0,
    problem: NamedProblem,
    out: Annotated[Path, typer.Option(help="Folder; finished batches in it are kept.")] = Path("certainty"),
    as_json: AsJson = False,
) -> None:
    """Evidence that the best optimum is the global one: many starts, a long search, and a proof for few variables.

    Examples: `nlp-gait certainty walk12 --set lambda=1`, `nlp-gait certainty nao-ssp --starts 1000 --evaluations 0`
    """
    from compare.questions.certainty.report import write_certainty
    from compare.questions.certainty.study import certainty as study_certainty

    folder = writable_folder(out)
    loaded = problem.spec().load()
    with resumable(folder), progress_bar("starts, search, proof", None) as advance:
        study = study_certainty(
            loaded,
            folder,
            starts=starts,
            evaluations=evaluations,
            tolerance=tolerance,
            time_limit_s=time_limit,
            seed=seed,
            progress=lambda count, note: advance(note),
        )
    written = write_certainty(folder, study)
    target = folder / f"{problem.name}-certainty.json"
    write_json(target, without_nan(study.to_json()))
    print_result(as_json, study.to_json(), [*written, target], lambda: _print(study))


def _print(study: Certainty) -> None:
    objective = study.problem.objective
    print_rows(
        f"{study.problem.name}: distinct optima of {study.starts:,} starts, {min(SHOWN, len(study.optima))} shown",
        study.optima[:SHOWN],
        {
            objective.name: lambda optimum: with_unit(optimum.objective, objective.unit),
            "starts": lambda optimum: f"{optimum.count:,}",
            "share": lambda optimum: f"{100 * optimum.share:.2f} %",
        },
    )
    print_table("How the starts ended", ("status", "starts"), [(k, f"{n:,}") for k, n in study.statuses.items()])
    estimate = study.unseen
    covered = None if estimate.expected_covered is None else 100 * estimate.expected_covered
    print_table(
        "Optima that no start reached: estimates, no proof",
        ("estimate", "value"),
        [
            ("share of starts in unseen optima (Good, Turing)", f"{100 * estimate.good_turing:.3g} %"),
            ("expected number of all optima (Boender, Rinnooy Kan)", with_unit(estimate.expected_optima, "1", ".4g")),
            ("expected share of starts in seen optima (the same)", with_unit(covered, "%", ".4g")),
            ("largest share of one unseen optimum, 95 % confidence", f"{100 * estimate.largest_missed:.3g} %"),
        ],
    )
    stdout.print(f"Proven: {study.proven}.", soft_wrap=True)
    stdout.print(f"Supported: {study.supported}.", soft_wrap=True)
