"""A study in one call."""

from pathlib import Path

import pytest

import nlp_gait
from compare.report.compared_study import ComparedStudy
from metaheuristics import ParticleSwarm
from nlp_gait.errors import UnknownNameError


@pytest.fixture(scope="module")
def study() -> ComparedStudy:
    solvers = {"pso": "pso", "small swarm": ParticleSwarm(population=10)}
    return nlp_gait.compare(["nao-dsp", "nao-ssp"], solvers, runs=3, starts=1, evaluations=300)


@pytest.mark.commit
def test_one_call_compares_searches_with_ipopt(study: ComparedStudy, tmp_path: Path) -> None:
    assert [len(comparison.solvers) for comparison in study.comparisons] == [3, 3]
    assert (
        str(study).startswith("nao-dsp: ")
        and "median run ends" in str(study)
        and "above the proven optimum 0.531886 W" in str(study)
    )
    assert study.table("nao-ssp").splitlines()[1].split()[:2] == ["IPOPT", "1"]
    assert study.plot().axes
    frame = study.to_frame()
    assert len(frame) == 14 and set(frame.solver) == {"ipopt", "pso", "small swarm"}
    assert "<html" in study.report(tmp_path).read_text()
    with pytest.raises(UnknownNameError, match="nao-dps"):
        study.table("nao-dps")


def test_tables_for_papers_show_different_digits_gaps_and_marks(study: ComparedStudy) -> None:
    text = study.latex()
    assert text.count(r"\begin{tabular}") == 3 and r"64 \%" in text
    overview = text[text.rindex(r"\begin{table}") :]
    assert "& small swarm" in overview and "wins/ties/losses" in overview and "mean rank & 1.00" in overview
    rows = [line.split(" & ") for line in text.splitlines() if line.startswith("IPOPT")]
    assert rows[0][3].startswith("0.5319")
