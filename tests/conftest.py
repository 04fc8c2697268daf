"""Settings of every test."""

import gc
import os
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import settings

from nlp_gait.backends.kernel.compiled import available_cores

# The same examples on every run; no deadline, since the first call of a compiled or symbolic function is slow.
settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.register_profile("nightly", deadline=None, print_blob=True)
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

# Processor time of tests that take longer than SLOW_S, a line for each function: that of its longest case [s].
TIMES = Path(__file__).with_name("times.txt")
SLOW_S, NIGHTLY_S = 0.25, 2.0
BEGUN = pytest.StashKey[float]()
measured: dict[str, float] = {}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that rewrites ``times.txt``."""
    parser.addoption(
        "--record-times", action="store_true", help=f"write the processor time of slow tests to {TIMES.name}"
    )


def read_times() -> dict[str, float]:
    """Return the recorded times of slow tests by name [s]."""
    lines = (line.split(maxsplit=1) for line in TIMES.read_text(encoding="utf-8").splitlines())
    return {name: float(seconds) for seconds, name in lines}


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Note the processor time of this process and of those that it waited for."""
    item.stash[BEGUN] = sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Add the processor time of a test to its last report."""
    report = yield
    if call.when == "teardown":
        report.user_properties.append(("processor_s", sum(os.times()[:4]) - item.stash.get(BEGUN, sum(os.times()[:4]))))
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Keep the processor time of the longest case of each test."""
    if report.when == "teardown":
        name = report.nodeid.partition("[")[0]
        measured[name] = max(measured.get(name, 0.0), dict(report.user_properties)["processor_s"])


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Rewrite the times of all tests of the files that have run."""
    if session.config.getoption("--record-times") and not hasattr(session.config, "workerinput"):
        files = {name.partition("::")[0] for name in measured}
        kept = {name: seconds for name, seconds in read_times().items() if name.partition("::")[0] not in files}
        slow = {name: seconds for name, seconds in (kept | measured).items() if seconds >= SLOW_S}
        TIMES.write_text("".join(f"{slow[name]:.2f} {name}\n" for name in sorted(slow)), encoding="utf-8")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Processors that this process may use; where it may not use all, the operating system's count is too large."""
    return available_cores()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what takes long, and leave out what needs a program that is not installed."""
    without, times = [], read_times()
    for item in items:
        seconds = times.get(item.nodeid.partition("[")[0], 0.0)
        if seconds >= NIGHTLY_S and not item.get_closest_marker("commit"):
            item.add_marker(pytest.mark.nightly)
        if seconds >= SLOW_S or item.get_closest_marker("nightly"):
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
