"""Time histories of a gait, each with its unit."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nlp_gait.errors import InputError, MissingExtraError, unknown

Array = np.ndarray[Any, np.dtype[np.float64]]

# Histories with a column for each joint.
JOINT_UNITS = {"q": "rad", "qd": "rad/s", "qdd": "rad/s^2", "tau": "Nm"}


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Description of the columns of one time history."""

    unit: str  #: of all of them
    labels: tuple[str, ...] = ("",)  #: one per column


def make_vector_columns(unit: str, axes: str = "xyz") -> Columns:
    """Return the columns of a vector along axes of the world."""
    return Columns(unit=unit, labels=tuple(axes))


@dataclass(frozen=True, kw_only=True, eq=False)
class JointAngles:
    """Angles of some joints over time."""

    owner: str  # the file, for messages
    joints: tuple[str, ...]  # names of the columns
    t: Array  # (T,) ascending [s]
    q: Array  # (T, J) [rad]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Signals:
    """Time histories of one gait; raises InputError if the columns of an array are not described, or their number differs."""

    joints: tuple[str, ...]  #: names of the columns of q, qd, qdd and tau
    arrays: Mapping[str, Array]  #: by name; the first axis is time, ``"t"`` is time itself [s]
    columns: Mapping[str, Columns]  #: unit and labels of every array but ``"t"`` and those of the joints

    def __post_init__(self) -> None:
        for name, _, labels, table in self._tables():
            if table.shape[1] != len(labels):
                raise InputError(f"time history {name!r} has {table.shape[1]} columns, but {len(labels)} are described")

    def named_columns(self) -> Iterator[tuple[str, str, Array]]:
        """Yield name, unit and values (T,) of every column, time first: for example ``q LKneePitch``, rad."""
        yield "t", "s", self.arrays["t"]
        for name, unit, labels, table in self._tables():
            for label, column in zip(labels, table.T, strict=True):
                yield f"{name} {label}".strip(), unit, column

    def __getitem__(self, name: str) -> Array:
        """Return an array by name (``"tau"``) or one of its columns (``"tau LKneePitch"``); raises UnknownNameError."""
        if name in self.arrays:
            return self.arrays[name]
        columns = {column: values for column, _, values in self.named_columns()}
        if name not in columns:
            raise unknown("time history", name, [*self.arrays, *columns])
        return columns[name]

    def to_frame(self) -> Any:
        """Return ``named_columns`` as a pandas data frame indexed by time; ``frame.attrs["units"]`` has the units by column."""
        pandas, (_, *columns) = import_pandas(), self.named_columns()
        index = pandas.Index(self.arrays["t"], name="t [s]")
        frame = pandas.DataFrame({name: values for name, _, values in columns}, index=index)
        frame.attrs["units"] = {name: unit for name, unit, _ in columns}
        return frame

    def __repr__(self) -> str:
        t = self.arrays["t"]
        return f"<Signals over {t[-1] - t[0]:.4g} s in {len(t)} samples: {', '.join(self.arrays)}>"

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


def import_pandas() -> Any:
    """Return the module pandas, which only data frames need; raises MissingExtraError if it is not installed."""
    try:
        import pandas
    except ImportError as error:
        raise MissingExtraError(f"a data frame needs pandas ({error}); install it with pip install pandas") from error
    return pandas
