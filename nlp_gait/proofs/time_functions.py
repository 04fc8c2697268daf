"""Rows over time of a phase as enclosed functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.formulation import Array, Constraint, GaitProblem, RowsOverTime
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.proofs.affine import AffineFunction
from nlp_gait.proofs.boxes import Numbers
from nlp_gait.symbolic.nonsmooth import Exact


class EnclosedPart(NamedTuple):
    """Group of values."""

    function: AffineFunction  # computes them, and possibly others
    columns: Numbers  # indices of the group in the function's results
    work: float  # of an evaluation, relative to that of all values


class TimeRows:
    """Enclosed functions of time of one kind: rows of every time, and other values whose time means are bounded."""

    def __init__(
        self, plain: Sequence[tuple[Any, ...]], others: Sequence[tuple[Any, ...]], inputs: Sequence[MX], kinks: bool
    ) -> None:
        """Read the instructions of a function of (x, p, phase) or (x, p, phase, phase an interval later).

        Raises:
            InputError: an operation that cannot be enclosed.
            CompilerError: there is no compiler, or it fails.
        """
        names, units, values, lower, upper = zip(*plain, *others, strict=True)
        self.names, self.units, self.plain = names, units, len(plain)  # no unit: an index, which has no bounds
        self._bounds = ca.Function("bounds", [inputs[1]], [ca.vertcat(*lower), ca.vertcat(*upper)])
        function = ca.Function("rows", list(inputs), [ca.vertcat(*values)])
        arguments = function.sx_in()
        self._function = ca.Function("rows", arguments, ca.cse([ca.densify(v) for v in function.call(arguments)]))
        first = int(inputs[0].numel() + inputs[1].numel())
        self._half_open = range(first, first + len(inputs) - 2) if kinks else ()
        self.whole = AffineFunction(self._function, self._half_open)
        groups: dict[str, list[int]] = {}
        for k, (name, *_) in enumerate(plain):
            groups.setdefault(name.partition("[")[0], []).append(k)
        self.groups = [np.array(group) for group in groups.values()]  # indices of the rows with one name
        self._parts: dict[int, EnclosedPart] = {}

    @lock_casadi
    def bound(self, p: Array) -> tuple[Array, Array]:
        """Return lower and upper bounds (m,) for parameter values."""
        lower, upper = (np.array(bound, dtype=float).ravel() for bound in self._bounds(p))
        return lower, upper

    @lock_casadi
    def part(self, group: int) -> EnclosedPart:
        """Return a group of rows: a function of its own if that takes less than half of all instructions."""
        if group not in self._parts:
            rows, arguments = self.groups[group], self._function.sx_in()
            (values,) = self._function.call(arguments)
            part = ca.Function("part", arguments, [values[rows.tolist()]])
            share = part.n_instructions() / self._function.n_instructions()
            if share < 0.5:
                self._parts[group] = EnclosedPart(AffineFunction(part, self._half_open), np.arange(len(rows)), share)
            else:
                self._parts[group] = EnclosedPart(self.whole, rows, 1.0)
        return self._parts[group]


class TimeFunctions(NamedTuple):
    """Rows over time of one phase as enclosed functions."""

    source: RowsOverTime  # the rows over time
    instants: TimeRows | None  # rows of each instant, and values whose time means are rows or indexes
    squares: frozenset[int]  # indices of squares whose mean limits a root mean square
    changes: TimeRows | None  # rows of each interval
    sampled: tuple[str, ...]  # rows that are defined on samples only


@lock_casadi
def make_time_functions(problem: GaitProblem, source: RowsOverTime) -> TimeFunctions:
    """Read the functions from the rows with all samples at one phase, and with the later samples an interval later.

    Raises:
        InputError: an operation that cannot be enclosed.
        CompilerError: there is no compiler, or it fails.
    """
    point = problem.symbols()
    now, later = MX.sym("phase"), MX.sym("later")
    still = source.assemble(point, ca.horzcat(now, now, now), Exact())
    moved = source.assemble(point, ca.horzcat(now, later, later), Exact())
    by_kind: dict[str | None, list[Constraint]] = {}
    for constraint in still.constraints:
        by_kind.setdefault(constraint.over, []).append(constraint)
    wanted = {constraint.name for constraint in by_kind.get("interval", [])}
    instants = [row for constraint in by_kind.get("instant", []) for row in _at_one_sample(constraint)]
    means = [row for c in by_kind.get("mean", []) for row in _split(c)]
    squares = [
        (name, unit, value**2, lower, upper)
        for c in by_kind.get("root-mean-square", [])
        for name, unit, value, lower, upper in _split(c)
    ]
    indexes = [
        (name, "", still.indexes[name], MX(-np.inf), MX(np.inf)) for name in source.means if name in still.indexes
    ]
    others, kinks = [*means, *squares, *indexes], bool(source.kinks)
    first = len(instants) + len(means)
    changes = [row for c in moved.constraints if c.name in wanted for row in _at_one_sample(c)]
    return TimeFunctions(
        source=source,
        instants=TimeRows(instants, others, [point.x, point.p, now], kinks) if instants or others else None,
        squares=frozenset(range(first, first + len(squares))),
        changes=TimeRows(changes, [], [point.x, point.p, now, later], kinks) if changes else None,
        sampled=tuple(c.name for kind in (None, "samples") for c in by_kind.get(kind, [])),
    )


def _split(constraint: Constraint) -> list[tuple[Any, ...]]:
    """Return name, unit, value and bounds of every row."""
    columns = [ca.vertsplit(column) for column in constraint.columns]
    return [(name, constraint.unit, *parts) for name, *parts in zip(constraint.row_names, *columns, strict=True)]


def _at_one_sample(constraint: Constraint) -> list[tuple[Any, ...]]:
    """Return the same for the first sample, named without its number."""
    found: dict[str, tuple[Any, ...]] = {}
    labels = constraint.labels or ("",)
    for label, (_, *rest) in zip(labels, _split(constraint), strict=True):
        stem = label.rpartition(",")[0]
        found.setdefault(f"{constraint.name}[{stem}]" if stem else constraint.name, tuple(rest))
    return [(name, *rest) for name, rest in found.items()]
