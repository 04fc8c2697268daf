"""The commands ``sweep`` and ``reproduce`` as scripts use them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from typer.testing import CliRunner

from compare.cli import app
from compare.papers import REPRODUCTIONS, load_reproduction

RUN = CliRunner()


def test_sweep_writes_table_and_picture(tmp_path: Path) -> None:
    over = ["--over", "hip_height_m=0.305:0.31:2"]
    done = RUN.invoke(
        app, ["sweep", "nao-dsp", *over, "--algorithm", "pso", "--evaluations", "300", "--out", str(tmp_path), "--json"]
    )
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert [point["at"] for point in result["points"]] == [{"hip_height_m": 0.305}, {"hip_height_m": 0.31}]
    written = {path.suffix: path for path in map(Path, result["files"])}
    rows = list(csv.DictReader(written[".csv"].read_text().splitlines()))
    assert [float(row["objective"]) for row in rows] == [point["objective"] for point in result["points"]]
    assert written.keys() >= {".png", ".svg", ".html"} and all(path.stat().st_size > 0 for path in written.values())


def test_sweep_over_nonsense_is_one_sentence(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["sweep", "nao-dsp", "--over", "hip_height_m=low:high:3", "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert done.stdout == "" and done.stderr.startswith("nlp-gait: --over takes")


def test_every_reproduction_knows_its_steps() -> None:
    for name in REPRODUCTIONS:
        assert load_reproduction(name).full.steps


def test_an_unknown_paper_is_one_sentence(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["reproduce", "walk1", "--out", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert done.stderr == "nlp-gait: unknown reproduction 'walk1'; did you mean 'walk12'?\n"
    assert not (tmp_path / "out").exists()


def test_an_effort_is_read_from_a_file_or_is_the_quick_one(tmp_path: Path) -> None:
    file = tmp_path / "effort.json"
    file.write_text('{"runs": "many"}')
    command = ["reproduce", "walk12", "--effort", str(file), "--out", str(tmp_path / "out")]
    assert "runs must be a whole number, got 'many'" in RUN.invoke(app, command).stderr
    assert "omit one" in RUN.invoke(app, [*command, "--quick"]).stderr
