"""Progress on a terminal: one line of at most 80 columns that is rewritten; in a log, a line every few seconds."""

import io
import re
import time

import pytest

from compare.cli import command
from compare.cli.command import PlainConsole, format_duration, report_silence, say, show_progress


def test_a_line_is_rewritten_and_removed(monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.StringIO()
    monkeypatch.setattr(command, "stderr", PlainConsole(file=written, force_terminal=True, width=100))
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


def test_a_log_has_lines_also_during_one_long_step(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "LOG_PERIOD_S", 0.1)

    def wait_for(line: str) -> None:
        lines, start = list[str](), time.monotonic()
        while line not in lines:
            assert time.monotonic() < start + 20.0, lines
            lines = re.sub(r"\d+ s", "_ s", capfd.readouterr().err).splitlines()

    with report_silence("nlp-gait solve"):
        wait_for("nlp-gait solve is at work, _ s")
        with show_progress("starts") as advance:
            wait_for("starts, _ s")
            advance("start 0")
            wait_for("starts 1, _ s, start 0")
        wait_for("nlp-gait solve is at work, _ s")


def test_durations_have_two_digits() -> None:
    assert [format_duration(s) for s in (0.4, 99.0, 240.0, 9000.0)] == ["0 s", "99 s", "4 min", "2.5 h"]
