"""Check a site that was built: ``python -m docs.check SITE``.

Every link within the site leads to a page and an anchor that are there, nothing is loaded from elsewhere, no page is empty. Where
Chromium, Playwright and axe are installed, each page is opened at 1,280 pixels, light, and at 400, dark: no message on the
console, no request outside the site, nothing wider than the screen; and of some pages of each folder no serious fault of
accessibility.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

import pytest

from docs.browser import SCREENS, list_accessibility_faults, list_wide_parts, open_screen, show, start_browser

LOADING = {
    "script": "src",
    "img": "src",
    "link": "href",
    "iframe": "src",
    "source": "src",
    "video": "src",
    "object": "data",
}
FEWEST_LETTERS = 100  # of a page; that of an animation has little text beside its figure
ALIKE = 5  # pages of a folder whose accessibility is examined, which takes longest, each on one of the screens in turn


class Page(HTMLParser):
    """Anchors, links, loaded files and letters of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.letters = 0
        self._silent = 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note what an element names or asks for."""
        given = dict(attrs)
        self.anchors |= {value for name in ("id", "name") if (value := given.get(name))}
        if tag == "a" and given.get("href"):
            self.links.append(str(given["href"]))
        if (
            tag in LOADING
            and given.get(LOADING[tag])
            and given.get("rel") not in ("canonical", "index", "next", "prev", "search")
        ):
            self.loads.append(str(given[LOADING[tag]]))
        self._silent += tag in ("script", "style")

    def handle_endtag(self, tag: str) -> None:
        """Ignore text within scripts."""
        self._silent -= tag in ("script", "style")

    def handle_data(self, data: str) -> None:
        """Count letters."""
        self.letters += 0 if self._silent else len(data.strip())


def faults_of(site: Path) -> list[str]:
    """What is wrong with links, loaded files and pages without content, a sentence each."""
    pages = {path: Page(path) for path in sorted(site.rglob("*.html"))}
    known = {path.resolve(): page for path, page in pages.items()}
    faults = []
    for path, page in pages.items():
        name = path.relative_to(site)
        if page.letters < FEWEST_LETTERS:
            faults.append(f"{name} has no content")
        for target in page.loads:
            if re.match(r"(https?:)?//", target):
                faults.append(f"{name} loads {target}")
            elif not target.startswith("data:") and not (path.parent / unquote(target.split("?")[0])).exists():
                faults.append(f"{name} loads {target}, which is not there")
        for link in page.links:
            faults += _faults_of_link(link, path, name, known)
    for sheet in site.rglob("*.css"):
        outside = re.findall(r"(?:url\(|@import )[\"']?((?:https?:)?//[^\"')]+)", sheet.read_text(encoding="utf-8"))
        faults += [f"{sheet.relative_to(site)} loads {target}" for target in outside]
    return faults


def _faults_of_link(link: str, path: Path, name: Path, pages: dict[Path, Page]) -> list[str]:
    if re.match(r"[a-z]+:|//", link):
        return []
    address, anchor = urldefrag(link)
    target = (path.parent / unquote(address)).resolve() if address else path.resolve()
    if not target.exists():
        return [f"{name} links to {link}, which is not there"]
    known = pages.get(target) if anchor else None
    return (
        [f"{name} links to {link}, which has no such anchor"] if known and unquote(anchor) not in known.anchors else []
    )


def list_shown_faults(site: Path, *, all_screens: bool = False) -> list[str]:
    """What a browser finds on every page: messages, requests, parts that are too wide, and serious faults of accessibility.

    Pages are opened on the screens in turn, or each on all of them.
    """
    faults, paths = [], sorted(site.rglob("*.html"))
    with start_browser() as browser:
        for turn, screen in enumerate(SCREENS):
            examined = list_examined(paths, turn)
            with open_screen(browser, screen) as opened:
                for number, path in enumerate(paths):
                    if not all_screens and number % len(SCREENS) != turn:
                        continue
                    show(opened, path)
                    found = [f"says {message!r}" for message in opened.messages]
                    found += [f"requests {url}" for url in opened.requests if not url.startswith(site.as_uri())]
                    found += [f"has a part that is too wide: {part}" for part in list_wide_parts(opened.page)]
                    if path in examined:
                        found += [f"is hard to access: {fault}" for fault in list_accessibility_faults(opened.page)]
                    faults += [f"{path.relative_to(site)}, {screen}: {fault}" for fault in found]
    return faults


def list_examined(paths: Sequence[Path], turn: int) -> set[Path]:
    """Return the pages whose accessibility is examined on one of the screens: some of each folder, on each screen in turn."""
    examined, before = set(), Counter[Path]()
    for number, path in enumerate(paths):
        before[path.parent] += 1
        if before[path.parent] <= ALIKE and number % len(SCREENS) == turn:
            examined.add(path)
    return examined


def main() -> None:
    """Print what is wrong and end with status 1, or say what was checked."""
    site = Path(sys.argv[1]).resolve()
    faults, shown = faults_of(site), f"opened at {' and '.join(SCREENS)}"
    try:
        faults += list_shown_faults(site, all_screens="--all-screens" in sys.argv)
    except pytest.skip.Exception as reason:
        shown = f"not opened: {reason}"
    for fault in faults:
        print(fault)
    print(f"{len(list(site.rglob('*.html')))} pages, {len(faults)} faults; {shown}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
