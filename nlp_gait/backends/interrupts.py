"""Ctrl-C while compiled code runs, which would swallow it: CasADi takes the exception for a failed evaluation and goes on."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import FrameType


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with what was found until then.

    It propagates as any KeyboardInterrupt does; a caller that wants the partial result catches it and reads ``partial``.

    Attributes:
        sentence: how far it came.
        partial: what it would have returned, as far as there is something.
    """

    def __init__(self, sentence: str, partial: object) -> None:
        super().__init__(sentence, partial)  # both, else it cannot be pickled
        self.sentence = sentence
        self.partial = partial

    def __str__(self) -> str:
        return self.sentence


def never() -> bool:
    """Nobody asks to stop."""
    return False


@contextmanager
def deferred_interrupts() -> Iterator[Callable[[], bool]]:
    """Ctrl-C raises nothing inside, but the function yielded says that it was pressed; pressed again, it raises at once."""
    presses = 0

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal presses
        presses += 1
        if presses > 1:
            raise KeyboardInterrupt

    note.defers = True  # type: ignore[attr-defined]
    with _handler(note):
        yield lambda: presses > 0


@contextmanager
def held_interrupts() -> Iterator[None]:
    """Ctrl-C waits until the end of what is inside, which takes a moment; pressed again, it does not wait.

    Inside ``deferred_interrupts`` it waits for the end of that.
    """
    if getattr(signal.getsignal(signal.SIGINT), "defers", False):
        yield
        return
    with deferred_interrupts() as pressed:
        yield
        if pressed():
            raise KeyboardInterrupt


@contextmanager
def remembered_interrupts() -> Iterator[Callable[[], None]]:
    """Ctrl-C is raised as usual, and once more by the function yielded, in case something inside swallowed it."""
    pressed = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        raise KeyboardInterrupt

    def check() -> None:
        if pressed:
            raise KeyboardInterrupt

    with _handler(note):
        yield check


@contextmanager
def children_ignore_interrupts() -> Iterator[None]:
    """Processes and threads started inside never get Ctrl-C, which a terminal sends to all: their parent ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # started inside, with the first worker, it would let Ctrl-C through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _handler(note: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Another handler of Ctrl-C inside: in the main thread only, and not where Ctrl-C is ignored, as under nohup."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before in (signal.SIG_IGN, None):
        yield
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
