"""Calls in worker processes: one that dies, and pipes to processes that are gone."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

import pytest

from nlp_gait.errors import WorkerError
from nlp_gait.processes import run_in_processes


def no_reader() -> None:
    """As joblib meets it where its own processes cannot begin."""
    raise BrokenPipeError("Broken pipe")


@pytest.mark.slow
@pytest.mark.parametrize("call", [partial(os._exit, 3), no_reader])
def test_a_process_that_is_gone_is_one_sentence(call: Callable[[], None]) -> None:
    """Also outside studies, where nothing is tried again; a broken pipe is not taken for the reader of the output."""
    with pytest.raises(WorkerError, match="a worker process died"):
        list(run_in_processes({0: call, 1: os.getpid}, workers=2))
