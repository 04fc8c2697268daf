"""A report says which settings were given, and all that a run used."""

from dataclasses import replace

from compare.report.provenance import make_solver_table
from tests.compare.records import record


def test_runs_with_equal_settings_are_one_row() -> None:
    runs = [record("pso", k, [(10, 1.0)]) for k in range(3)]
    changed = replace(runs[2], inputs=replace(runs[2].inputs, settings={"population": 30}))
    table = make_solver_table([*(replace(run, settings={"population": 50}) for run in runs[:2]), changed])
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    assert [(row["given settings"], row["all settings"]) for row in rows] == [
        ("-", "population: 50"),
        ("population: 30", "kind: pso"),
    ]
    assert [(row["seeds"], row["runs"]) for row in rows] == [("0 to 1", "2"), ("2 to 2", "1")]
