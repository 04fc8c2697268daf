"""User code: a problem, a search and a plain function in one file, in every command by ``file.py:name``."""

import shutil
from pathlib import Path

import pytest

from tests.compare.cli.calls import as_json, nlp_gait, one_sentence

EXAMPLE = Path(__file__).parents[3] / "examples" / "bring_your_own.py"
STUDY = (
    "compare my.py:two_link --set intervals=10 --set time_s=1.5 --algorithms my.py:Shrinking --starts 0 --runs 1 "
    "--evaluations 300 --out study --jobs 1"
).split()


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, coarse_pictures: None) -> Path:
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLE, tmp_path / "my.py")
    return tmp_path / "my.py"


def test_every_command_takes_them(mine: Path) -> None:
    best = as_json("solve", "my.py:two_link", "--starts", "3", "--out", "best.json", "--set", "intervals=10")
    assert best["problem"] == "my.py:two_link" and best["claimed"] and best["feasible"]
    x = ",".join(map(repr, best["x"].values()))
    verdict = as_json("evaluate", "my.py:two_link", "--set", "intervals=10", "--x", x)
    assert verdict["objective"]["value"] == pytest.approx(best["objective"])
    search = "compare my.py:two_link --algorithms my.py:annealing --starts 0 --runs 1 --evaluations 300 --jobs 1"
    found = as_json(*search.split())
    assert found["runs"][0]["evaluations"] == 300 and found["runs"][0]["feasible"]
    assert "swing_rad" in nlp_gait("list", "my.py:two_link").stdout
    swept = ["sweep", "my.py:two_link", "--over", "speed_m_s=0.5,0.6", "--out", "sweep"]
    assert "speed_m_s" in nlp_gait(*swept, "--starts", "1").stdout
    assert "my.py" in one_sentence("solve", "my.py:three_link")


def test_a_command_names_them_and_a_folder_does_not(mine: Path) -> None:
    nlp_gait(*STUDY)
    names = sorted(path.name for path in Path("study").glob("records/two_link/*.json"))
    assert [name.rpartition("-")[0] for name in names] == ["Shrinking-0000"]
    nlp_gait("report", "study")
    mine.rename("moved.py")
    assert "my.py" in one_sentence(*STUDY)
    Path("moved.py").rename("my.py")
    nlp_gait(*STUDY)
    assert sorted(path.name for path in Path("study").glob("records/two_link/*.json")) == names
