"""``nlp-gait report`` and ``nlp-gait reproduce``."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from compare.cli.command import OUTPUT, Output, command, describe_command, describe_stored, say, show_progress
from compare.cli.options import Code, Scheduler, name_all
from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.paper_runs import Runner
from compare.report import FurtherFiles, renew_report
from nlp_gait.decoding import read_dataclass
from nlp_gait.errors import InputError


@command
def report(
    *,
    folder: Annotated[Path, Argument(metavar="DIR")],
    latex: Annotated[bool, Option("--latex")] = False,
    figures: Annotated[bool, Option("--figures")] = False,
    code: Code = None,
    csv: Annotated[bool, Option("--csv")] = False,
) -> Output:
    """Rewrite a study's report from all records of its folder, without running a solver.

    It has the runs that `study.json` lists: of each problem and solver those of the latest command that ran it. Damaged records
    are left out and named; then the exit status is 1. `nlp-gait verify` computes a study again.

    Examples: `nlp-gait report results`, `nlp-gait report results --latex --figures`
    """
    name_all(code)
    further = FurtherFiles(csv=csv, latex=latex, figures=figures)
    _, damaged, written = renew_report(folder, further)
    return Output(data={"damaged": damaged}, written=written, failures=damaged)


@command
def reproduce(
    paper: Annotated[str, Argument(metavar="PAPER", help=f"{', '.join(REPRODUCTIONS)}, or FILE.py of your own")],
    out: Annotated[Path, OUTPUT],
    quick: Annotated[bool, Option("--quick")] = False,
    effort: Path | None = None,
    scheduler: Scheduler = None,
) -> Output:
    """Recompute a paper's tables and figures next to the printed ones, and check its claims.

    `claims.csv` has every claim with its verdict, `differences.csv` what is not as printed, with its effect. A paper of your own
    is a module and a table of claims, see `examples/your_own_paper.py`.

    Examples: `nlp-gait reproduce nao --out reproduction`, `nlp-gait reproduce walk12 --quick --out quick`,
    `nlp-gait reproduce stairs --effort effort.json --out reduced`
    """
    if quick and effort:
        raise InputError("--quick and --effort exclude each other: omit one")
    reproduction = load_reproduction(paper)
    chosen = reproduction.quick if quick else reproduction.full
    if effort:
        chosen = read_dataclass(type(reproduction.full), effort, "effort", error=InputError)
    try:
        with show_progress(paper, None) as advance:
            runner = Runner(folder=out, progress=advance, scheduler=scheduler)
            record = reproduction.reproduce(runner, chosen, describe_command())
    except KeyboardInterrupt:
        return Output(data={}, interrupted=f"interrupted; {describe_stored(out)}")
    for sentence in record["sentences"]:
        say(sentence.replace("**", ""))
    return Output(data={"paper": paper, "sentences": record["sentences"]}, written=[out / "report.html"])
