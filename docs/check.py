"""Check a site that was built: ``python -m docs.check SITE``.

Every link within the site leads to a page and an anchor that are there, nothing is loaded from elsewhere, no page is empty; and,
where there is a Chromium, no page is wider than a screen of 1,280 or of 400 pixels.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

LOADING = {
    "script": "src",
    "img": "src",
    "link": "href",
    "iframe": "src",
    "source": "src",
    "video": "src",
    "object": "data",
}
FEWEST_LETTERS = 200  # of a page's main part
WIDTHS = (1280, 400)
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-quic",
)
PROBE = """<!DOCTYPE html><title></title><body style="margin: 0"><script>
const pages = %s, width = %d, found = {};
const next = () => {
  const page = pages.shift();
  if (!page) { document.title = JSON.stringify(found); return; }
  const frame = document.createElement("iframe");
  frame.style = `border: 0; width: ${width}px; height: 900px`;
  frame.onload = () => {
    const shown = frame.contentDocument.documentElement;
    const wide = [...frame.contentDocument.querySelectorAll("main *, article *")].filter((part) => {
      const box = part.getBoundingClientRect();
      if (box.right <= width + 1 || box.width === 0) return false;
      for (let up = part.parentElement; up; up = up.parentElement)
        if (["auto", "scroll", "hidden"].includes(frame.contentWindow.getComputedStyle(up).overflowX)) return false;
      return true;
    });
    found[page] = [shown.scrollWidth, wide.slice(0, 3).map((part) => part.outerHTML.slice(0, 120))];
    frame.remove();
    next();
  };
  frame.src = page;
  document.body.append(frame);
};
next();
</script>"""


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
            faults += _faults_of_link(link, path, name, pages)
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
    known = {p.resolve(): page for p, page in pages.items()}.get(target) if anchor else None
    return (
        [f"{name} links to {link}, which has no such anchor"] if known and unquote(anchor) not in known.anchors else []
    )


def wide_pages(site: Path, browser: str, width: int, *, dark: bool) -> list[str]:
    """Pages that are wider than a screen, as a browser lays them out."""
    pages = sorted(path.relative_to(site).as_posix() for path in site.rglob("*.html"))
    with tempfile.TemporaryDirectory() as folder:
        probe = site / "_probe.html"
        probe.write_text(PROBE % (json.dumps(pages), width), encoding="utf-8")
        try:
            colours = [f"--blink-settings=preferredColorScheme={0 if dark else 1}"]
            options = [
                "--allow-file-access-from-files",
                f"--window-size={width + 20},1000",
                f"--user-data-dir={folder}",
            ]
            command = [
                browser,
                *QUIET,
                *colours,
                *options,
                "--virtual-time-budget=600000",
                "--dump-dom",
                probe.as_uri(),
            ]
            done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        finally:
            probe.unlink()
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    found = json.loads(unescape(title[1])) if title and title[1] else {}
    missing = [f"{page} could not be shown" for page in pages if page not in found]
    return missing + [
        f"{page} is {total} pixels wide on a screen of {width}: {parts}"
        for page, (total, parts) in found.items()
        if total > width or parts
    ]


def main() -> None:
    """Print what is wrong and end with status 1, or say what was checked."""
    site = Path(sys.argv[1]).resolve()
    faults = faults_of(site)
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is not None:
        faults += [fault for width in WIDTHS for fault in wide_pages(site, browser, width, dark=width == WIDTHS[1])]
    for fault in faults:
        print(fault)
    shown = (
        f"laid out at {' and '.join(map(str, WIDTHS))} pixels" if browser else "not laid out: there is no Chromium here"
    )
    print(f"{len(list(site.rglob('*.html')))} pages, {len(faults)} faults; {shown}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
