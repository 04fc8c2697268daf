"""Settings of every test."""

import gc
import os
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import settings

from nlp_gait.backends.kernel.compiled import available_cores

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
def _draw_coarsely() -> Iterator[None]:
    from matplotlib.backend_bases import get_registered_canvas_class, register_backend

    from tests.compare.pictures import CoarseCanvas  # Matplotlib takes half of the time of an empty run

    usual = get_registered_canvas_class("svg")
    register_backend("svg", CoarseCanvas)
    yield
    register_backend("svg", usual)


@pytest.fixture(scope="module")
def coarse_pages() -> Iterator[None]:
    """Draw each picture of a page once and small, for files whose tests do not measure the pictures of their pages."""
    with _draw_coarsely():
        yield


@pytest.fixture
def coarse_pictures() -> Iterator[None]:
    """Do so for a test."""
    with _draw_coarsely():
        yield


@pytest.fixture
def without_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no compiler be found; Zig's is a package, not a program of the path."""
    for name, value in (("CXX", ""), ("CC", ""), ("PATH", "no-programs")):
        monkeypatch.setenv(name, value)
    monkeypatch.setitem(sys.modules, "ziglang", None)
