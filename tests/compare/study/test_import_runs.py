"""Results from elsewhere: judged like everything else, unknown times left out of what needs them."""

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from compare.analysis.columns import ALL, format_rows
from compare.analysis.comparison import compare_problems
from compare.analysis.headline import describe_unknown
from compare.judge import evaluate
from compare.study.import_runs import import_runs, read_imported_records, read_points
from compare.study.run import ProblemSpec, Run
from compare.study.study import read_records, write_records
from nlp_gait.errors import GaitError
from tests.compare.cli.calls import nlp_gait
from tests.compare.records import run_once

pytestmark = pytest.mark.usefixtures("coarse_pages")

WALK = ProblemSpec(name="walk12")
PROBLEM = WALK.load()
POINTS = np.random.default_rng(0).uniform(PROBLEM.lower, PROBLEM.upper, (3, 4))


def finals(folder: Path, *, header: bool = True, extra: dict[str, list[object]] | None = None, sep: str = ",") -> Path:
    path = folder / "finals.csv"
    more = extra or {}
    rows = [[*x.tolist(), *(column[k] for column in more.values())] for k, x in enumerate(POINTS)]
    lines = [[*PROBLEM.names, *more]] * header + rows
    path.write_text("\n".join(sep.join(map(str, line)) for line in lines) + "\n")
    return path


def test_each_row_is_a_judged_record(tmp_path: Path) -> None:
    extra = {"run": [4, 5, 6], "objective": [0.5, "", 0.7], "violation": [0, 0, 2.5], "evaluations": [100, 200, 300]}
    records = import_runs(WALK, finals(tmp_path, extra=extra), "GA (MATLAB)")
    assert [(r.run, r.reported_feasible, r.reported_objective, r.counts["f"]) for r in records] == [
        (4, True, 0.5, 100),
        (5, False, None, 200),
        (6, False, 0.7, 300),
    ]
    for record, x in zip(records, POINTS, strict=True):
        own = evaluate(PROBLEM, x)
        assert (record.objective, record.violation) == (own.objective["value"], own.violation)
        assert math.isnan(record.time_s.solve) and list(record.x.values()) == x.tolist()


def test_columns_in_any_order_without_a_header_and_with_other_separators(tmp_path: Path) -> None:
    for header, sep in ((True, ";"), (True, "\t"), (False, ",")):
        np.testing.assert_array_equal(read_points(finals(tmp_path, header=header, sep=sep), PROBLEM)[1], POINTS)
    names = list(PROBLEM.names)
    turned = tmp_path / "turned.csv"
    turned.write_text("\n".join(",".join(map(str, row)) for row in [names[::-1], *POINTS[:, ::-1].tolist()]))
    np.testing.assert_array_equal(read_points(turned, PROBLEM)[1], POINTS)


