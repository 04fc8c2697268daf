"""Counts in MJCF files, checked before MuJoCo compiles them: some would take hours, or all memory."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from nlp_gait.errors import RobotDataError
from nlp_gait.files import read_bytes

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
