"""Claims of a paper as rows of a table, and the rules that decide about them; see ``compare.papers.paper``.

A rule is one of

- ``within A %`` of the printed values, ``within A UNIT`` in the unit of the row; printed values with a sign are changes: if only
  the signs are the printed ones, the size differs;
- ``rises``, ``falls`` all along a series, optionally by at least ``A %`` of its first value, or ``A UNIT``, from first to last;
- ``p < A``: the value, positive in the claimed direction, and the two-sided p-value of a test, which has to exclude chance (the
  median of those of repeated tests);
- ``at least A UNIT``, ``at most A UNIT``: every value;
- ``same order``: our values have the order of the printed ones;
- ``rank``: the printed values lie within those of our runs. Beyond them by less than their own range one is not excluded.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

ROUNDING = 1e-9  # of a tolerance, so that a value at its edge is within it
RIPPLE = 1e-3  # of a value: a series that goes back by less between two points still rises or falls, as local optima differ so
RULE = re.compile(r"(within|rises|falls|p <|at least|at most|same order|rank)(?: ([\d.e-]+))?(?: (\S.*))?")


class Ruling(StrEnum):
    """What the numbers say about a claim."""

    HOLDS = "holds"
    SIZE_DIFFERS = "size differs"  # the direction is the printed one
    FAILS = "does not hold"
    NOT_SHOWN = "not shown"  # chance is not excluded, or no feasible result was found
    NOT_RUN = "not run"  # with this effort


@dataclass(frozen=True, slots=True)
class Found:
    """Our numbers: values, series (k, n), or the final values of runs (k, n), and the two-sided p-values of a test (m,)."""

    values: Any
    p: Any = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimRow:
    """A row of ``claims.csv``."""

    id: str
    where: str  # section or table
    claim: str
    printed: str  # values separated by " / "; changes have signs
    unit: str
    rule: str
    note: str  # what the numbers are

    def __post_init__(self) -> None:
        kind, amount, unit = self.parts
        if amount is None and kind in ("within", "p <", "at least", "at most"):
            raise ValueError(f"{self.id}: the rule {self.rule!r} needs a number")
        if unit not in ("", "%", self.unit):
            raise ValueError(f"{self.id}: the rule's unit is {unit!r}, the row's {self.unit!r}")
        if kind in ("within", "same order", "rank"):
            self.values  # noqa: B018, which raises without a number

    @property
    def parts(self) -> tuple[str, float | None, str]:
        """Kind, number and unit of the rule."""
        match = RULE.fullmatch(self.rule)
        if not match:
            raise ValueError(f"{self.id}: unknown rule {self.rule!r}")
        return match[1], None if match[2] is None else float(match[2]), match[3] or ""

    @property
    def values(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """The printed values."""
        return np.array([float(value) for value in self.printed.split(" / ")])

    @property
    def signed(self) -> bool:
        """Whether the printed values are changes."""
        return all(value[0] in "+-" for value in self.printed.split(" / "))


def decide(claim: ClaimRow, result: Found | None) -> Ruling:
    """Return the verdict on a claim; None if there is no feasible result."""
    if result is None:
        return Ruling.NOT_SHOWN
    kind, amount, unit = claim.parts
    ours, size = np.asarray(result.values, dtype=float), amount or 0.0
    if not np.isfinite(ours).all():
        return Ruling.NOT_SHOWN
    if kind == "within":
        return _compare(claim, np.atleast_1d(ours), size, relative=unit == "%")
    if kind in ("rises", "falls"):
        rows = np.atleast_2d(ours) * (1 if kind == "rises" else -1)
        steady = bool(np.all(np.diff(rows) > -RIPPLE * np.abs(rows[:, :-1])))
        least = size * np.abs(rows[:, 0]) / 100 if unit == "%" else size
        change = rows[:, -1] - rows[:, 0]
        return _say(steady and bool(np.all((change > 0) & (change >= least * (1 - ROUNDING)))))
    if kind == "p <":
        if result.p is None:
            raise ValueError(f"{claim.id}: its rule needs a p-value")
        return _say(bool(np.all(ours > 0))) if np.median(result.p) < size else Ruling.NOT_SHOWN
    if kind == "same order":
        return _say(np.array_equal(np.argsort(ours, kind="stable"), np.argsort(claim.values, kind="stable")))
    if kind == "rank":
        return _judge_ranks(claim.values, np.atleast_2d(ours))
    slack = ROUNDING * abs(size)
    return _say(bool(np.all(ours >= size - slack if kind == "at least" else ours <= size + slack)))


def _compare(claim: ClaimRow, ours: np.ndarray[Any, Any], size: float, *, relative: bool) -> Ruling:
    printed = claim.values
    if ours.shape != printed.shape:
        raise ValueError(f"{claim.id}: {len(printed)} values are printed, {len(ours)} found")
    close = np.abs(ours - printed) <= size * (np.abs(printed) / 100 if relative else 1.0) * (1 + ROUNDING)
    if close.all():
        return Ruling.HOLDS
    return Ruling.SIZE_DIFFERS if claim.signed and (np.sign(ours) == np.sign(printed)).all() else Ruling.FAILS


def _judge_ranks(printed: np.ndarray[Any, Any], runs: np.ndarray[Any, Any]) -> Ruling:
    beyond = np.maximum(runs.min(axis=1) - printed, printed - runs.max(axis=1))
    if (beyond <= 0).all():
        return Ruling.HOLDS
    return Ruling.NOT_SHOWN if (beyond <= np.ptp(runs, axis=1)).all() else Ruling.FAILS


def _say(holds: bool) -> Ruling:
    return Ruling.HOLDS if holds else Ruling.FAILS


def describe(claim: ClaimRow, result: Found | None) -> str:
    """Return our numbers as a cell shows them; long series by their ends, runs by the rank of the printed value."""
    if result is None:
        return "no feasible result"
    values = np.asarray(result.values, dtype=float)
    if claim.parts[0] == "rank":
        rows = np.atleast_2d(values)
        ranks = " / ".join(str((row < printed).sum()) for row, printed in zip(rows, claim.values, strict=True))
        ends = "; ".join(f"{row.min():.4g} to {row.max():.4g}" for row in rows)
        return f"{ends}{_space(claim.unit)}; {ranks} of {rows.shape[1]} runs below"
    signed = claim.parts[0] == "within" and claim.signed
    text = "; ".join(_join(row, signed) for row in np.atleast_2d(values)) + _space(claim.unit)
    if result.p is None:
        return text
    tests = np.atleast_1d(result.p)
    spread = f" ({tests.min():.2g} to {tests.max():.2g} in {tests.size} tests)" if tests.size > 1 else ""
    return f"{text}, p = {np.median(tests):.2g}{spread}"


def _join(row: Sequence[float], signed: bool) -> str:
    sign = "+" if signed else ""
    shown = [format(value, f"{sign}z.{6 if float(value).is_integer() else 4}g") for value in row]
    return f"{shown[0]} to {shown[-1]}" if len(shown) > 8 else " / ".join(shown)


def _space(unit: str) -> str:
    return f" {unit}" if unit else ""
