"""Limits for files that another program may have made to exhaust this one: counts in MJCF, and reading in a child process."""

import math
import multiprocessing
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from nlp_gait.errors import RobotDataError, WorkerError
from nlp_gait.files import read_bytes
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


# Counts in MJCF files, checked before MuJoCo compiles them: some would take hours, or all memory.
MOST_ELEMENTS = 100_000
MOST_NUMBERS = 2**25  # of an array
COPYING = ("replicate", "flexcomp", "composite")  # their ``count`` makes elements
ARRAYS = {"hfield": ("nrow", "ncol"), "texture": ("width", "height")}
FOLDERS = ("meshdir", "texturedir", "assetdir")


def check_counts(path: Path) -> list[Path]:
    """Return all files that an MJCF file names, those of included files too.

    Raises RobotDataError if a count is too large, or one of the files is not a regular file.
    """
    files, folders, total = [path], [path.parent], 0.0
    waiting: list[tuple[Any, float]] = [(_parse(path), 1.0)]
    while waiting:
        element, copies = waiting.pop()
        if element.tag in COPYING:
            copies *= max(_multiply(element, ("count",)), 1.0)
        total += copies
        if total > MOST_ELEMENTS:
            raise _reject(path, element, ("count",), f"{total:.10g} elements of the model", MOST_ELEMENTS)
        names = ARRAYS.get(element.tag, ())
        for group in [names] if names else [(name,) for name in element.keys() if name.startswith("n")]:
            if _multiply(element, group) > MOST_NUMBERS:
                raise _reject(path, element, group, f"{_multiply(element, group):.10g} numbers", MOST_NUMBERS)
        folders += [path.parent / element.get(name, "") for name in FOLDERS if element.tag == "compiler"]
        named = {folder / element.get("file", "") for folder in folders}
        for file in named.difference(files):
            with suppress(OSError, ValueError):  # its name is too long, or has a zero
                if os.path.isfile(file):
                    files.append(file)
                    waiting += [(_parse(file), copies)] if element.tag == "include" else []
                elif file.exists() and not file.is_dir():
                    raise RobotDataError(f"robot file {str(path)!r}: {str(file)!r} is not a regular file")
        waiting += [(child, copies) for child in element]
    return files


def _parse(path: Path) -> Any:
    try:
        return ElementTree.fromstring(read_bytes(path, "robot file", error=RobotDataError))
    except (ElementTree.ParseError, ValueError, LookupError):
        return ElementTree.Element("invalid")  # MuJoCo says why


def _multiply(element: Any, names: tuple[str, ...]) -> float:
    with suppress(ValueError):
        return math.prod(float(word) for name in names for word in element.get(name, "").split())
    return 1.0


def _reject(path: Path, element: Any, names: tuple[str, ...], what: str, most: int) -> RobotDataError:
    given = "".join(f' {name}="{element.get(name)[:60]}"' for name in names if element.get(name))
    return RobotDataError(
        f"robot file {str(path)!r}: <{element.tag}{given}> makes {what}, more than {most}; simplify the file"
    )
