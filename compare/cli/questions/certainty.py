"""``nlp-gait certainty``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.cli.common import (
    AsJson,
    Derivatives,
    Fix,
    Intervals,
    Options,
    ProblemName,
    Robot,
    Seed,
    Set,
    command,
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    quantity,
    stdout,
)
from compare.cli.resumable import resumable
from nlp_gait.files import without_nan, write_json

if TYPE_CHECKING:
    from compare.questions.certainty.study import Certainty

SHOWN = 10


@command
def certainty(
    problem: ProblemName,
    starts: Annotated[int, typer.Option(min=1, help="Random starts of IPOPT.")] = 10_000,
    evaluations: Annotated[int, typer.Option(min=0, help="Of one long CMA-ES with restarts; 0 for none.")] = 1_000_000,
    tolerance: Annotated[float, typer.Option(help="Of the certificate, relative to the objective.")] = 0.01,
    time_limit: Annotated[
        float, typer.Option(min=0.0, help="Of the certificate [s], for at most four variables; 0 for none.")
    ] = 600.0,
    seed: Seed = 0,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[Path, typer.Option(help="Folder; finished batches in it are kept.")] = Path("certainty"),
    as_json: AsJson = False,
) -> None:
    """Evidence that the best optimum is the global one: many starts, a long search, and a proof for few variables.

    Examples: `nlp-gait certainty walk12 --set lambda=1`, `nlp-gait certainty nao-ssp --starts 1000 --evaluations 0`
    """
    from compare.questions.certainty.report import write_certainty
    from compare.questions.certainty.study import certainty as study_certainty
    from nlp_gait.files import writable_folder

    folder = writable_folder(out)
    loaded = problem_spec(problem, robot, intervals, derivatives, option, values, fix).load()
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
    target = folder / f"{problem}-certainty.json"
    write_json(target, without_nan(study.to_json()))
    if as_json:
        print_json({**study.to_json(), "files": [str(path) for path in (*written, target)]})
        return
    _print(study)
    for path in (*written, target):
        stdout.print(f"wrote {path}", soft_wrap=True)


def _print(study: Certainty) -> None:
    objective = study.problem.objective
    print_table(
        f"{study.problem.name}: distinct optima of {study.starts:,} starts, {min(SHOWN, len(study.optima))} shown",
        (objective.name, "starts", "share"),
        [
            (quantity(o.objective, objective.unit), f"{o.count:,}", f"{100 * o.share:.2f} %")
            for o in study.optima[:SHOWN]
        ],
    )
    print_table("How the starts ended", ("status", "starts"), [(k, f"{n:,}") for k, n in study.statuses.items()])
    estimate = study.unseen
    expected = "-" if estimate.expected_optima is None else f"{estimate.expected_optima:.4g}"
    covered = "-" if estimate.expected_covered is None else f"{100 * estimate.expected_covered:.4g} %"
    print_table(
        "Optima that no start reached: estimates, no proof",
        ("estimate", "value"),
        [
            ("share of starts in unseen optima (Good, Turing)", f"{100 * estimate.good_turing:.3g} %"),
            ("expected number of all optima (Boender, Rinnooy Kan)", expected),
            ("expected share of starts in seen optima (the same)", covered),
            ("largest share of one unseen optimum, 95 % confidence", f"{100 * estimate.largest_missed:.3g} %"),
        ],
    )
    stdout.print(f"Proven: {study.proven}.", soft_wrap=True)
    stdout.print(f"Supported: {study.supported}.", soft_wrap=True)
