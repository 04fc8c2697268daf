"""Candidates per second in the playground, in a real browser: ``python -m benchmarks.playground``.

Needs the extras compiler and test, and a Chromium. Prints the speed of three races of 750,000 evaluations, as the page shows
it, and the speed of the module alone, without searches and drawing.
"""

from __future__ import annotations

import shutil
import sys
import time
from typing import Any

from playwright.sync_api import sync_playwright

from docs.pages.playground import make_page

RACES = 3
MODULE = """() => {
  const { model } = playground, random = new Random(1);
  const points = random.points(50, model.variables.length).map((unit) => model.scale(unit));
  const start = performance.now();
  let count = 0;
  for (; performance.now() - start < 3000; count += points.length) model.evaluate(points);
  return (1000 * count) / (performance.now() - start);
}"""


def main() -> None:
    """Measure and print."""
    browser_path = shutil.which("chromium") or shutil.which("google-chrome") or sys.exit("there is no Chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page()
        page.set_content(make_page())
        _wait(page, "document.body.dataset.ready === 'yes'")
        print(f"module alone: {page.evaluate(MODULE):,.0f} candidates per second")
        page.select_option("text=evaluations each", "250000")
        for _ in range(RACES):
            page.click("#race .again")
            _wait(page, "!playground.race.running")
            print(f"race: {page.inner_text('#race .speed')}", flush=True)
        print(page.inner_text("#race table"))
        browser.close()


def _wait(page: Any, condition: str) -> None:
    """Poll, as the page forbids `eval`."""
    while not page.evaluate(condition):
        time.sleep(0.1)


if __name__ == "__main__":
    main()
