"""Rows over time of a phase as enclosed functions, and a search over pieces of time.

The pieces are halved until every row is proven to be satisfied or its violation is known well enough.
"""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.formulation import Array, Constraint, GaitProblem, RowsOverTime
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs.affine import AffineForms, AffineFunction, Flags, Numbers
from nlp_gait.symbolic.nonsmooth import Exact

# Phases are multiples of this, so that they and their sums are exact; an interval of a phase is rounded to one.
GRAIN = 2.0**-40
FIRST_PIECES = 64
LEAST_PIECE = 2.0**-16
COARSE = 2.0**-10
# Limit on the work for rows of one name, in pieces over which all rows are enclosed; the rest stays open.
MOST_PIECES = 1000
# Relative distance of the bounds of a violation at which they are sharp enough.
SHARPNESS = 0.02
# The same for bounds of a mean, and the largest number of pieces for it.
MEAN_SHARPNESS = 4e-3
MOST_MEAN_PIECES = 800
# Widens sums over pieces: far more than their rounding errors.
ROUNDING = 1e-12


def make_pieces(kinks: Sequence[float], shift: float | None) -> Array:
    """Return (P, 2) pieces of the phase, none of which has a kink inside, also not an interval later."""
    last = 1.0 - (shift or 0.0)
    inner = [kink - later for kink in kinks for later in ((0.0, shift) if shift else (0.0,))]
    even = np.round(np.linspace(0.0, last, FIRST_PIECES + 1) / GRAIN) * GRAIN
    cuts = np.unique([*even, *(cut for cut in inner if 0.0 < cut < last)])
    return np.stack([cuts[:-1], cuts[1:]], axis=-1)


def halve_pieces(pieces: Array) -> Array:
    """Return (2 P, 2) pieces, each cut in the middle."""
    middle = np.round(pieces.mean(axis=1) / GRAIN) * GRAIN
    return np.concatenate([np.stack([pieces[:, 0], middle], -1), np.stack([middle, pieces[:, 1]], -1)])


