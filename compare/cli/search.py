"""``nlp-gait search``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compare.analysis.units import with_unit
from compare.cli.command import command
from compare.cli.common import (
    end_interrupted,
    fail,
    print_json,
    print_rows,
    progress_bar,
    say,
    stdout,
    until_interrupted,
)
from compare.cli.compare import print_summaries
from compare.cli.options import AsJson, Jobs, NamedProblem, SearchOptions
from compare.study.settings import SolverSpec

if TYPE_CHECKING:
    from compare.study.record import RunRecord


@command
def search(
    *,
    algorithm: Annotated[
        str,
        typer.Option(help="pso, ga, aco, aco-grid, cma, de, pymoo:GA, ...; or your own, FILE.py:NAME or cmd:COMMAND."),
    ] = "pso",
    searches: SearchOptions,
    problem: NamedProblem,
    out: Annotated[
        Path | None, typer.Option(help="Store one record file per run in this folder; continue from it.")
    ] = None,
    jobs: Jobs = 1,
    as_json: AsJson = False,
) -> None:
    """Search a problem with a metaheuristic and the compiled exact functions.

    Failed runs are listed with the reason; exit status 1 if all runs fail.

    Examples: `nlp-gait search nao-ssp --algorithm pso --runs 11 --seed 0 --evaluations 10000`,
    `nlp-gait search nao-ssp --algorithm ga --handling penalty --penalty-weight 1 --polish`
    """
    from compare.study.run_study import Study, run_study
    from nlp_gait.backends.kernel.compiled import available_cores

    spec = problem.spec()
    solver = SolverSpec(name=algorithm, runs=searches.runs, polish=searches.polish)
    tasks = searches.make_study([spec], [solver]).tasks()
    with progress_bar(f"{algorithm} runs", len(tasks)) as advance:
        records, stopped = until_interrupted(
            lambda: run_study(
                Study(tasks=tasks, folder=out, jobs=jobs or available_cores()),
                progress=lambda _, record: advance(f"{record.verdict.objective:.6g}"),
                on_outdated=say,
            ),
            nothing="",
        )
    loaded = spec.load()
    if as_json:
        data: dict[str, Any] = {"problem": problem.name, "algorithm": algorithm, "options": dict(loaded.options)}
        data["runs"] = [_run(record) for record in records if not _is_polish(record)]
        if searches.polish:
            data["polished"] = [_run(record) for record in records if _is_polish(record)]
        print_json(data)
    else:
        print_rows(
            f"{problem.name}, {algorithm}",
            records,
            {
                "solver": lambda r: r.solver,
                "run": lambda r: str(r.run),
                "seed": lambda r: str(r.seed),
                loaded.objective.name: lambda r: with_unit(r.verdict.objective, loaded.objective.unit),
                "violation": lambda r: f"{r.verdict.violation:.3g}",
                "status": lambda r: r.status,
            },
        )
        print_summaries(records, "All runs")
        stdout.print("objective and violation are found by the judge: the exact functions at the problem's samples")
        if out is not None:
            stdout.print(f"wrote {len(records)} records to {out}", soft_wrap=True)
    if stopped:
        kept = "printed, but not stored: name a folder with --out" if out is None else f"stored in {out}"
        end_interrupted(f"{stopped}; finished runs are {kept}" + (out is not None) * "; rerun the command to continue")
    if not any(record.x for record in records):
        fail(f"no run has a result; the first {records[0].status}")


def _is_polish(record: RunRecord) -> bool:
    return "polishes" in record.definition


def _run(record: RunRecord) -> dict[str, Any]:
    plain = record.to_json()
    same = ("run", "seed", "claimed_objective", "claimed_violation", "failed_evaluations", "status", "x", "verdict")
    return {
        **{key: plain[key] for key in same},
        "evaluations": plain["evaluations"]["f"],
        "time_s": plain["time_s"]["solve"],
    }
