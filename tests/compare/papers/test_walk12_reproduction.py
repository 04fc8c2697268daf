"""The reproduction of the 12-joint walk from end to end, with few runs, and its paper data."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from compare.papers.walk12 import walk12_reproduction as walk12
from compare.papers.walk12.walk12_paper import F1MAX, TABLE_3, TABLE_4
from compare.papers.walk12.walk12_runs import Effort
from compare.study.record import read_record
from nlp_gait.errors import OutputError

SMALL = Effort(starts=2, runs=2, pso_evaluations=500, weights=(0.2, 0.7, 1.0), lengths_m=(0.05, 0.09, 0.13))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """Folder and notes of a finished reproduction."""
    out = tmp_path_factory.mktemp("walk12")
    told: list[str] = []
    walk12.reproduce(out, progress=told.append, effort=SMALL)
    return out, told


def test_f1_that_table_4_implies() -> None:
    assert [round(row.implied_f1) for row in TABLE_4] == [1139, 726, 277, 164]


def test_the_report_holds_every_table_and_figure(done: tuple[Path, list[str]]) -> None:
    out, told = done
    report = (out / "report.md").read_text()
    assert "{" not in report and "nan" not in report
    figures = re.findall(r"\((\S+)\.png\)", report)
    assert figures == "tradeoff fig08 fig09 fig10 fig12-13 fig14-15 fig16-17 circle".split()
    assert all((out / f"{name}.{kind}").stat().st_size > 1000 for name in figures for kind in ("png", "svg"))
    names = {path.stem for path in out.glob("*.csv")}
    assert names == {"table3-paper", "table3-model", "table4", "gaits", "walk-straight", "walk-circle"}
    assert len(told) == SMALL.steps


def test_tables_tell_what_the_records_hold(done: tuple[Path, list[str]]) -> None:
    out, _ = done
    with (out / "table3-paper.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    found = [read_record(path) for path in sorted((out / "records" / "table3-paper-1").glob("ipopt-*.json"))]
    f1max = max(record.verdict.objective for record in found)
    assert float(last["IPOPT"]) == f1max and len(found) == SMALL.starts
    # The second normalisation is the first one's largest f1: f of the most stable gait is 1.
    model = [read_record(path) for path in (out / "records" / "table3-model-1").glob("ipopt-*.json")]
    assert model[0].definition["problem"]["parameters"]["f1max"] == f1max * F1MAX
    assert max(record.verdict.objective for record in model) == pytest.approx(1.0, abs=1e-6)


def test_a_second_call_computes_only_what_is_missing(done: tuple[Path, list[str]]) -> None:
    out, _ = done
    first, step = out / "records" / f"table3-paper-{TABLE_3[1].weight:g}" / "ga-0001.json", out / "store" / "front.json"
    kept = read_record(first), step.read_text()
    first.unlink()
    step.unlink()
    told: list[str] = []

    def stop_at_figures(note: str) -> None:
        told.append(note)
        if note.startswith("figures"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        walk12.reproduce(out, progress=stop_at_figures, effort=SMALL)
    assert [note for note in told if "stored" not in note] == [
        "table3-paper-0.15, ga 1",
        "front",
        "figures, tables and report",
    ]
    assert read_record(first).x == kept[0].x and step.read_text() == kept[1]


def test_a_folder_that_cannot_be_written_to_fails_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        walk12.reproduce(tmp_path / "file", progress=print)
