"""Progress on a terminal: one line of at most 80 columns that is rewritten; in a log, a line every half minute."""

import io
import re
import time

import pytest

from compare.cli import printing
from compare.cli.printing import PlainConsole, format_duration, say, show_progress


def test_a_line_is_rewritten_and_removed(monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.StringIO()
    monkeypatch.setattr(printing, "stderr", PlainConsole(file=written, force_terminal=True, width=100))
    with show_progress("runs", 106) as advance:
        advance("stored", 100)
        time.sleep(0.3)
        advance("best gap 0.0046 % (nao-ssp, ACO), and a name that is much too long for what is left of the line")
        time.sleep(0.5)
        say("a sentence")
    lines = [line for line in re.split(r"\x1b\[[?\d]*[a-zA-Z]|[\r\n]", written.getvalue()) if line]
    assert "a sentence" in lines and max(map(len, lines)) <= 79
    assert any(line.startswith("runs 100 of 106, 0 s, stored") for line in lines)
    last = next(line for line in reversed(lines) if line.startswith("runs 101 of 106, "))
    assert " s left, best gap 0.0046 % (nao-ssp, ACO)" in last
    assert 2.0 <= float(last.split(", ")[1].split()[0]) <= 10.0  # 5 runs, the only one of this command took 0.3 to 2 s


def test_a_log_has_a_line_every_half_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    written, now = io.StringIO(), [0.0]
    monkeypatch.setattr(printing, "stderr", PlainConsole(file=written))
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with show_progress("starts", None) as advance:
        for second in range(70):
            now[0] = float(second)
            advance(f"start {second}")
    assert written.getvalue().splitlines() == ["starts 31, 30 s, start 30", "starts 61, 60 s, start 60"]


def test_durations_have_two_digits() -> None:
    assert [format_duration(s) for s in (0.4, 99.0, 240.0, 9000.0)] == ["0 s", "99 s", "4 min", "2.5 h"]
