"""Python files in the working folder never run, whatever module they are called after."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from tests.faults.processes import ROOT

LOADED = (
    "multiprocessing.resource_tracker",
    "resource",
    "compare.cli",
    "compare.report",
    "casadi",
    "scipy.optimize",
    "matplotlib.figure",
)
# As the installed script: neither the script's folder nor the working folder is searched.
PROGRAM = (
    f"import sys; sys.path.insert(0, {str(ROOT)!r}); from compare.__main__ import main; import compare.report; main()"
)
CALLS = (
    tuple("compare walk12 --algorithms pso --starts 0 --runs 2 --evaluations 60 --jobs 2 --out ../out".split()),
    ("solve", "walk12", "--starts", "1"),
)


@pytest.mark.commit
def test_no_file_of_the_working_folder_runs(tmp_path: Path) -> None:
    for name in LOADED:
        importlib.import_module(name)
    loaded = {name.partition(".")[0] for name in sys.modules}
    assert len(loaded) > 150
    bait = tmp_path / "bait"
    bait.mkdir()
    for name in loaded:
        (bait / f"{name}.py").write_text(f"open('{tmp_path}/ran-{name}', 'w')\n", encoding="utf-8")
    for call in CALLS:
        command = [sys.executable, "-P", "-c", PROGRAM, *call]
        done = subprocess.run(command, cwd=bait, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
    assert not list(tmp_path.glob("ran-*"))