def bound_violation(lower: Array, upper: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the largest and the least possible violation of the bounds lower and upper by values between low and high."""
    no_lower, no_upper = np.isneginf(lower), np.isposinf(upper)
    with np.errstate(invalid="ignore"):  # the difference of two infinite ends is not used
        most = np.maximum(np.where(no_lower, -np.inf, lower - low), np.where(no_upper, -np.inf, high - upper))
        least = np.maximum(np.where(no_lower, -np.inf, lower - high), np.where(no_upper, -np.inf, low - upper))
    return most, least


class TimeRows:
    """Enclosed functions of time of one kind: rows of every time, and other values whose time means are bounded."""

    def __init__(
        self, plain: Sequence[tuple[Any, ...]], averaged: Sequence[tuple[Any, ...]], inputs: Sequence[MX], kinks: bool
    ) -> None:
        """Read the instructions of a function of (x, p, phase) or (x, p, phase, phase an interval later)."""
        constraints, names, units, values, lower, upper = zip(*plain, *averaged, strict=True)
        self.names, self.units, self.plain = names, units, len(plain)  # no unit: a metric, which has no bounds
        self._bounds = ca.Function("bounds", [inputs[1]], [ca.vertcat(*lower), ca.vertcat(*upper)])
        function = ca.Function("rows", list(inputs), [ca.vertcat(*values)])
        arguments = function.sx_in()
        self._function = ca.Function("rows", arguments, ca.cse([ca.densify(v) for v in function.call(arguments)]))
        first = int(inputs[0].numel() + inputs[1].numel())
        self._half_open = range(first, first + len(inputs) - 2) if kinks else ()
        self.whole = AffineFunction(self._function, self._half_open)
        groups: dict[str, list[int]] = defaultdict(list)
        for k, constraint in enumerate(constraints[: len(plain)]):
            groups[constraint].append(k)
        self.groups = [np.array(group) for group in groups.values()]  # indices of the rows with one name
        self._parts: dict[int, tuple[AffineFunction, float]] = {}

    @lock_casadi
    def bound(self, p: Array) -> tuple[Array, Array]:
        """Return lower and upper bounds (m,) for parameter values."""
        lower, upper = (np.array(bound, dtype=float).ravel() for bound in self._bounds(p))
        return lower, upper

    @lock_casadi
    def part(self, group: int) -> tuple[AffineFunction, float]:
        """Return the function of a group of rows, and its share of all instructions."""
        if group not in self._parts:
            arguments = self._function.sx_in()
            (values,) = self._function.call(arguments)
            function = ca.Function("part", arguments, [values[self.groups[group].tolist()]])
            share = function.n_instructions() / self._function.n_instructions()
            self._parts[group] = AffineFunction(function, self._half_open), share
        return self._parts[group]


class TimeFunctions(NamedTuple):
    """Rows over time of one phase as enclosed functions."""

    source: RowsOverTime  # the rows over time
    instants: TimeRows | None  # rows of each instant, and values whose time means are rows or metrics
    changes: TimeRows | None  # rows of each interval
    sampled: tuple[str, ...]  # rows that are defined on samples only


@lock_casadi
def make_time_functions(problem: GaitProblem, source: RowsOverTime) -> TimeFunctions:
    """Read the functions from the rows with all samples at one phase, and with the later samples an interval later."""
    point = problem.symbols()
    now, later = MX.sym("phase"), MX.sym("later")
    still = source.assemble(point, ca.horzcat(now, now, now), Exact())
    moved = source.assemble(point, ca.horzcat(now, later, later), Exact())
    by_kind: dict[str | None, list[Constraint]] = defaultdict(list)
    for constraint in still.constraints:
        by_kind[constraint.over].append(constraint)
    wanted = {constraint.name for constraint in by_kind["interval"]}
    instants = [row for constraint in by_kind["instant"] for row in _select_first_sample(constraint)]
    means = [row for c in by_kind["mean"] for row in _split(c)]
    means_of = [name for name in source.means if name in still.metrics]
    metrics = [(name, name, "", still.metrics[name], MX(-np.inf), MX(np.inf)) for name in means_of]
    averaged, kinks = [*means, *metrics], bool(source.kinks)
    changes = [row for c in moved.constraints if c.name in wanted for row in _select_first_sample(c)]
    given = [point.x, point.p, now]
    at_once = TimeRows(instants, averaged, given, kinks) if instants or averaged else None
    between = TimeRows(changes, [], [*given, later], kinks) if changes else None
    sampled = tuple(c.name for c in by_kind[None])
    return TimeFunctions(source=source, instants=at_once, changes=between, sampled=sampled)


def _split(constraint: Constraint) -> list[tuple[Any, ...]]:
    """Return the name of the constraint, name, unit, value, lower and upper bound of each row."""
    columns = [ca.vertsplit(column) for column in constraint.columns]
    rows = zip(constraint.row_names, *columns, strict=True)
    return [(constraint.name, name, constraint.unit, *row) for name, *row in rows]


def _select_first_sample(constraint: Constraint) -> list[tuple[Any, ...]]:
    """Return the same for the first sample, named without its number."""
    rows: dict[str, tuple[Any, ...]] = {}
    labels = constraint.labels or ("",)
    for label, (_, _, *row) in zip(labels, _split(constraint), strict=True):
        stem = label.rpartition(",")[0]
        rows.setdefault(f"{constraint.name}[{stem}]" if stem else constraint.name, tuple(row))
    return [(constraint.name, name, *row) for name, row in rows.items()]


class TimeSearch:
    """Halving of pieces until every row is proven to be satisfied, or its violation is known well enough."""

    def __init__(self, rows: TimeRows, given: Array, shift: float | None, lower: Array, upper: Array) -> None:
        self._rows, self._given, self._shift = rows, given, shift
        self._lower, self._upper = lower, upper
        self.least = np.full(len(lower), -np.inf)  # bounds of the largest violation of each row
        self.most = np.full(len(lower), -np.inf)
        # By the row's index: the earliest piece in which it is not proven to be satisfied.
        self.first: dict[int, tuple[float, float]] = {}
        self._settled: tuple[Array, Array]

    def run(self, pieces: Array) -> None:
        """Halve the open pieces, separately for the rows of each name, until few are open, or they are too many or too small."""
        forms = self._enclose(self._rows.whole, pieces)
        self._settled = pieces, self._integrate(pieces, forms)
        for number, rows in enumerate(self._rows.groups):
            self._halve(number, rows, pieces, forms.lower[:, rows], forms.upper[:, rows])

    def _halve(self, number: int, rows: Numbers, pieces: Array, low: Array, high: Array) -> None:
        work = float(len(pieces))
        while True:
            most, least = bound_violation(self._lower[rows], self._upper[rows], low, high)
            self.least[rows] = np.fmax(self.least[rows], least.max(axis=0, initial=-np.inf))
            satisfied = most <= FEASIBILITY_TOLERANCE
            violated = least > FEASIBILITY_TOLERANCE
            sharp = most <= self.least[rows] + np.maximum(SHARPNESS * self.least[rows], FEASIBILITY_TOLERANCE)
            width = pieces[:, 1] - pieces[:, 0]
            coarse = width > COARSE  # the start of a violation needs no finer piece
            again = ((~satisfied & ~violated & ~(sharp & ~coarse[:, None])) | (~satisfied & ~sharp)).any(axis=1)
            again &= (width > 2 * LEAST_PIECE) & (work <= MOST_PIECES)
            stays = ~again
            self.most[rows] = np.fmax(self.most[rows], most[stays].max(axis=0, initial=-np.inf))
            for piece, k in zip(*np.nonzero(~satisfied & stays[:, None]), strict=True):
                (a, b), row = pieces[piece].tolist(), int(rows[k])
                if row not in self.first or a < self.first[row][0]:
                    self.first[row] = (a, b)
            if not again.any():
                return
            pieces, (function, share) = halve_pieces(pieces[again]), self._rows.part(number)
            forms = self._enclose(function, pieces)
            low, high = forms.lower, forms.upper
            work += share * len(pieces)

    def integrals(self) -> tuple[Array, Array]:
        """Return bounds (k,) and (k,) of the integrals over the phase of the values that follow the rows."""
        low, high = self._settled[1].sum(axis=0).T
        return low - ROUNDING * (1 + np.abs(low)), high + ROUNDING * (1 + np.abs(high))

    def sharpen_integrals(self, limits: Array) -> None:
        """Halve the pieces that add most to the width of the integrals' bounds, until these are narrow.

        Bounds on both sides of a limit (k, 2) are narrowed as far as the number of pieces allows, whatever the sharpness.
        """
        pieces, integrals = self._settled
        while integrals.shape[1]:
            spread = integrals[..., 1] - integrals[..., 0]  # infinite where there is no bound
            low, high = integrals.sum(axis=0).T
            astride = ((low[:, None] < limits) & (limits < high[:, None])).any(axis=1)
            bounded = np.isfinite(low) & np.isfinite(high) & ~astride
            wanted = np.where(bounded, MEAN_SHARPNESS * np.maximum(np.abs(low), np.abs(high)), 0.0)
            again: Flags = (spread > wanted / len(pieces)).any(axis=1) & (spread.sum(axis=0) > wanted).any()
            if not again.any() or len(pieces) + again.sum() > MOST_MEAN_PIECES:
                break
            finer = halve_pieces(pieces[again])
            forms = self._enclose(self._rows.whole, finer)
            pieces = np.concatenate([pieces[~again], finer])
            integrals = np.concatenate([integrals[~again], self._integrate(finer, forms)])
        self._settled = pieces, integrals

    def _integrate(self, pieces: Array, forms: AffineForms) -> Array:
        """Return (P, k, 2) bounds of the integrals over pieces; the slope of a form has no effect."""
        with np.errstate(invalid="ignore"):
            lower = np.fmax(forms.lower, forms.middle - forms.error)
            upper = np.fmin(forms.upper, forms.middle + forms.error)
        both = np.stack([lower, upper], axis=-1)[:, len(self._lower) :]
        return np.asarray(both * (pieces[:, 1] - pieces[:, 0])[:, None, None])

    def _enclose(self, function: AffineFunction, pieces: Array) -> AffineForms:
        boxes = np.empty((len(pieces), function.inputs, 2))
        boxes[:, : len(self._given)] = self._given[:, None]
        boxes[:, len(self._given)] = pieces
        if self._shift is not None:
            boxes[:, -1] = pieces + self._shift
        symbols = np.full(function.inputs, -1)
        symbols[len(self._given) :] = 0
        return function(boxes, symbols)
