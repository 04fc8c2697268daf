"""What the page on GaitBench says, runs."""

import re
import warnings
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.backends.kernel.compiler import FOLDER_VARIABLE
from nlp_gait.gaitbench import instance as instances
from nlp_gait.gaitbench.adapters import ADAPTERS
from nlp_gait.gaitbench.facts import Facts

PAGE = Path(__file__).parents[2] / "docs" / "gaitbench.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
IMPORT = re.compile(r"^(?:import|from) (\w+)", re.MULTILINE)
# With the extra algorithms all of them.
READY = [block for block in BLOCKS if all(map(find_spec, IMPORT.findall(block)))]


def _compute_by_one_start(compute: Callable[..., Facts], instance: gaitbench.Instance, starts: int) -> Facts:
    return compute(instance, 1)


@pytest.mark.parametrize("block", READY, ids=[re.sub(r"\W+", " ", block.splitlines()[0]) for block in READY])
def test_python_of_the_page_runs(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As pasted, in an empty folder. A drawn instance gets one start of IPOPT."""
    monkeypatch.chdir(tmp_path)
    if "generate(" in block:
        monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))  # where its best known point is stored
        monkeypatch.setattr(instances, "compute_facts", partial(_compute_by_one_start, instances.compute_facts))
    instance = gaitbench.load("ssp-v5")
    X = np.random.default_rng(0).uniform(instance.lower, instance.upper, (3, len(instance.names)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the packages
        exec(block, {"gaitbench": gaitbench, "X": X, "x": X[0]})
    assert "my-runs" not in block or (tmp_path / "my-runs").exists()  # ioh's own default is where it was imported


def test_the_page_shows_every_adapter() -> None:
    assert [name for name in ADAPTERS if f'to("{name}")' not in PAGE.read_text(encoding="utf-8")] == []
