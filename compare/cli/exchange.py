"""``nlp-gait import`` and ``nlp-gait logs``: exchange of runs with other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from compare.cli.command import command
from compare.cli.common import end_if_excluded, print_result, say, stdout
from compare.cli.compare import print_summaries, summarise_problems
from compare.cli.options import RESULTS, NamedProblem


@command
def import_results(
    *,
    problem: NamedProblem,
    finals: Path,
    history: Path | None = None,
    label: str,
    evaluations: int | None = None,
    out: Path = RESULTS,
    as_csv: bool = False,
    as_json: bool = False,
) -> None:
    """Import results of other programs into a study, judged and reported like all others.

    Example: `nlp-gait import nao-ssp finals.csv --history histories.csv --as "GA (MATLAB)" --out study`
    """
    from compare.analysis.comparison import label_editions
    from compare.report import FurtherFiles, write_report
    from compare.study.evidence import read_evidence
    from compare.study.import_runs import import_runs
    from compare.study.record_files import write_record
    from compare.study.settings import read_manifest
    from nlp_gait.files import make_writable_folder

    spec = problem.spec()
    records = import_runs(spec, finals, label, history, evaluations)
    kept = [write_record(record, make_writable_folder(out)) for record in records]
    evidence = read_evidence(out)
    everything = label_editions(evidence.records)
    report = write_report(
        out, everything, read_manifest(out), excluded=evidence.excluded, further=FurtherFiles(csv=as_csv)
    )
    written = [*kept, *report]
    shown = [record for record in everything if record.problem == spec.title]
    print_result(as_json, {"problems": summarise_problems(shown)}, written, lambda: print_summaries(shown))
    end_if_excluded(evidence.excluded)


@command
def logs(folder: Path, to: Path, form: Literal["ioh", "coco"] = "ioh", as_json: bool = False) -> None:
    """Write a study's runs as logs that iohinspector and IOHanalyzer read.

    The logs contain the relative gap to the best known objective, and equivalent evaluations.

    Example: `nlp-gait logs results --to logs --format ioh`
    """
    from compare.analysis.comparison import compare_problems
    from compare.analysis.solver_table import describe_unknown
    from compare.logs import write_coco, write_ioh
    from compare.study.evidence import read_evidence

    evidence = read_evidence(folder)
    records = evidence.records
    comparisons = compare_problems(records)
    for sentence in (s for comparison in comparisons for s in describe_unknown(comparison)):
        say(f"not in the logs: {sentence}")
    written = (write_ioh if form == "ioh" else write_coco)(comparisons, to)
    data = {"problems": [comparison.problem for comparison in comparisons], "runs": len(records)}
    print_result(
        as_json,
        data,
        () if not as_json else written,
        lambda: stdout.print(f"wrote {len(written)} files to {to}", soft_wrap=True),
    )
    end_if_excluded(evidence.excluded)
