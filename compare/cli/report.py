"""``nlp-gait report`` and ``nlp-gait reproduce``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compare.analysis.comparison import compare_problems, label_editions
from compare.analysis.record_statistics import Weighting
from compare.analysis.solver_table import describe_unknown
from compare.cli.command import OUTPUT, command
from compare.cli.endings import end_if_excluded, report_interrupts
from compare.cli.options import AsCsv, AsJson, Code, Scheduler, name_all, parse_number
from compare.cli.printing import describe_command, print_result, print_table, print_written, say, show_progress, stdout
from compare.logs import write_ioh
from compare.papers import REPRODUCTIONS, load_reproduction
from compare.study.evidence import read_evidence
from compare.study.record import RunRecord
from compare.study.settings import read_manifest
from nlp_gait.decoding import read_dataclass
from nlp_gait.errors import InputError

if TYPE_CHECKING:
    from compare.study.simulations import SimulatedGait


ENGINE_TABLE = (
    "Model and engine: mean power over a phase, or energy of ten steps per planned metre of a cycle; ranks of model and "
    "engine; fate: a cycle walks that share of the planned distance."
)


@command
def report(
    *,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study: the --out of `compare`.")],
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="GRADIENT,HESSIAN",
            help="Evaluations counted for a first derivative and a Hessian (default: n + 1, (n + 1)(n + 2)/2).",
        ),
    ] = None,
    engine: Annotated[
        bool, typer.Option("--engine", help="Simulate every solver's best gait in MuJoCo (extra sim), unless stored.")
    ] = False,
    latex: Annotated[
        bool, typer.Option("--latex", help="Also write a table of each problem for papers (LaTeX, package booktabs).")
    ] = False,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Also write figures for papers, one column wide, and their captions in LaTeX.")
    ] = False,
    logs: Annotated[
        bool, typer.Option("--logs", help="Also write the runs as logs for iohinspector, into the folder logs.")
    ] = False,
    code: Code = None,
    as_csv: AsCsv = False,
    as_json: AsJson = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Rewrite the report while the study runs; the open page reloads itself.")
    ] = False,
) -> None:
    """Rewrite a study's report from all records of its folder, without running a solver.

    It includes solvers that a later call omitted; runs of earlier definitions have names that say how they differ. Every point is
    evaluated again. Records whose numbers do not follow from it, or that contradict a proof, are excluded; then the exit status
    is 1.

    With `--engine` the best gaits are simulated and stored, and the report says whether the engine confirms the model. With
    `--watch` the report follows a running study until Ctrl-C.

    Examples: `nlp-gait report results`, `nlp-gait report results --weights 5,25`,
    `nlp-gait report results --engine`
    """
    from compare.report import FurtherFiles, rebuild_report, watch_report, write_report

    weighting = _parse_weights(weights)
    name_all(code)
    if watch:
        say(f"open {folder / 'report.html'}; it follows the study in {folder} until Ctrl-C")
        watch_report(folder, lambda: rebuild_report(folder, weighting))
    evidence, manifest = read_evidence(folder), read_manifest(folder)
    records = label_editions(evidence.records)
    simulated = simulate_best(folder, records) if engine else []
    further = FurtherFiles(csv=as_csv, latex=latex, pdf=pdf)
    written = write_report(folder, records, manifest, weighting, excluded=evidence.excluded, further=further)
    if logs:
        comparisons = compare_problems(records)
        for sentence in (s for comparison in comparisons for s in describe_unknown(comparison)):
            say(f"not in the logs: {sentence}")
        write_ioh(comparisons, folder / "logs")
        written.append(folder / "logs")
    data = {**encode_simulations(simulated), "excluded": evidence.sentences}
    print_result(as_json, data, written, lambda: print_simulations(simulated))
    end_if_excluded(evidence.sentences)


def _parse_weights(text: str | None) -> Weighting:
    if text is None:
        return Weighting()
    values = [parse_number("a weight", part, "--weights") for part in text.split(",")]
    if len(values) != 2 or not all(math.isfinite(value) and value >= 0.0 for value in values):
        raise InputError(f"--weights takes two finite numbers >= 0, GRADIENT,HESSIAN, got {text!r}")
    return Weighting(gradient=values[0], jacobian=values[0], hessian=values[1])


@command
def reproduce(
    paper: Annotated[str, typer.Argument(metavar="PAPER", help=", ".join(REPRODUCTIONS))],
    out: Annotated[
        Path,
        typer.Option(help="Folder for the report, its tables and figures; results stored in it are used again."),
        OUTPUT,
    ],
    quick: Annotated[
        bool, typer.Option("--quick", help="The least work that fills every table and figure, instead of the paper's.")
    ] = False,
    effort: Annotated[
        Path | None,
        typer.Option(help="JSON file with other settings, as `settings` of `summary.json`; the rest are the paper's."),
    ] = None,
    scheduler: Scheduler = None,
) -> None:
    """Recompute a paper's tables and figures next to the printed ones, and check its claims.

    `claims.csv` has every claim with its verdict, `differences.csv` everything that is not as printed with its effect.

    Examples: `nlp-gait reproduce nao --out reproduction`, `nlp-gait reproduce walk12 --quick --out quick`,
    `nlp-gait reproduce stairs --effort effort.json --out reduced`
    """
    if quick and effort:
        raise InputError("--quick and --effort exclude each other: omit one")
    reproduction = load_reproduction(paper)
    chosen = reproduction.quick if quick else reproduction.full
    if effort:
        chosen = read_dataclass(type(reproduction.full), effort, "effort", error=InputError)
    with report_interrupts(folder=out), show_progress(paper, chosen.steps) as advance:
        reproduction.reproduce(out, chosen, advance, command=describe_command(), on_outdated=say, scheduler=scheduler)
    print_written(out / "report.md")


def simulate_best(folder: Path, records: Sequence[RunRecord]) -> list[SimulatedGait]:
    """Simulate every solver's best gait, unless stored; raises InputError if none of the problems can be simulated."""
    from compare.analysis.simulated_gaits import select_best_gaits
    from compare.study.simulations import simulate_records
    from nlp_gait.simulation.drive import Drive

    gaits = select_best_gaits(compare_problems(records))
    remedy = f"continue with `nlp-gait report --engine {folder}`"
    with (
        report_interrupts(f"interrupted while simulating; finished simulations are stored; {remedy}"),
        show_progress("gaits", len(gaits)) as advance,
    ):
        simulated = simulate_records(folder, gaits, Drive(), advance)
    if gaits and not simulated:
        names = ", ".join(dict.fromkeys(record.problem for record in gaits))
        raise InputError(f"no gait of {names} can be simulated in the engine; omit --engine")
    return simulated


def encode_simulations(simulated: Sequence[SimulatedGait]) -> dict[str, Any]:
    """Return simulated gaits by problem, and their agreement with the model, as plain data; empty without any."""
    from compare.analysis.simulated_gaits import group_by_problem, measure_agreement

    found = {
        problem: {"gaits": [asdict(gait) for gait in own], "agreement": asdict(measure_agreement(own))}
        for problem, own in group_by_problem(simulated).items()
    }
    return {"engine": found} if found else {}


def print_simulations(simulated: Sequence[SimulatedGait]) -> None:
    """Print a table per problem, and the agreement of engine and model."""
    from compare.analysis import simulated_gaits

    for problem, own in simulated_gaits.group_by_problem(simulated).items():
        title = f"{problem} simulated: {simulated_gaits.describe_drive(own[0].drive)}"
        print_table(title, simulated_gaits.GAIT_HEADER, simulated_gaits.make_engine_rows(own))
        stdout.print(simulated_gaits.measure_agreement(own).describe())
    if simulated:
        stdout.print(ENGINE_TABLE)
