"""Modules of tests that need a package of another extra than ``test`` are skipped without it; the reason names the extra."""

from typing import Any

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


def need(package: str) -> Any:
    """Import a package, or skip what asks for it: the test, the fixture's tests or the whole module."""
    return pytest.importorskip(package, reason=f"no {package}: pip install 'nlp-gait[{EXTRAS[package]}]'")


def need_browser() -> None:
    """Skip the module without Playwright or without a browser for it."""
    need("playwright")
    if BROWSER is None:
        pytest.skip("no Chromium: apt-get install chromium", allow_module_level=True)
