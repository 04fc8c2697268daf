"""Test matrix: each Python that is installed, with the newest dependencies and with the oldest ones.

    nox                          # the fast tests on each Python, with the oldest dependencies, lint and types
    nox -s newest-3.13           # one of them
    nox -s newest-3.13 -- tests  # with other arguments of pytest: here all tests

A Python that is not installed is skipped with a warning. ``uv`` makes the environments where it is there; it is not needed.
"""

from __future__ import annotations

import nox

PYTHONS = ("3.11", "3.12", "3.13")
FAST = ("-m", "not slow")
# As pip does; else Python compiles while the tests take warnings for errors, and cma 3.3.0 has one.
COMPILED = {"UV_COMPILE_BYTECODE": "1"}

nox.needs_version = ">=2024.4"
nox.options.default_venv_backend = "uv|virtualenv"
nox.options.error_on_missing_interpreters = False


@nox.session(python=PYTHONS)
def newest(session: nox.Session) -> None:
    """Tests with the newest dependencies that pyproject.toml allows."""
    session.install("--upgrade", ".[test]", env=COMPILED)
    _test(session)


@nox.session(python=PYTHONS[0])
def oldest(session: nox.Session) -> None:
    """Tests with the oldest dependencies, of ``.ci/lowest.txt``."""
    session.install("-r", ".ci/lowest.txt", env=COMPILED)
    session.install("--no-deps", ".")
    _test(session)


@nox.session(python=PYTHONS[0])
def lint(session: nox.Session) -> None:
    """Style and types, as CI checks them."""
    session.install("--upgrade", ".[test,dev]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")


def _test(session: nox.Session) -> None:
    # Caches of its own: compiled code of another Python's CasADi is another file, but a test may count files.
    environment = {"MPLBACKEND": "Agg", "XDG_CACHE_HOME": session.create_tmp()}
    session.run("python", "-m", "pytest", "-p", "no:cacheprovider", *(session.posargs or FAST), env=environment)
