"""Modules of tests that need a package of another extra than ``test`` are skipped without it; the reason names the extra."""

from importlib.util import find_spec

import pytest

from docs.browser import BROWSER

# The extra of pyproject.toml by the package that it installs.
EXTRAS = {
    "distributed": "cluster",
    "ioh": "algorithms",
    "latex2mathml": "docs",
    "nbclient": "docs",
    "playwright": "browser",
    "sphinx_gallery": "docs",
    "ziglang": "docs",
}


def need(package: str) -> None:
    """Skip what asks for a package that is not installed: the test, the fixture's tests or the whole module.

    It is not imported, since every process of pytest-xdist asks for all of them.
    """
    if find_spec(package) is None:
        pytest.skip(f"no {package}: pip install 'nlp-gait[{EXTRAS[package]}]'", allow_module_level=True)


def need_browser() -> None:
    """Skip the module without Playwright or without a browser for it."""
    need("playwright")
    if BROWSER is None:
        pytest.skip("no Chromium: apt-get install chromium", allow_module_level=True)
