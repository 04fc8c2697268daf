"""`bench --objectives 2`: searches and user code on instances with two objectives, on one page."""

from __future__ import annotations

from pathlib import Path

import pytest

from compare.bench.fronts import make_front_search, rank_searches, run_fronts
from nlp_gait.errors import UserCodeError
from tests.compare.cli.calls import as_json, one_sentence

pytest.importorskip("pymoo", reason="pymoo is not installed: pip install 'nlp-gait[algorithms]'")
pytestmark = pytest.mark.usefixtures("undrawn_pages")

OWN = """
import numpy as np

class Search:
    def __init__(self, start):
        self.start, self.X, self.F = start, np.empty((0, len(start.lower))), np.empty((0, 2))
    def ask(self):
        return self.start.rng.uniform(self.start.lower, self.start.upper, (20, len(self.start.lower)))
    def tell(self, X, F, violation):
        good = violation == 0
        self.X, self.F = np.vstack([self.X, X[good]]), np.vstack([self.F, F[good]])
    def front(self):
        return self.X, self.F

class Sampling:
    population, name = 20, "sampling"
    def start(self, start, objectives):
        assert objectives == 2
        return Search(start)

nothing = 3
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("own") / "own.py"
    path.write_text(OWN)
    return path


@pytest.mark.slow
def test_shipped_searches_and_user_code_are_on_one_page(file: Path, tmp_path: Path) -> None:
    arguments = [
        "bench",
        "--objectives",
        "2",
        "--instances",
        "walk12-stability-step",
        "--runs",
        "2",
        "--evaluations",
        "300",
    ]
    arguments += ["--against", "NSGA2", "--algorithm", f"{file}:Sampling", "--jobs", "1", "--out", str(tmp_path)]
    done = as_json(*arguments)
    assert done["mean_ranks"] == {"NSGA2": 1.0, "Sampling": 2.0}
    text = (tmp_path / "fronts.md").read_text()
    assert "walk12-stability-step | Sampling" in text and "0 of 2" in text
    stored = {path: path.stat().st_mtime_ns for path in tmp_path.glob("store/*.json")}
    assert len(stored) == 4 and as_json(*arguments)["mean_ranks"] == done["mean_ranks"]
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("store/*.json")} == stored


def test_equal_seeds_give_equal_fronts(tmp_path: Path) -> None:
    def run(folder: str) -> list[float]:
        options = {"runs": 1, "evaluations": 200, "folder": tmp_path / folder, "jobs": 1, "progress": lambda text: None}
        results = run_fronts(["walk12-stability-step"], ["NSGA2", "CMOPSO"], **options)  # type: ignore[arg-type]
        assert set(rank_searches(results)) == {"NSGA2", "CMOPSO"}
        return [result.get_median("hypervolume") for result in results]

    assert run("a") == run("b")


def test_mistakes_are_one_sentence(file: Path, tmp_path: Path) -> None:
    with pytest.raises(UserCodeError, match=r"must have `population` and `start\(start, objectives\)`, got int"):
        make_front_search(f"{file}:nothing")
    for words, option in (("unknown algorithm for several objectives", "--against"), ("two objectives", "--instances")):
        assert words in one_sentence("bench", "--objectives", "2", option, "nsga", "--out", str(tmp_path))
