"""The reproduction of the 12-joint walk from end to end, with few runs, and its paper data."""

from __future__ import annotations

from pathlib import Path

import pytest

from compare.papers.walk12 import reproduce as walk12
from compare.papers.walk12 import runs as walk12_runs
from compare.papers.walk12.paper import TABLE_4
from nlp_gait.errors import OutputError


def test_f1_that_table_4_implies() -> None:
    assert [round(row.implied_f1) for row in TABLE_4] == [1139, 726, 277, 164]


def test_reproduction_is_whole_and_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (walk12, walk12_runs):
        monkeypatch.setattr(module, "STARTS", 2)
        monkeypatch.setattr(module, "SWEEP_WEIGHTS", (0.2, 0.7, 1.0))
        monkeypatch.setattr(module, "FRONT_LENGTHS_M", (0.05, 0.09, 0.13))
    monkeypatch.setattr(walk12_runs, "RUNS", 2)
    monkeypatch.setattr(walk12_runs, "PSO_EVALUATIONS", 500)
    messages: list[str] = []
    walk12.reproduce(tmp_path, progress=messages.append)
    report = (tmp_path / "report.md").read_text()
    assert "{" not in report
    for name in ("fig08", "fig09", "fig10", "fig12-13", "fig14-15", "fig16-17", "tradeoff", "circle"):
        assert (tmp_path / f"{name}.png").stat().st_size > 0
        assert (tmp_path / f"{name}.svg").stat().st_size > 0
        assert f"({name}.png)" in report
    for table in ("table3-paper", "table3-model", "table4", "gaits"):
        assert (tmp_path / f"{table}.md").read_text().strip() in report
        assert (tmp_path / f"{table}.csv").exists()

    (tmp_path / "steps" / "front.json").unlink()
    messages.clear()
    monkeypatch.setattr(walk12, "_figures", lambda folder, findings: None)  # the slow part, seen above
    walk12.reproduce(tmp_path, progress=messages.append)
    assert [m for m in messages if "kept" not in m] == ["front", "figures, tables and report"]
    assert (tmp_path / "report.md").read_text() == report


def test_a_folder_that_cannot_be_written_to_fails_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        walk12.reproduce(tmp_path / "file", progress=print)
