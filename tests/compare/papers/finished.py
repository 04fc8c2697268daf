"""A quick reproduction from end to end, and what every one has to write."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from compare.papers import load_reproduction
from compare.report import writing
from tests.compare.pictures import save_coarsely
from tests.compilers import hide_compilers


@dataclass(kw_only=True)
class Finished:
    """Folder of a quick reproduction, with its findings and lines of progress."""

    paper: str
    folder: Path
    effort: Any
    findings: Any = None
    progress: list[str] = field(default_factory=list)

    def rows(self, table: str) -> list[dict[str, str]]:
        return list(csv.DictReader((self.folder / f"{table}.csv").read_text().splitlines()))

    @property
    def report(self) -> str:
        return (self.folder / "report.md").read_text()


def reproduce(
    paper: str,
    folder: Path,
    *,
    coarse: bool = False,
    drawn: Collection[str] = (),
    compiled: bool = True,
    **changes: Any,
) -> Finished:
    """Run in this process, since workers would build every problem again; coarse pictures are drawn once and small.

    ``drawn`` are the only ones that are drawn, if it names any; others, of the same kinds, are not drawn.

    Without ``compiled`` no compiler is found. ``changes`` are those of the quick effort.
    """
    reproduction = load_reproduction(paper)
    finished = Finished(paper=paper, folder=folder, effort=replace(reproduction.quick, **changes))
    with pytest.MonkeyPatch.context() as patch:
        if coarse:
            patch.setattr(writing, "save", partial(save_coarsely, drawn=drawn))
        if not compiled:
            hide_compilers(patch)
        finished.findings = reproduction.reproduce(folder, finished.effort, finished.progress.append, jobs=1)
    return finished


def recompute(finished: Finished, stop_at: str = "figures") -> list[str]:
    """Rerun until a line of progress that begins so; returns the lines about what was not stored."""
    progress: list[str] = []

    def stop(line: str) -> None:
        if "stored by an earlier run" not in line:
            progress.append(line)
        if line.startswith(stop_at):
            raise KeyboardInterrupt

    reproduction = load_reproduction(finished.paper)
    try:
        reproduction.reproduce(finished.folder, finished.effort, stop, jobs=1)
    except KeyboardInterrupt:
        return progress
    raise AssertionError(f"no line began with {stop_at}")


def check_report(finished: Finished, figures: str, tables: str) -> None:
    """Every place in the text is filled, and every table and figure written."""
    folder, effort = finished.folder, finished.effort
    text = finished.report.partition("## Versions")[0]  # settings of solvers have braces
    assert "{" not in text and "nan" not in re.sub(r"\b[a-z]*nan[a-z]+\b", "", text)
    assert re.findall(r"\((\S+)\.png\)", finished.report) == figures.split()
    assert all((folder / f"{name}.{kind}").stat().st_size > 1000 for name in figures.split() for kind in ("png", "svg"))
    assert (folder / "report.html").read_text().count("<svg") == len(figures.split())
    assert {path.stem for path in folder.glob("*.csv")} == set(tables.split())
    assert all(finished.rows(name) for name in tables.split())
    assert effort.steps is None or len(finished.progress) == effort.steps
