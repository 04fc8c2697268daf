"""One input, tried: accepted for what it says, refused in one sentence, or a defect."""

from __future__ import annotations

import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from metaheuristics import SearchError
from nlp_gait.errors import GaitError

TIME_LIMIT_S = 10.0
WAITING = 10  # on a busy machine an input may take so many times its limit on the wall


class Misread(Exception):
    """An accepted input that means something else than it says."""


class Hung(BaseException):
    """An input that takes longer than the limit."""


def outcome(read: Callable[[], Any]) -> str:
    """``"accepted"``, ``"refused"``, or what is wrong.

    Args:
        read: reads the input, and raises Misread if what it got is not what stands there.
    """
    try:
        with limited(TIME_LIMIT_S), warnings.catch_warnings():
            warnings.simplefilter("error")
            read()
    except (GaitError, SearchError) as error:
        return _judged(str(error))
    except Hung:
        return f"hangs for more than {TIME_LIMIT_S:g} s"
    except Misread as error:
        return f"misread: {error}"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return "accepted"


def _judged(message: str) -> str:
    if not message.strip():
        return "an error without a message"
    if "\n" in message or "Traceback" in message:
        return f"an error of several lines: {message!r}"
    return "refused"


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise Hung inside after so much processor time, or a wait of ``WAITING`` times as long.

    Where the system has no such signals there is no limit.
    """
    if not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise Hung

    limits = ((signal.SIGPROF, signal.ITIMER_PROF, seconds), (signal.SIGALRM, signal.ITIMER_REAL, WAITING * seconds))
    before = [signal.signal(number, stop) for number, _, _ in limits]
    for _, timer, limit in limits:
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(limits, before, strict=True):
            signal.setitimer(timer, 0.0)
            signal.signal(number, handler)
