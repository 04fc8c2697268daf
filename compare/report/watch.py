"""A report that is rewritten while its study runs; the open page reloads itself."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from compare.study.record_files import RECORDS
from nlp_gait.files import write_text

RELOAD = '<head>\n<meta http-equiv="refresh" content="5">'  # seconds between reloads of the page
POLL_S = 2.0


def watch_report(folder: Path, rewrite: Callable[[], object], sleep: Callable[[float], None] = time.sleep) -> None:
    """Rewrite the report of a folder after every change of its records until Ctrl-C; its page reloads itself meanwhile.

    ``rewrite`` writes the report. A folder without records is waited for.
    """
    page, shown = folder / "report.html", None
    try:
        while True:
            records = {path: path.stat().st_mtime_ns for path in (folder / RECORDS).glob("*/*.json")}
            if records and records != shown:
                rewrite()
                write_text(page, page.read_text(encoding="utf-8").replace("<head>", RELOAD, 1))
                shown = records
            sleep(POLL_S)
    except KeyboardInterrupt:
        return
