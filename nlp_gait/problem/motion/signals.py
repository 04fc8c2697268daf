"""Time histories of a gait, each with its unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nlp_gait.errors import InputError

Array = np.ndarray[Any, np.dtype[np.float64]]

# Histories with a column for each joint.
JOINT_UNITS = {"q": "rad", "qd": "rad/s", "qdd": "rad/s^2", "tau": "Nm"}


@dataclass(frozen=True, kw_only=True)
class Columns:
    """What the columns of one time history are.

    Attributes:
        unit: of all of them.
        labels: one per column.
    """

    unit: str
    labels: tuple[str, ...] = ("",)


def in_space(unit: str, axes: str = "xyz") -> Columns:
    """Columns of a vector along axes of the world."""
    return Columns(unit=unit, labels=tuple(axes))


@dataclass(frozen=True, kw_only=True, eq=False)
class Signals:
    """Time histories of one gait.

    Attributes:
        joints: names of the columns of q, qd, qdd and tau.
        arrays: by name; the first axis is time, ``"t"`` is time itself [s].
        columns: unit and labels of every array but ``"t"`` and those of the joints.

    Raises:
        InputError: an array whose columns are not described, or not as many as it has.
    """

    joints: tuple[str, ...]
    arrays: Mapping[str, Array]
    columns: Mapping[str, Columns]

    def __post_init__(self) -> None:
        """Refuse an array that nobody could read."""
        for name, _, labels, table in self._tables():
            if table.shape[1] != len(labels):
                raise InputError(f"time history {name!r} has {table.shape[1]} columns, but {len(labels)} are described")

    def named_columns(self) -> Iterator[tuple[str, str, Array]]:
        """Name, unit and values (T,) of every column, time first: for example ``q LKneePitch``, rad."""
        yield "t", "s", self.arrays["t"]
        for name, unit, labels, table in self._tables():
            for label, column in zip(labels, table.T, strict=True):
                yield f"{name} {label}".strip(), unit, column

    def _tables(self) -> Iterator[tuple[str, str, tuple[str, ...], Array]]:
        for name, array in self.arrays.items():
            if name == "t":
                continue
            described = self.columns.get(name)
            if described is None and name in JOINT_UNITS:
                described = Columns(unit=JOINT_UNITS[name], labels=self.joints)
            if described is None:
                raise InputError(f"time history {name!r} has no unit: describe its columns")
            yield name, described.unit, described.labels, array[:, None] if array.ndim == 1 else array
