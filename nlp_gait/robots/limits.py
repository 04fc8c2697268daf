"""Reading in a child process with limits of time and memory, which a robot file or a mesh may exceed."""

import multiprocessing
import os
from collections.abc import Callable

from nlp_gait.errors import RobotDataError, WorkerError
from nlp_gait.processes import run_in_isolation

TIME_LIMIT_S = 60.0
MEMORY_LIMIT_BYTES = 2 * 2**30
MEMORY_VARIABLE = "NLP_GAIT_ROBOT_MEMORY_GIB"  # environment variable with another limit, for robots with large meshes
LARGEST_RESULT = 256 * 2**20  # bytes
REMEDY = f"simplify the file, or if you trust it, allow more memory by {MEMORY_VARIABLE}=4"


def read_in_child(owner: str, read: Callable[[], bytes]) -> bytes:
    """Return what ``read`` returns, in a forked process with limits of time and memory; Ctrl-C ends it at once.

    Where a system has no forks (Windows), it is called in this process, without limits. ``owner`` is the kind and name of the
    file, for messages. Raises RobotDataError as ``read`` may, or if it took too much time or memory, or its process died.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        return read()
    limit = _read_memory_limit()
    memory = f"{owner} probably needs more than {limit / 2**30:.3g} GiB of memory to be read; {REMEDY}"

    def call() -> bytes:
        try:
            return b"+" + read()
        except RobotDataError as error:
            return b"-" + str(error).encode(errors="backslashreplace")
        except MemoryError:
            return b"-" + memory.encode(errors="backslashreplace")

    try:
        result = run_in_isolation(call, TIME_LIMIT_S, LARGEST_RESULT, limit)
    except TimeoutError:
        raise RobotDataError(f"{owner} was not read within {TIME_LIMIT_S:g} s; simplify the file") from None
    except WorkerError as error:
        raise RobotDataError(
            f"{owner} cannot be read: {error}; it may need more than {limit / 2**30:.3g} GiB of memory, or "
            f"hold more than {LARGEST_RESULT // 2**20} MiB of data; {REMEDY}"
        ) from error
    if result[:1] == b"-":
        raise RobotDataError(result[1:].decode())
    return result[1:]


def _read_memory_limit() -> int:
    """Return the limit of memory [bytes]; raises RobotDataError for a value of the environment variable that is not one."""
    text = os.environ.get(MEMORY_VARIABLE, "")
    if not text:
        return MEMORY_LIMIT_BYTES
    try:
        limit = int(float(text) * 2**30)
    except (ValueError, OverflowError):
        limit = 0
    if limit <= 0:
        raise RobotDataError(f"{MEMORY_VARIABLE} must be a finite number of GiB > 0, got {text!r}")
    return limit
