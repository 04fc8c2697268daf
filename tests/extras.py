"""Tests that need a package of an extra are skipped with its name where it is not installed."""

from __future__ import annotations

import re
from importlib.util import find_spec

import pytest

# Packages by the extra of pyproject.toml that a message names.
PACKAGES = {
    "algorithms": ("cma", "pymoo", "optuna"),
    "bayes": ("egobox",),
    "cluster": ("dask", "distributed"),
    "sim": ("mujoco",),
    "suites": ("pymoo", "cma", "ioh", "pygmo"),
    "urdf": ("urdf_parser_py", "lxml"),
    "video": ("imageio_ffmpeg",),
}
OTHERS = ("flint", "iohinspector", "pandas", "pinocchio")
EXTRA = re.compile(r"nlp-gait\[(\w+)\]")


def find_missing(error: BaseException | str) -> list[str]:
    """Return the packages that an error says are needed and that are not installed."""
    if isinstance(error, ModuleNotFoundError):
        package = (error.name or "").partition(".")[0]
        needed = (package,) if package in {*OTHERS, *(p for extra in PACKAGES.values() for p in extra)} else ()
    else:
        text = str(error)
        needed = tuple(p for extra in EXTRA.findall(text) for p in PACKAGES.get(extra, ()))
        needed += ("pandas",) * ("pip install pandas" in text)
    return sorted({package for package in needed if find_spec(package) is None})


def skip_without_extra(error: BaseException | str) -> None:
    """Skip the test if a package is missing that the error says is needed; otherwise do nothing."""
    if missing := find_missing(error):
        pytest.skip(f"{' and '.join(missing)} not installed")
