"""Files for papers and other programs: their numbers are those of the runs, and LaTeX and pyarrow read them."""

import csv
import re
import subprocess
from pathlib import Path
from statistics import mean, stdev

import pytest

from compare.analysis.comparison import compare_problems
from compare.report import FurtherFiles
from compare.report.document import Document
from compare.report.latex import format_latex_table
from compare.report.study_report import make_study_document
from compare.study.record import RunRecord
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, StudyFile, run_study

EMPTY = Document(title="", parts=())


@pytest.fixture(scope="module")
def records() -> list[RunRecord]:
    problem = ProblemSpec(name="walk12")
    labels = {"pso": "pso", "random": "RD_1 50"}
    tasks = [
        Run(problem=problem, solver=solver, evaluations=1000, number=run, label=labels[solver])
        for solver in labels
        for run in range(6)
    ]
    return run_study(Study(runs=tuple(tasks)))


def test_the_numbers_are_those_of_the_runs(records: list[RunRecord]) -> None:
    text = format_latex_table(compare_problems(records)[0])
    rows = [line.removesuffix(r" \\").split(" & ") for line in text.splitlines() if line.startswith(("PSO", "RD"))]
    assert [row[0] for row in rows] == ["PSO", r"RD\_1 50"] and rows[0][2].startswith("0.")
    for row, solver in zip(rows, ("pso", "RD_1 50"), strict=True):
        values = [r.objective for r in records if r.solver == solver and r.feasible]
        assert row[1] == f"{len(values)}/6"
        assert row[2] == f"{max(values):.4f}" and row[6] == f"{min(values):.4f}"  # maximised
        assert (row[4], row[5]) == (f"{mean(values):.4f}", f"{stdev(values):.4f}")
    assert rows[0][3].startswith(r"\textbf{") and not rows[1][3].startswith(r"\textbf{") and float(rows[1][8]) < 0.05
    assert (
        ": 6 runs of each solver" in text
        and r"0.89 \%" in text
        and "at most 1,000 evaluations" in text
        and "rank-sum" in text
    )
    assert not re.search(r"(?<!\\)[%&_#](?! )", text.split(r"\begin{tabular}")[0].replace(r"\label{tab:walk12}", ""))


def test_csv_has_the_gap_dimension_budget_and_costs_to_targets(records: list[RunRecord], tmp_path: Path) -> None:
    comparisons, nothing = compare_problems(records), FurtherFiles()
    assert nothing.write(tmp_path, comparisons, EMPTY) == []
    (tmp_path / "runs.csv").write_text("old\n")
    assert tmp_path / "runs.csv" in nothing.write(tmp_path, comparisons, EMPTY)  # it is kept up to date
    with open(tmp_path / "runs.csv") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(records) and {(row["n"], row["budget"]) for row in rows} == {("4", "1000")}
    for row in rows:
        gap = 1.0 - float(row["objective"]) / comparisons[0].reference
        assert float(row["gap"]) == pytest.approx(gap, abs=1e-12)
        assert (row["evaluations_to_0.01"] != "") == (gap <= 0.01) == (row["seconds_to_0.01"] != "")
        assert row["evaluations_to_0.01"] == "" or 0 < float(row["evaluations_to_0.01"]) <= 1000


def test_all_figures_are_written_for_papers_with_embedded_fonts(records: list[RunRecord], tmp_path: Path) -> None:
    comparisons = compare_problems(records)
    document = make_study_document(comparisons, StudyFile())
    *figures, captions = FurtherFiles(figures=True).write(tmp_path, comparisons, document)
    names = {"walk12-final", "walk12-gaits", "walk12-convergence", "walk12-runtime", "walk12-curves"}
    assert {figure.name for figure in figures} == {f"{name}.{kind}" for name in names for kind in ("png", "pdf")}
    assert all(b"/FontFile2" in figure.read_bytes() for figure in figures if figure.suffix == ".pdf")
    text = captions.read_text()
    assert text.count(r"\includegraphics") == 5 and "Best gait from the side" in text
    assert text.count("walk12, 6 runs of each solver, at most 1,000 evaluations") == 5


@pytest.mark.program("pdflatex")
def test_latex_reads_it(records: list[RunRecord], tmp_path: Path) -> None:
    document = make_study_document(compare_problems(records), StudyFile())
    FurtherFiles(latex=True, figures=True).write(tmp_path, compare_problems(records), document)
    (tmp_path / "page.tex").write_text(
        "\\documentclass{article}\n\\usepackage{booktabs,graphicx}\n\\begin{document}\n\\input{walk12-table}\n"
        "\\input{figures}\n\\end{document}\n"
    )
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "page.tex"]
    for _ in range(2):  # the second time with the labels of the first
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "LaTeX Warning" not in done.stdout and "Overfull" not in done.stdout
