"""Steps of questions in their memo: by several processes, and damaged."""

import os
from functools import partial
from pathlib import Path

import pytest

from compare.study.memo import Memo


def record_call(folder: Path, number: int) -> dict[str, float]:
    (folder / f"{number}-{os.getpid()}").touch()
    return {"third": number / 3.0}


@pytest.mark.parametrize("jobs", [1, 3])
def test_results_are_computed_once_and_damaged_ones_again(jobs: int, tmp_path: Path) -> None:
    out, calls = tmp_path / "out", tmp_path / "calls"
    calls.mkdir()
    computations = {f"step-{k}": ({"k": k}, partial(record_call, calls, k)) for k in range(6)}
    expected = {f"step-{k}": {"third": k / 3.0} for k in range(6)}
    assert Memo(out).compute_all(computations, jobs=jobs) == expected  # every bit
    assert len({path.name.partition("-")[2] for path in calls.iterdir()} - {str(os.getpid())}) == (
        3 if jobs == 3 else 0
    )
    for path, content in zip(sorted((out / "store").iterdir()), ("", "{", '{"result"}', "{}", "[]"), strict=False):
        path.write_text(content)
    assert Memo(out).compute_all(computations, jobs=jobs) == expected
    assert sorted(path.name[0] for path in calls.iterdir()).count("5") == 1
    assert Memo(out).compute("step-5", {"k": 6}, lambda: None) is None  # other inputs
