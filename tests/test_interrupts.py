"""Handlers of Ctrl-C."""

import os
import signal

import pytest

from nlp_gait.interrupts import (
    defer_interrupts,
    delay_interrupts,
    exit_on_interrupt,
    raise_interrupts,
)


def test_a_second_press_is_not_deferred() -> None:
    with pytest.raises(KeyboardInterrupt), defer_interrupts() as pressed:
        signal.raise_signal(signal.SIGINT)
        assert pressed()
        signal.raise_signal(signal.SIGINT)


def test_a_press_while_the_handler_is_restored_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    restore = signal.signal

    def press(number: int, handler: object) -> object:
        signal.raise_signal(signal.SIGINT)
        return restore(number, handler)  # type: ignore[arg-type]

    with pytest.raises(KeyboardInterrupt), delay_interrupts():
        monkeypatch.setattr(signal, "signal", press)


def test_an_ignored_interrupt_stays_ignored() -> None:
    """As under nohup, and for what a shell runs in the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with defer_interrupts() as pressed:
            signal.raise_signal(signal.SIGINT)
            assert not pressed()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_the_process_outside_of_a_command_only(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[object] = []
    monkeypatch.setattr(os, "_exit", ended.append)
    monkeypatch.setattr(os, "write", lambda *what: ended.append(what))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        exit_on_interrupt()
        with pytest.raises(KeyboardInterrupt), raise_interrupts():
            signal.raise_signal(signal.SIGINT)
        assert ended == []
        signal.raise_signal(signal.SIGINT)
        assert ended == [(2, b"nlp-gait: interrupted\n"), 130]
    finally:
        signal.signal(signal.SIGINT, before)
