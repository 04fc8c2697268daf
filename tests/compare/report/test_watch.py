"""A watched report follows the records, and its page reloads itself until the watch ends."""

from __future__ import annotations

from pathlib import Path

from compare.report import watch_report


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
