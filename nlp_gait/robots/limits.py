"""Reading in a child process with limits of time and memory, which a robot file or a mesh may exceed."""

import multiprocessing
from collections.abc import Callable

from nlp_gait.errors import RobotDataError, WorkerError
from nlp_gait.processes import run_in_isolation

TIME_LIMIT_S = 60.0
MEMORY_LIMIT_BYTES = 4 * 2**30
LARGEST_RESULT = 256 * 2**20  # bytes


def read_in_child(owner: str, read: Callable[[], bytes]) -> bytes:
    """Return what ``read`` returns, in a forked process with limits of time and memory; Ctrl-C ends it at once.

    Where a system has no forks (Windows), it is called in this process, without limits. ``owner`` is the kind and name of the
    file, for messages. Raises RobotDataError as ``read`` may, or if it took too much time or memory, or its process died.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        return read()
    memory = f"more than {MEMORY_LIMIT_BYTES // 2**30} GiB of memory"
    fault = f"{owner} probably needs {memory} to be read; simplify the file"

    def call() -> bytes:
        try:
            return b"+" + read()
        except RobotDataError as error:
            return b"-" + str(error).encode(errors="backslashreplace")
        except MemoryError:
            return b"-" + fault.encode(errors="backslashreplace")

    try:
        result = run_in_isolation(call, TIME_LIMIT_S, LARGEST_RESULT, MEMORY_LIMIT_BYTES)
    except TimeoutError:
        raise RobotDataError(f"{owner} was not read within {TIME_LIMIT_S:g} s; simplify the file") from None
    except WorkerError as error:
        raise RobotDataError(
            f"{owner} cannot be read: {error}; it may need {memory}, or hold more than {LARGEST_RESULT // 2**20} MiB of data; "
            "simplify the file"
        ) from error
    if result[:1] == b"-":
        raise RobotDataError(result[1:].decode())
    return result[1:]
