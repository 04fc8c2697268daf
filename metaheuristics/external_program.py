"""A program in any language as an algorithm: it proposes points and receives their values as lines of JSON."""

import json
import math
import queue
import subprocess
import tempfile
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from time import monotonic
from typing import IO, Any

import numpy as np

from metaheuristics.errors import SearchError, abbreviate, check_number
from metaheuristics.interface import Array, CallingSearch, Ended, Evaluate, Start, to_real_array
from metaheuristics.preparation import check_points
from metaheuristics.user_algorithm import combine

LONGEST_LINE = 2**26  # bytes
LONGEST_REASON = 300  # characters of a program's last message
END_WITHIN_S = 2.0  # after the line that ends the run
CHECKED_EVERY_S = 0.1
MOST_WAITING = 2  # lines that a program may be ahead
SILENT = ": it has not sent its first line; it must flush its output, and in Octave read with input('', 's'), not fgetl(stdin)"
ROUNDING = 1e-9  # share of a range by which printed digits may miss a bound


@dataclass(frozen=True, kw_only=True)
class ExternalProgram:
    """A program that exchanges lines of JSON on its standard input and output.

    It first receives `{"names", "lower", "upper", "evaluations", "seed", "settings"}`. Then it sends `{"x": [[...], ...]}`, one
    point or many, and receives `{"f": [...], "violation": [...], "cost": [...]}`, again and again, until it receives
    `{"stop": true}`, sends `{"stop": "its reason"}` or ends with status 0. `cost` combines f and violation, see `PlainFunction`.
    A value of a failed evaluation is null. A run raises SearchError if the program cannot be started, ends with another status,
    is silent for too long, or sends a line that is no proposal.
    """

    command: tuple[str, ...]  #: program and arguments
    name: str  #: in reports
    settings: Mapping[str, Any] = field(default_factory=dict)  #: sent to the program
    population: int = 1  #: as a program has no first generation
    answer_s: float = 600.0  #: longest time between two of its lines [s]; then it is killed
    first_answer_s: float = 60.0  #: likewise, from its start to its first line

    def __post_init__(self) -> None:
        check_number(self, "answer_s", above=0.0)
        check_number(self, "first_answer_s", above=0.0)

    def start(self, start: Start) -> "_ProgramSearch":
        """Begin a run; see `Algorithm.start`."""
        return _ProgramSearch(self, start)