def test_histories_give_runs_their_course(tmp_path: Path) -> None:
    history = tmp_path / "h.csv"
    history.write_text("run,evaluations,objective,time_s\n0,10,,0.1\n0,50,0.3,0.5\n1,10,0.2,0.1\n2,10,0.1,0.2\n")
    first, *_ = import_runs(WALK, finals(tmp_path), "ga", history)
    assert first.history.evaluations == (10, 50) and first.history.objective == (None, 0.3)
    assert first.time_s.history == (0.1, 0.5) and first.time_s.solve == 0.5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "needs the columns"),
        ("1,2,3\n", "has 3 columns and no header; .* has 4 variables"),
        ("1,2,3,4\n1,2,x,4\n", "line 2: expected a number, got 'x'"),
        ("1,2,3,4\n1,2,3\n", "line 2: 3 cells, but 4 columns"),
        ("1,2,,4\n", "line 1: .* must be a finite number"),
        ("", "has no rows"),
    ],
)
def test_a_damaged_file_is_refused_by_its_line(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(text)
    with pytest.raises(GaitError, match=message):
        read_points(tmp_path / "x.csv", PROBLEM)


def test_a_study_of_points_alone_has_a_report(tmp_path: Path) -> None:
    """There is no convergence to draw."""
    out = tmp_path / "study"
    nlp_gait("import", "walk12", finals(tmp_path), "--as", "thesis", "--out", out)
    assert "evaluations and times of all runs are unknown" in (out / "report.html").read_text()


def test_points_without_evaluations_are_excluded_from_statistics_of_them(tmp_path: Path) -> None:
    out = tmp_path / "study"
    extra: dict[str, list[object]] = {"evaluations": [100, "", ""], "time_s": ["", 2.0, ""]}
    partly = import_runs(WALK, finals(tmp_path, extra=extra), "paper")
    assert [dict(r.counts) for r in partly] == [{"f": 100}, {}, {}]
    assert math.isnan(partly[0].time_s.solve) and partly[1].time_s.solve == 2.0
    write_records([*partly, *import_runs(WALK, finals(tmp_path), "GA", evaluations=50)], out)
    done = nlp_gait("import", "walk12", finals(tmp_path), "--as", "thesis", "--out", out, "--json")
    nlp_gait("report", out, "--csv")
    summaries = {summary["solver"]: summary for summary in json.loads(done.stdout)["problems"]["walk12"]}
    for unknown in (summaries["paper"], summaries["thesis"]):
        assert unknown["median_evaluations"] is None and unknown["evaluations_to_1"] is None
    assert summaries["GA"]["median_evaluations"] == 50 and summaries["thesis"]["best"] == summaries["GA"]["best"]
    (comparison,) = compare_problems(read_records(out)[0])
    header, rows = format_rows(comparison, ALL)
    assert rows[-1][header.index("median evaluations")] == "-"
    page = " ".join((out / "report.md").read_text().split())
    assert not re.search(r"\bnan\b", page, re.IGNORECASE)
    for solver, count in (("paper", "2 of 3"), ("thesis", "all 3")):
        sentence = f"{solver}: the number of evaluations of {count} runs is unknown; statistics of evaluations exclude"
        assert sentence in page and sentence in describe_unknown(comparison)[solver == "thesis"]
    with open(out / "runs.csv") as file:
        rows = [r for r in csv.DictReader(file) if r["solver"] == "paper"]
    assert [(r["calls_f"], r["iterations"]) for r in rows] == [("100", ""), ("", ""), ("", "")]


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("time_s", -5, "line 2: time_s must be a finite number >= 0, got -5; leave the cell empty if it is unknown"),
        ("time_s", "-1e308", "time_s must be a finite number >= 0"),
        ("time_s", "inf", "time_s must be a finite number >= 0, got inf"),
        ("violation", -1, "violation must be a finite number >= 0, got -1"),
        ("objective", "-inf", "objective must be a finite number, got -inf"),
        ("run", 1e300, r"run must be a whole number >= 0 and <= 2\^53, got 1e\+300; fix the cell"),
        ("seed", 2**63, r"seed must be a whole number >= 0 and <= 2\^53"),
        ("evaluations", 1e19, r"evaluations must be a whole number >= 1 and <= 2\^53"),
        ("evaluations", 0, "evaluations must be a whole number >= 1"),
    ],
)
def test_impossible_numbers_are_refused(column: str, value: object, message: str, tmp_path: Path) -> None:
    with pytest.raises(GaitError, match=message):
        import_runs(WALK, finals(tmp_path, extra={column: [value, 1, 2]}), "ga", evaluations=3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,50,0.5\n0,10,0.4\n1,1,\n2,1,\n", "line 3: evaluations of run 0 must ascend"),
        ("0,10,0.5\n1,1,\n2,1,\n7,1,\n", "run 7 has no final point"),
        ("0,10,0.5\n1,1,\n", "run 2 has no history"),
        ("0,0,0.5\n1,1,\n2,1,\n", "line 2: evaluations must be a whole number .*1"),
        ("0,1,inf\n1,1,\n2,1,\n", "line 2: objective must be a finite number, got inf"),
        ("0,1,0.5,2\n0,2,0.5,1\n1,1,,\n2,1,,\n", "line 3: time_s must be a finite number >= 2, got 1"),
    ],
)
def test_a_damaged_history_is_refused_by_its_line(text: str, message: str, tmp_path: Path) -> None:
    times = ",time_s" if text.partition("\n")[0].count(",") == 3 else ""
    (tmp_path / "h.csv").write_text(f"run,evaluations,objective{times}\n{text}")
    with pytest.raises(GaitError, match=message):
        import_runs(WALK, finals(tmp_path), "ga", tmp_path / "h.csv")


