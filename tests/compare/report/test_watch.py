"""A watched report follows the records, and its page reloads itself until the watch ends."""

from dataclasses import replace
from pathlib import Path

from compare.report import watch_report, write_report
from compare.study.record import RunRecord
from compare.study.study import StudyFile, name_record
from tests.compare.records import record


def test_a_report_is_rewritten_when_records_change(tmp_path: Path) -> None:
    """First there is no record, then one, then nothing new, then another; then Ctrl-C."""
    record, written, waits = tmp_path / "records" / "walk" / "pso-0.json", [], []

    def rewrite() -> None:
        written.append(sorted(path.name for path in record.parent.glob("*.json")))
        (tmp_path / "report.html").write_text(f"<head><title>{len(written)}</title></head>")

    def sleep(seconds: float) -> None:
        waits.append(len(written))
        if len(waits) == 1:
            record.parent.mkdir(parents=True)
            record.write_text("{}")
        elif len(waits) == 3:
            record.with_name("pso-1.json").write_text("{}")
        elif len(waits) == 4:
            raise KeyboardInterrupt

    watch_report(tmp_path, rewrite, sleep)
    assert waits == [0, 1, 1, 2]
    assert written == [["pso-0.json"], ["pso-0.json", "pso-1.json"]]
    assert (tmp_path / "report.html").read_text().count('http-equiv="refresh"') == 1


def make_study(**objectives: list[float]) -> list[RunRecord]:
    """Runs by solver that end at these objectives."""
    ends = [(solver, run, value) for solver, values in objectives.items() for run, value in enumerate(values)]
    return [record(solver, run, [(100, value)]) for solver, run, value in ends]


def test_a_running_study_says_how_many_runs_have_ended(tmp_path: Path) -> None:
    """Three of four planned runs have ended; runs that another command planned do not count."""
    records = make_study(a=[0.9, 0.8], b=[0.7])
    others = ["walk/c-0000-00000000"]
    planned = [name_record(one) for one in records]
    file = StudyFile(runs=(*planned, "walk/b-0001-00000000", *others))
    write_report(tmp_path, records, file)
    assert "3 of 4 runs have ended" in (tmp_path / "report.html").read_text()
    write_report(tmp_path, records, replace(file, runs=(*planned, *others)))
    assert "runs have ended" not in (tmp_path / "report.html").read_text()
