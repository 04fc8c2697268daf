"""The report in a real headless browser: no console message, no request, sortable tables, nothing beside the page."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from compare.report import write_report
from compare.study.settings import Manifest
from tests.compare.records import study

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(BROWSER is None, reason="no Chromium here")]

QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)
# Appended to a copy of the page: clicks heads of the first table and leaves what it found in the title.
PROBE = """
<script>
const table = document.querySelector("table");
const column = (i) => [...table.tBodies[0].rows].map((row) => row.cells[i].textContent);
const heads = [...table.tHead.rows[0].cells].map((cell) => cell.textContent);
const median = heads.indexOf("median"), gap = heads.indexOf("median gap");
const found = { heads };
table.tHead.rows[0].cells[median].querySelector("button").click();
found.up = column(median);
table.tHead.rows[0].cells[median].querySelector("button").click();
found.down = column(median);
table.tHead.rows[0].cells[0].click();
found.names = column(0);
found.sorted = [...table.tHead.rows[0].cells].map((cell) => cell.getAttribute("aria-sort"));
found.page = [document.documentElement.scrollWidth, innerWidth];
found.figures = [...document.querySelectorAll("figure svg")].map((svg) => svg.getBoundingClientRect().height);
const parts = [...document.querySelectorAll("table, figure svg, p, h1, h2, h3")];
found.right = Math.max(...parts.map((part) => part.getBoundingClientRect().right));
found.width = innerWidth;
found.loaded = performance.getEntriesByType("resource").map((entry) => entry.name);
document.title = JSON.stringify(found);
</script>
"""


def browse(page: Path, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Open a page in a new browser."""
    profile = folder / "profile"
    assert BROWSER is not None
    command = [BROWSER, *QUIET, f"--user-data-dir={profile}", "--enable-logging=stderr", *options, page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    shutil.rmtree(profile, ignore_errors=True)
    assert done.returncode == 0, done.stderr
    messages = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not messages, messages
    return done


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browser")
    write_report(folder, study(), Manifest(settings=None, sessions=()))
    return folder / "report.html"


@pytest.mark.parametrize("width", [1280, 400])
def test_tables_sort_and_the_page_fits(page: Path, width: int, tmp_path: Path) -> None:
    probed = tmp_path / "probed.html"
    probed.write_text(page.read_text(encoding="utf-8").replace("</body>", PROBE + "</body>"), encoding="utf-8")
    done = browse(probed, tmp_path, f"--window-size={width},900", "--dump-dom")
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title is not None
    found = json.loads(title.group(1).replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    assert found["up"] == ["10.000000 W", "10.500000 W", "10.550000 W"]
    assert found["down"] == found["up"][::-1]
    assert found["names"] == ["colony", "newton", "swarm"]
    assert found["sorted"] == ["ascending", *[None] * (len(found["heads"]) - 1)]
    assert found["page"][0] <= found["page"][1]  # wide tables scroll in themselves
    assert width > 400 or found["right"] <= found["width"]  # on a phone no part of it is wider than the screen
    assert len(found["figures"]) == 3 and min(found["figures"]) > 50
    assert found["loaded"] == []


def test_a_page_that_loads_something_is_noticed(page: Path, tmp_path: Path) -> None:
    """The page's own policy blocks it, with a message on the console: what the test above would see."""
    probed = tmp_path / "probed.html"
    image = '<img src="http://127.0.0.1:9/x.png">'
    probed.write_text(page.read_text(encoding="utf-8").replace("</main>", image + "</main>"), encoding="utf-8")
    with pytest.raises(AssertionError, match="127.0.0.1:9"):
        browse(probed, tmp_path, "--dump-dom")
