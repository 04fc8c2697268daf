"""Limits for files that another program may have made to exhaust this one: they are read in a child process."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable

from nlp_gait.errors import RobotDataError, WorkerError
from nlp_gait.processes import run_in_isolation

TIME_LIMIT_S = 60.0
MEMORY_LIMIT_BYTES = 4 * 2**30
LARGEST_RESULT = 256 * 2**20  # bytes
REMEDY = "simplify the file"


def read_in_child(owner: str, read: Callable[[], bytes]) -> bytes:
    """Return what ``read`` returns, in a forked process with limits of time and memory; Ctrl-C ends it at once.

    Where a system has no forks (Windows), it is called in this process, without limits.

    Args:
        owner: the kind and name of the file, for messages.
        read: reads it; may raise RobotDataError.

    Raises:
        RobotDataError: as ``read``, or it took too much time or memory, or its process died.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        return read()
    memory = f"{owner} probably needs more than {MEMORY_LIMIT_BYTES / 2**30:.3g} GiB of memory to be read; {REMEDY}"

    def call() -> bytes:
        try:
            return b"+" + read()
        except RobotDataError as error:
            return b"-" + str(error).encode(errors="backslashreplace")
        except MemoryError:
            return b"-" + memory.encode(errors="backslashreplace")

    try:
        result = run_in_isolation(call, TIME_LIMIT_S, LARGEST_RESULT, MEMORY_LIMIT_BYTES)
    except TimeoutError:
        raise RobotDataError(f"{owner} was not read within {TIME_LIMIT_S:g} s; {REMEDY}") from None
    except WorkerError as error:
        raise RobotDataError(
            f"{owner} cannot be read: {error}; it may need more than {MEMORY_LIMIT_BYTES / 2**30:.3g} GiB of memory, or "
            f"hold more than {LARGEST_RESULT // 2**20} MiB of data; {REMEDY}"
        ) from error
    if result[:1] == b"-":
        raise RobotDataError(result[1:].decode())
    return result[1:]
