"""Settings of every test."""

import gc
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any

import pytest
from hypothesis import settings
from typer.main import get_command

from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.formulation import GaitProblem, registry
from nlp_gait.providers import PROBLEMS
from nlp_gait.robots.loading import is_robot_file
from tests.compilers import hide_compilers

# The same examples on every run; no deadline, since the first call of a compiled or symbolic function is slow.
settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile("reproducible")

# Else each worker and each process that a test starts compiles every module again, and pytest rewrites every test again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Problems that tests share are never garbage; to look through them again and again takes 3 % of the time.
gc.set_threshold(100_000, 20, 100)

# A shell ignores Ctrl-C for what it runs in the background, and so would all that the tests of it start.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Programs that pip does not install, and that tests marked `program` need.
PROGRAMS = ("Rscript", "julia", "mkoctfile", "octave-cli", "pdflatex")

# Folders of tests that start whole commands, studies and papers; other slow tests are marked where they stand.
SLOW_FOLDERS = tuple(f"tests/compare/{name}/" for name in ("cli", "papers", "questions"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Processors that this process may use; where it may not use all, the operating system's count is too large."""
    return available_cores()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what lies in these folders, and leave out what needs a program that is not installed."""
    without = []
    for item in items:
        if item.nodeid.startswith(SLOW_FOLDERS):
            item.add_marker(pytest.mark.slow)
        needed = {name for mark in item.iter_markers("program") for name in mark.args}
        assert needed <= set(PROGRAMS), item.nodeid
        if not all(map(shutil.which, needed)):
            without.append(item)
    if without:
        items[:] = [item for item in items if item not in without]
        config.hook.pytest_deselected(items=without)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the programs whose tests were left out; pytest-xdist's processes do not count them."""
    if missing := [name for name in PROGRAMS if shutil.which(name) is None]:
        terminalreporter.write_line(f"left out, for these programs are not installed: {', '.join(missing)}")


@contextmanager
def _replace_pictures(name: str) -> Iterator[None]:
    from tests.compare import pictures  # Matplotlib takes half of the time of an empty run

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("compare.report.writing.render_svg", getattr(pictures, name))
        yield


@pytest.fixture(scope="module")
def coarse_pages() -> Iterator[None]:
    """Draw each picture of a page once and small, for files whose tests do not measure the pictures of their pages."""
    with _replace_pictures("render_coarsely"):
        yield


@pytest.fixture
def coarse_pictures() -> Iterator[None]:
    """Do so for a test."""
    with _replace_pictures("render_coarsely"):
        yield


@pytest.fixture(scope="module")
def undrawn_pages() -> Iterator[None]:
    """Draw none, for files about commands and records, whose pictures are drawn by the tests of reports and questions."""
    with _replace_pictures("render_nothing"):
        yield


@pytest.fixture
def undrawn_pictures() -> Iterator[None]:
    """Do so for a test."""
    with _replace_pictures("render_nothing"):
        yield


@pytest.fixture
def without_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no compiler be found."""
    hide_compilers(monkeypatch)


@pytest.fixture(scope="session", autouse=True)
def commands_declared_once() -> Iterator[None]:
    """Typer makes the commands from their declarations once, not at each call."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("typer.testing._get_command", cache(get_command))
        yield


@pytest.fixture(scope="session", autouse=True)
def built_once() -> Iterator[None]:
    """Every problem of the package is loaded once for all tests, with all that is built from it.

    What is built from a problem's mathematics never changes, so that copies share it in use too. A robot file is always read
    again: the file of another test may have the same name.
    """
    find = registry.find_maker

    @cache
    def made(name: str, options: tuple[tuple[str, str, Any], ...]) -> GaitProblem:
        return find(name)(**{option: value for option, _, value in options})

    @cache
    def shared_maker(name: str) -> Callable[..., GaitProblem]:
        make = find(name)

        @wraps(make)
        def shared(**options: Any) -> GaitProblem:
            robot = options.get("robot", "")
            if isinstance(robot, str) and is_robot_file(robot):
                return make(**options)
            registry.check_options(make, options)  # first, for what is not hashable
            return made(name, tuple((option, type(value).__name__, value) for option, value in options.items()))

        return shared

    def maker_of(name: str) -> Callable[..., GaitProblem]:
        return shared_maker(name) if name in PROBLEMS else find(name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "find_maker", maker_of)
        yield
