"""A real browser for tests: Chromium, driven by Playwright."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
OPTIONS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
SCREENS = {"1280 light": (1280, "light"), "400 dark": (400, "dark")}


@dataclass
class Visit:
    """An open page, what its console said and what it requested besides itself."""

    page: Any
    messages: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


@contextmanager
def start_browser() -> Iterator[Any]:
    """Yield a browser."""
    from playwright import sync_api as api

    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=list(OPTIONS))
        yield browser
        browser.close()


@contextmanager
def open_screen(browser: Any, screen: str) -> Iterator[Visit]:
    """Open an empty page on a screen of ``SCREENS``."""
    width, scheme = SCREENS[screen]
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    opened = Visit(page=context.new_page())
    opened.page.on("console", lambda message: opened.messages.append(message.text))
    opened.page.on("pageerror", lambda error: opened.messages.append(str(error)))
    opened.page.on("request", lambda request: opened.requests.append(request.url))
    yield opened
    context.close()


def show(opened: Visit, file: Path) -> None:
    """Show a file, with its messages and requests alone."""
    opened.messages, opened.requests = [], []
    opened.page.goto(file.as_uri())
    opened.requests = [
        url for url in opened.requests if url != file.as_uri() and not url.startswith(("data:", "blob:"))
    ]


@contextmanager
def visit(browser: Any, file: Path, screen: str = "1280 light") -> Iterator[Visit]:
    """Open a file on a screen of ``SCREENS``."""
    with open_screen(browser, screen) as opened:
        show(opened, file)
        yield opened


def wait_for_motion(page: Any) -> None:
    """Wait until the first drawing of a gait has moved by 20 ms; polled from here, as pages forbid `eval`."""
    deadline = time.monotonic() + 30
    while not page.evaluate("() => Number(document.querySelector('canvas')?.dataset.time) > 20"):
        if time.monotonic() > deadline:
            pytest.fail("no gait moved within 30 s")
        time.sleep(0.02)


def list_wide_parts(page: Any) -> list[str]:
    """Return the parts of a page that are wider than the screen and do not scroll within themselves."""
    found: list[str] = page.evaluate(
        """() => [...document.querySelectorAll("main *, article *")].filter((part) => {
          const box = part.getBoundingClientRect();
          if (box.right <= innerWidth + 1 || box.width === 0) return false;
          for (let up = part.parentElement; up; up = up.parentElement)
            if (["auto", "scroll", "hidden"].includes(getComputedStyle(up).overflowX) || up.tagName === "svg") return false;
          return true;
        }).map((part) => part.outerHTML.slice(0, 120))"""
    )
    return found


def list_accessibility_faults(page: Any) -> list[str]:
    """Return what axe finds, serious or critical: contrast, names of controls, alternative texts.

    Contrast takes most of the time; where many elements share colours, backgrounds and font, it is measured on three of them.
    """
    from axe_playwright_python.sync_playwright import Axe

    axe = Axe()
    page.evaluate(axe.axe_script)
    violations = page.evaluate(
        """() => {
          const alike = new Map(), styles = new Map();
          const describe = (part) => {
            if (part === null) return "";
            if (!styles.has(part)) {
              const { backgroundColor, backgroundImage, opacity, filter, position } = getComputedStyle(part);
              const own = [backgroundColor, backgroundImage, opacity, filter, position].join();
              styles.set(part, `${describe(part.parentElement)}/${own}`);
            }
            return styles.get(part);
          };
          for (const part of document.body.querySelectorAll("*")) {
            const { color, fontSize, fontWeight, textShadow } = getComputedStyle(part);
            const key = [part.tagName, color, fontSize, fontWeight, textShadow, describe(part)].join();
            alike.set(key, (alike.get(key) ?? 0) + 1);
            if (alike.get(key) > 3) part.dataset.alike = "";
          }
          axe.configure({ rules: [{ id: "color-contrast", selector: ":not([data-alike])" }] });
          return axe.run({ preload: false, resultTypes: ["violations"] }).then((results) => results.violations);
        }"""
    )
    return [
        f"{fault['id']}: {node['html'][:100]}"
        for fault in violations
        if fault["impact"] in ("serious", "critical")
        for node in fault["nodes"][:3]
    ]
