"""Tests that need a package of an extra are skipped where it is not installed; the reason names the extra."""

from __future__ import annotations

import re
from importlib.util import find_spec
from typing import TypeVar

import pytest

# Modules by the extra of pyproject.toml that installs them.
PACKAGES = {
    "algorithms": ("cma", "pymoo", "optuna", "ioh", "pygmo"),
    "browser": ("playwright", "axe_playwright_python"),
    "cluster": ("dask", "distributed"),
    "dev": ("iohinspector",),
    "docs": ("sphinx_gallery", "nbclient", "latex2mathml", "ziglang"),
    "sim": ("mujoco",),
    "test": ("flint", "pandas", "pinocchio"),
    "urdf": ("lxml",),
}
EXTRAS = {module: extra for extra, modules in PACKAGES.items() for module in modules}
EXTRA = re.compile(r"nlp-gait\[(\w+)\]")
IMPORT = re.compile(r"could not import '(\w+)")

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)


def find_missing(error: BaseException | str) -> list[str]:
    """Return the packages that an error says are needed and that are not installed."""
    if isinstance(error, ModuleNotFoundError):
        package = (error.name or "").partition(".")[0]
        needed = (package,) if package in EXTRAS else ()
    else:
        text = str(error)
        needed = tuple(p for extra in EXTRA.findall(text) for p in PACKAGES.get(extra, ()))
        needed += ("pandas",) * ("pip install pandas" in text)
    return sorted({package for package in needed if find_spec(package) is None})


def skip_without_extra(error: BaseException | str) -> None:
    """Skip the test if a package is missing that the error says is needed; otherwise do nothing."""
    if missing := find_missing(error):
        pytest.skip(" and ".join(map(describe, missing)))


def describe(module: str) -> str:
    """Return which module is missing, and the extra that installs it."""
    return (
        f"no module {module}: pip install 'nlp-gait[{EXTRAS[module]}]'" if module in EXTRAS else f"no module {module}"
    )


def name_extra(report: Report) -> Report:
    """Return a report whose reason names the extra, if ``pytest.importorskip`` skipped the test."""
    if report.skipped and isinstance(report.longrepr, tuple):
        path, line, reason = report.longrepr
        if found := IMPORT.search(reason):
            report.longrepr = (path, line, f"Skipped: {describe(found[1])}")
    return report
