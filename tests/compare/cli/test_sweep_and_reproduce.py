"""The commands ``sweep`` and ``reproduce`` as scripts use them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from typer.testing import CliRunner

from compare.cli import app

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
    assert written.keys() >= {".svg", ".html"} and all(path.stat().st_size > 0 for path in written.values())
