"""Blocks of variables: one value per row (a link, a component) and column (an instant)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.formulation.assembly import Point, Variable, make_variables
from nlp_gait.formulation.signals import Array


@dataclass(frozen=True, kw_only=True)
class Block:
    """Variables ``<quantity>_<row>_<unit>[<column>]``, for example ``angle_HK_rad[12]``."""

    quantity: str  # for example ``"angle"``
    unit: str  # of all values, for example ``"rad/s^2"``
    rows: tuple[str, ...]  # names of the rows
    columns: int  # number of columns
    limits: tuple[tuple[float, float], ...]  # lower and upper bound of every row [unit]
    description: str  # of a row

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables, column by column."""
        suffix = self.unit.replace("/", "_").replace("^", "")
        text = self.description
        table = (
            (f"{self.quantity}_{row}_{suffix}[{k}]", self.unit, *ends, f"{text} {row} at instant {k}")
            for k in range(self.columns)
            for row, ends in zip(self.rows, self.limits, strict=True)
        )
        return make_variables(*table)

    @property
    def size(self) -> int:
        """Number of variables."""
        return len(self.rows) * self.columns


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Layout of x: consecutive blocks."""

    blocks: tuple[Block, ...]  # in the order of x

    @property
    def variables(self) -> tuple[Variable, ...]:
        """All variables in the order of x."""
        return tuple(variable for block in self.blocks for variable in block.variables)

    def split(self, point: Point) -> dict[str, MX]:
        """Return the symbols of each block by quantity, (rows, columns)."""
        ends = np.cumsum([0, *(block.size for block in self.blocks)])
        columns = ca.vertsplit(point.x, [int(end) for end in ends])
        return {
            block.quantity: ca.reshape(column, len(block.rows), block.columns)
            for block, column in zip(self.blocks, columns, strict=True)
        }

    def values(self, x: Array) -> dict[str, Array]:
        """Return the values of each block by quantity, (rows, columns), from x (n,)."""
        ends = np.cumsum([block.size for block in self.blocks])[:-1]
        return {
            block.quantity: values.reshape(block.columns, len(block.rows)).T
            for block, values in zip(self.blocks, np.split(x, ends), strict=True)
        }

    def join(self, values: Mapping[str, Array]) -> Array:
        """Return x (n,) from the values of each block (rows, columns)."""
        return np.concatenate([values[block.quantity].T.ravel() for block in self.blocks])


def make_labels(rows: Sequence[str], columns: Sequence[int] | range) -> tuple[str, ...]:
    """Return row labels of a constraint on a (rows, columns) matrix in column-major order: ``"HK, 12"``."""
    return tuple(f"{row}, {k}" for k in columns for row in rows)
