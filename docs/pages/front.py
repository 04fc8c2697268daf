"""What visitors open first: a real report to explore, a page in 3-D of the best known gait of each problem, the playground.

``python -m docs.pages.front docs/generated`` writes them, beside Sphinx.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from compare.report.interactive import animate_gait
from docs.difficulty import difficulties
from docs.pages.playground import FOLDER, write_playground
from docs.pages.problems import GAITS, names
from nlp_gait.formulation import load

STUDY = ("nao-ssp", "--algorithms", "pso,ga,aco,cma", "--runs", "5", "--starts", "5", "--evaluations", "5000")
REPORT = "report.html"  # at the root of the site


def write(folder: Path) -> None:
    """Run a small study, and write its report and the gaits where the site takes them from."""
    site, study = folder / FOLDER, folder / "study"
    command = [sys.executable, "-m", "compare", "compare", *STUDY, "--out", str(study)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=Path(__file__).parents[2])
    (site / GAITS).mkdir(parents=True, exist_ok=True)
    shutil.copyfile(study / REPORT, site / REPORT)
    measured = difficulties()
    for name in names():
        problem, found = load(name), measured.get(name)
        if found is not None and found.best is not None and problem.display.skeleton is not None:
            animate_gait(problem, found.best.x, "best known").write(site / GAITS / f"{name}.html")


if __name__ == "__main__":
    write_playground(Path(sys.argv[1]))
    write(Path(sys.argv[1]))