class _ProgramSearch(CallingSearch):
    def __init__(self, settings: ExternalProgram, start: Start) -> None:
        self._settings, self._start, self._has_answered = settings, start, False
        self._deadline = math.inf if start.time_limit_s is None else monotonic() + start.time_limit_s
        self._lines: queue.Queue[bytes | None] = queue.Queue(maxsize=MOST_WAITING)

    def run(self, evaluate: Evaluate) -> str:
        start, settings = self._start, self._settings
        with tempfile.TemporaryFile() as messages:
            pipe = subprocess.PIPE
            try:
                program = subprocess.Popen(settings.command, stdin=pipe, stdout=pipe, stderr=messages)
            except OSError as error:
                raise SearchError(f"{settings.command[0]!r} cannot be started: {error.strerror or error}") from error
            reader = threading.Thread(target=self._forward, args=(program.stdout,), daemon=True)
            reader.start()
            try:
                problem = {"names": list(start.names), "lower": start.lower.tolist(), "upper": start.upper.tolist()}
                seed = int(start.rng.integers(2**31))
                self._send(
                    program, **problem, evaluations=start.evaluations, seed=seed, settings=dict(settings.settings)
                )
                while (line := self._read(program)) is not None:
                    proposal = self._parse(line)
                    if "stop" in proposal:
                        return f"the program stopped: {abbreviate(proposal['stop'])}"
                    f, violation, rule = evaluate(self._read_points(proposal))
                    values = {"f": f, "violation": violation, "cost": combine(f, violation, rule)}
                    self._send(program, **{name: _to_list(array) for name, array in values.items()})
                self._check_ending(program, messages)
                return "the program ended"
            except Ended:
                self._send(program, stop=True)
                raise
            except TimeoutError:
                self._send(program, stop=True)
                return "time limit reached"
            finally:
                self._end(program, reader)

    def _forward(self, output: IO[bytes]) -> None:
        """Put the program's lines into the queue, and None after the last one."""
        with output:
            while line := output.readline(LONGEST_LINE):
                self._lines.put(line)
        self._lines.put(None)

    def _send(self, program: subprocess.Popen[bytes], **values: Any) -> None:
        assert program.stdin is not None
        with suppress(OSError):  # it does not listen any more; reading says how it ended
            program.stdin.write(json.dumps(values).encode() + b"\n")
            program.stdin.flush()

    def _read(self, program: subprocess.Popen[bytes]) -> bytes | None:
        """Return the program's next line, or None after the last one; raise TimeoutError at the end of the run's time."""
        limit = self._settings.answer_s if self._has_answered else self._settings.first_answer_s
        latest = monotonic() + limit
        while True:
            ended = program.poll() is not None
            if ended:  # what it has started may hold its output for ever
                latest = min(latest, monotonic() + END_WITHIN_S)
            try:
                line = self._lines.get(timeout=CHECKED_EVERY_S)
            except queue.Empty:
                if monotonic() <= min(latest, self._deadline):
                    continue
                if ended:
                    return None
                if monotonic() <= latest:
                    raise TimeoutError from None
                raise SearchError(
                    f"the program sent nothing for {limit:g} s{'' if self._has_answered else SILENT}"
                ) from None
            if line is not None and len(line) == LONGEST_LINE:
                raise SearchError(f"the program sent a line of {LONGEST_LINE} bytes or more")
            self._has_answered = True
            return line

    def _parse(self, line: bytes) -> dict[str, Any]:
        try:
            proposal = json.loads(line)
        except (ValueError, RecursionError):
            proposal = None
        if not isinstance(proposal, dict) or not proposal.keys() & {"x", "stop"}:
            shown = line[:LONGEST_REASON].decode("utf-8", "replace").strip()
            raise SearchError(
                f'the program sent {abbreviate(shown)}, which is neither {{"x": [[...], ...]}} nor {{"stop": "reason"}}'
            )
        return proposal

    def _read_points(self, proposal: dict[str, Any]) -> Array:
        """Return the points (P, n) of a proposal; digits may be rounded beyond a bound."""
        lower, upper = self._start.lower, self._start.upper
        try:
            points = np.array(to_real_array(proposal["x"]), ndmin=2)
        except (TypeError, ValueError, OverflowError) as error:
            raise SearchError(f'"x" must be points of {len(lower)} numbers: {error}') from error
        if points.ndim == 2 and points.shape[1] == len(lower):
            inside, rounding = np.clip(points, lower, upper), ROUNDING * (upper - lower)
            points = np.where(np.abs(points - inside) <= rounding, inside, points)
        return check_points(points, lower, upper, "the program")

    def _check_ending(self, program: subprocess.Popen[bytes], messages: IO[bytes]) -> None:
        try:
            status = program.wait(END_WITHIN_S)
        except subprocess.TimeoutExpired:
            raise SearchError("the program closed its output, but does not end") from None
        if status:
            messages.seek(0)
            lines = messages.read(LONGEST_LINE).decode("utf-8", "replace").split("\n")
            last = next((line.strip() for line in reversed(lines) if line.strip()), "no message")
            raise SearchError(f"the program ended with status {status}: {last[:LONGEST_REASON]}")

    def _end(self, program: subprocess.Popen[bytes], reader: threading.Thread) -> None:
        assert program.stdin is not None
        with suppress(OSError):
            program.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            program.wait(END_WITHIN_S)
        program.kill()
        program.wait()
        latest = monotonic() + END_WITHIN_S
        while reader.is_alive() and monotonic() < latest:  # what the program has started may still hold its output
            with suppress(queue.Empty):
                self._lines.get(timeout=CHECKED_EVERY_S)


def _to_list(values: Array) -> list[float | None]:
    """Return numbers as JSON has them: null where not finite."""
    return [value if math.isfinite(value) else None for value in values.tolist()]