def test_values_missing_from_a_file_are_filled_in_and_others_stay(tmp_path: Path) -> None:
    """Runs are rows, seeds are runs; several entries at one count are allowed; every value is in the key."""
    with pytest.raises(GaitError, match="a run is duplicated"):
        import_runs(WALK, finals(tmp_path, extra={"run": [1, 1, 2]}), "ga", evaluations=3)
    plain = import_runs(WALK, finals(tmp_path), "ga", evaluations=3)
    assert [(r.run, r.seed, r.counts, r.reported_feasible) for r in plain] == [
        (k, k, {"f": 3}, False) for k in range(3)
    ]
    for record in plain:
        assert record.history.objective == (record.objective if record.feasible else None,)
        assert (record.failed_evaluations, record.iterations) == (0, 0)
    said = {"seed": [7, 8, 9], "time_s": [0.5, "", 2.0], "objective": [1, 2, 3]}
    full = import_runs(WALK, finals(tmp_path, extra=said), "ga", evaluations=3)
    assert [(r.seed, r.reported_feasible, r.inputs.seed) for r in full] == [(7, True, 7), (8, True, 8), (9, True, 9)]
    assert (full[0].time_s.solve, full[2].time_s.history) == (0.5, (2.0,)) and math.isnan(full[1].time_s.solve)
    keys = {r.inputs.imported for r in (*plain, *full)}
    assert len(keys) == 6
    (tmp_path / "h.csv").write_text("run,evaluations,objective\n0,10,\n0,10,0.5\n1,10,0.5\n2,10,0.5\n")
    first, second, _ = import_runs(WALK, finals(tmp_path), "ga", tmp_path / "h.csv", evaluations=3)
    assert first.history.evaluations == (10, 10) and second.counts == {"f": 10}
    assert len(first.time_s.history) == 2 and math.isnan(first.time_s.solve)


def test_records_from_elsewhere_belong_to_the_very_problem(tmp_path: Path) -> None:
    """Another value of a parameter is another problem; a folder without records has none."""
    own = import_runs(WALK, finals(tmp_path), "ga", evaluations=3)
    assert read_imported_records(tmp_path / "absent", own) == []
    write_records(own, tmp_path)
    assert [record.run for record in read_imported_records(tmp_path, own)] == [0, 1, 2]
    other = import_runs(ProblemSpec(name="walk12", values={"lambda": 0.5}), finals(tmp_path), "ga", evaluations=3)
    assert read_imported_records(tmp_path, other) == []


def test_a_history_is_cut_where_its_run_cannot_have_been(tmp_path: Path) -> None:
    """Better than the judged end of the run, or than the proven bound; its length stays."""
    best = run_once(Run(problem=WALK, solver="ipopt"))
    (tmp_path / "f.csv").write_text(",".join(PROBLEM.names) + "\n" + ",".join(map(repr, best.x.values())) + "\n")
    (tmp_path / "h.csv").write_text(f"run,evaluations,objective\n0,100,5.0\n0,200,{best.objective - 0.1}\n0,300,2.0\n")
    (record,) = import_runs(WALK, tmp_path / "f.csv", "ga", tmp_path / "h.csv")
    assert record.history.evaluations == (200, 300)
    assert record.history.objective == (best.objective - 0.1, record.objective)
    assert record.status.endswith("; 2 values of its history left out: better than its point, or than the proven bound")


def test_printed_digits_are_judged_as_intervals(tmp_path: Path) -> None:
    """Five digits, as MATLAB prints them, make an optimum infeasible; a point that rounds to them is feasible."""
    spec = ProblemSpec(name="nao-ssp")
    problem, best = spec.load(), run_once(Run(problem=spec, solver="ipopt"))
    rows = [[f"{value:.{digits}g}" for value in best.x.values()] for digits in (5, 5, 17)]
    rows[1][0] = f"{best.x['hip_height_m'] - 1e-3:.5g}"  # another gait: no digits explain it
    (tmp_path / "f.csv").write_text("\n".join(",".join(row) for row in ([*best.x], *rows)) + "\n")
    rounded, other, exact = import_runs(spec, tmp_path / "f.csv", "ga", evaluations=3)
    assert not evaluate(problem, [float(text) for text in rows[0]]).feasible
    assert rounded.feasible and rounded.status.endswith("a feasible point that rounds to its printed digits")
    np.testing.assert_allclose([*rounded.x.values()], np.array(rows[0], dtype=float), rtol=1e-4)
    assert exact.feasible and exact.x == best.x and not other.feasible and exact.status == "imported from f.csv"
