"""Names and numbers that the data of a robot may have."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import fields
from typing import Any

import numpy as np

from nlp_gait.errors import RobotDataError

LONGEST_NAME = 100
LARGEST_NUMBER = 1e9  # in the unit of its field: beyond what any robot has, and its squares stay finite


def check_name(name: str, where: str) -> None:
    """Refuse a name that is empty, long, or not printable; raises ValueError."""
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise ValueError(f"{where}: a name has 1 to {LONGEST_NAME} printable characters, got {name[:LONGEST_NAME]!r}")


def check_numbers(owner: str, record: Any, positive: Collection[str]) -> None:
    """Refuse numbers that no robot has.

    Args:
        owner: whose numbers they are, for messages.
        record: dataclass; its fields that hold no numbers are left alone.
        positive: names of the fields that must be above zero.

    Raises:
        RobotDataError: a number is not finite, or not within ``LARGEST_NUMBER``, or must be above zero and is not.
    """
    for field in fields(record):
        value = getattr(record, field.name)
        if field.name in positive and not value > 0.0:  # NaN fails too
            raise RobotDataError(f"{owner}: {field.name} must be > 0, got {value}")
        if isinstance(value, (int, float, tuple)) and not sound(value):
            raise RobotDataError(
                f"{owner}: {field.name} must be finite numbers within {LARGEST_NUMBER:g}, got {value!r}"
            )


def sound(numbers: Any) -> bool:
    """Whether a number, or all in a sequence or array of any depth, are finite and no larger than a robot's are."""
    return bool((np.abs(numbers) <= LARGEST_NUMBER).all())  # NaN is not
