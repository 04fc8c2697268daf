"""Ctrl-C: while the command line starts, around code that would swallow it, and in child processes; callbacks of long work.

The command line imports this module before everything else, so it imports nothing that takes time.
"""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from types import FrameType

# Called between steps of long work; returns whether to end at once.
Stop = Callable[[], bool]
# Called with a short line about each step.
Progress = Callable[[str], None]


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with the partial result; it propagates as every KeyboardInterrupt does."""

    def __init__(self, sentence: str, partial: object) -> None:
        super().__init__(sentence, partial)  # both, otherwise it cannot be pickled
        self.sentence = sentence  # how far the work had come
        self.partial = partial  # may be empty

    def __str__(self) -> str:
        return self.sentence


def never() -> bool:
    """Return False: the default of every argument ``stop``."""
    return False


def ignore_progress(_: str) -> None:
    """Ignore progress: the default of every argument ``progress``."""


def exit_on_interrupt() -> None:
    """Let Ctrl-C end the process with one line and status 130, except inside ``raise_interrupts``."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored, as under nohup
        signal.signal(signal.SIGINT, _exit)


def _exit(number: int, frame: FrameType | None) -> None:
    os.write(2, b"nlp-gait: interrupted\n")
    os._exit(130)


@contextmanager
def raise_interrupts() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt inside, where ``exit_on_interrupt`` was called before."""
    exits = signal.getsignal(signal.SIGINT) is _exit
    with _handle_interrupts(signal.default_int_handler) if exits else nullcontext():
        try:
            yield
        finally:
            # Where Ctrl-C came within exec(), as in the definition of a data class, Python ends by the signal, whatever the
            # status. This resets it.
            exec("")  # noqa: S102


@contextmanager
def defer_interrupts() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether Ctrl-C was pressed inside; pressed again, it raises KeyboardInterrupt at once.

    For compiled code that would swallow the exception: CasADi takes it for a failed evaluation and continues.
    """
    presses: list[int] = []

    def count(number: int, frame: FrameType | None) -> None:
        presses.append(number)
        if len(presses) > 1:
            raise KeyboardInterrupt

    count.defers = True  # type: ignore[attr-defined]
    with _handle_interrupts(count):
        yield lambda: bool(presses)


@contextmanager
def delay_interrupts() -> Iterator[None]:
    """Delay Ctrl-C until the end of a block that takes a moment; pressed again, it raises KeyboardInterrupt at once.

    Inside ``defer_interrupts`` nothing is raised at the end of the block.
    """
    if getattr(signal.getsignal(signal.SIGINT), "defers", False):
        yield
        return
    with defer_interrupts() as pressed:
        yield
    if pressed():  # not before: it may be pressed until the handler is restored
        raise KeyboardInterrupt


@contextmanager
def block_interrupts_in_children() -> Iterator[None]:
    """Block Ctrl-C, which a terminal sends to all processes, in those started inside: their parent ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _handle_interrupts(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Use another handler inside: in the main thread only, and not where Ctrl-C is ignored, as under nohup."""
    import threading

    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before in (signal.SIG_IGN, None):
        yield
        return
    signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
