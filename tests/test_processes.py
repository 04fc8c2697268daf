"""Worker processes that cannot begin, die, or are no longer needed."""

import errno
import os
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor

from nlp_gait.errors import NoWorkersError, WorkerError
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


@pytest.mark.slow
def test_cancelled_runs_are_not_reported_after_an_early_stop() -> None:
    """Ctrl-C in a study is one sentence: joblib's warning of cancelled calls is not a second one."""
    results = run_in_processes({number: partial(time.sleep, 0.05 * number) for number in range(12)}, workers=2)
    assert next(results) == (0, None)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        results.close()  # type: ignore[attr-defined]
    assert not heard


def test_workers_do_not_begin_in_a_folder_that_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    with pytest.raises(WorkerError, match="the working folder is gone"):
        list(run_in_processes({k: partial(abs, k) for k in range(2)}, 2))


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (OSError(errno.EMFILE, "Too many open files"), "too many files are open"),
        (OSError(errno.ENFILE, "Too many open files in system"), "too many files are open"),
        (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "there are too many processes or threads"),
        (RuntimeError("can't start new thread"), "there are too many processes or threads"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "there is not enough memory"),
        (MemoryError("std::bad_alloc"), "there is not enough memory"),
        (ImportError("x.so: failed to map segment from shared object"), "there is not enough memory"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_shortage_at_the_start_of_workers_is_one_sentence(
    error: Exception, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joblib hides it behind an error of its own."""

    def begin(self: object) -> None:
        try:
            raise error
        finally:
            raise UnboundLocalError

    monkeypatch.setattr("joblib.externals.loky.backend.process.LokyProcess.start", begin)
    get_reusable_executor().shutdown(wait=True, kill_workers=True)  # else its workers would do
    with pytest.raises(NoWorkersError, match=f"cannot begin: {sentence}; use fewer --jobs"):
        list(run_in_processes({k: partial(abs, k) for k in range(2)}, 2))
