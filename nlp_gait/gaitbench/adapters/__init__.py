"""Instances in the shape that other packages want, one package a file; each package is imported when it is asked for."""

from __future__ import annotations

from importlib.util import find_spec

from nlp_gait.errors import MissingExtraError


def check_installed(package: str) -> None:
    """Raise MissingExtraError unless a package is installed."""
    if find_spec(package) is None:
        raise MissingExtraError(
            f"to_{package.removesuffix('hub')}() needs the package {package}, which is not installed: pip install {package}, "
            "or all of them: pip install 'nlp-gait[suites]'"
        )
