"""``nlp-gait archive``, ``nlp-gait verify`` and ``nlp-gait cite``."""

from __future__ import annotations

from pathlib import Path

from compare.cli.command import command
from compare.cli.common import end_if_excluded, fail, print_json, print_written, progress_bar, stdout
from compare.cli.options import name_all
from compare.cli.outputs import output_file
from nlp_gait.errors import InputError


@command
def archive(*, folder: Path, out: Path = Path("study.zip"), code: list[str] | None = None) -> None:
    """Pack a study for others: records, report, user code, robots, certificates, versions, hashes, and how to repeat it.

    All records are checked and the report is rewritten first. `nlp-gait verify FILE.zip` checks the archive on any machine.

    Example: `nlp-gait archive results --out study.zip`
    """
    from compare.analysis.comparison import label_editions
    from compare.archive import pack_study
    from compare.report import write_report
    from compare.study.evidence import read_evidence
    from compare.study.settings import read_manifest

    name_all(code)
    target = output_file(out)
    evidence = read_evidence(folder, "all")
    end_if_excluded(evidence.excluded)
    write_report(folder, label_editions(evidence.records), read_manifest(folder))
    print_written(pack_study(folder, evidence.records, target))


@command
def verify(*, study: Path, rerun: str = "0%", code: list[str] | None = None, as_json: bool = False) -> None:
    """Check a study: evaluate every point again, check histories, hashes, sessions, certificates and, of an archive, the report.

    Prints what holds and what does not; the exit status is 1 if anything does not. User code runs only if named with --code.

    Examples: `nlp-gait verify results`, `nlp-gait verify study.zip --rerun 5%`
    """
    from compare.archive import verify_archive, verify_folder

    share = _parse_share(rerun)
    name_all(code)
    with progress_bar("repeated runs", None) as advance:
        check = verify_folder if study.is_dir() else verify_archive
        findings = check(study, share=share, progress=advance)
    wrong = [finding for finding in findings if not finding.holds]
    if as_json:
        print_json({"holds": not wrong, "findings": [finding._asdict() for finding in findings]})
    else:
        for finding in findings:
            stdout.print(finding.sentence, soft_wrap=True)
    if wrong:
        fail(f"{len(wrong)} of {len(findings)} checks do not hold")


def _parse_share(text: str) -> float:
    """Return a share from 0 to 1 of a text in percent."""
    try:
        share = float(text.removesuffix("%")) / 100.0
    except ValueError:
        share = -1.0
    if not 0.0 <= share <= 1.0:
        raise InputError(f"--rerun takes a share from 0% to 100%, got {text!r}")
    return share


@command
def cite(name: str | None = None, as_json: bool = False) -> None:
    """Print BibTeX for the software, and for the papers and the suite that a problem comes from.

    Examples: `nlp-gait cite`, `nlp-gait cite nao-ssp`, `nlp-gait cite ssp-v5`
    """
    from compare.study.description import find_citations

    found = find_citations(name)
    if as_json:
        print_json({"entries": found})
    else:
        stdout.print("\n\n".join(found), soft_wrap=True)
