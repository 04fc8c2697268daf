"""Claims of a paper as rows of a table, and the rules that decide about them; see ``compare.papers.paper``.

A rule is one of

- ``within A %`` of the printed values, ``within A UNIT`` in the unit of the row; printed values with a sign are changes: if only
  the signs are the printed ones, the size differs;
- ``rises``, ``falls`` all along a series, optionally by at least ``A %`` of its first value, or ``A UNIT``, from first to last;
- ``p < A``: the value, positive in the claimed direction, and the two-sided p-value of a test, which has to exclude chance (the
  median of those of repeated tests);
- ``at least A UNIT``, ``at most A UNIT``: every value;
- ``same order``: our values have the order of the printed ones;
- ``rank``: the printed values lie within 90 % of our runs. Beyond them by less than their own width one is not excluded;
- ``ahead``: leads of runs over others are positive, or negative, in 95 % of all pairs; otherwise chance decides.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

ROUNDING = 1e-9  # of a tolerance, so that a value at its edge is within it
RIPPLE = 1e-3  # of a value: a series that goes back by less between two points still rises or falls, as local optima differ so
BAND = (0.05, 0.95)  # quantiles of runs
RULE = re.compile(r"(within|rises|falls|p <|at least|at most|same order|rank|ahead)(?: ([\d.e-]+))?(?: (\S.*))?")


class Ruling(StrEnum):
    """What the numbers say about a claim."""

    HOLDS = "holds"
    SIZE_DIFFERS = "size differs"  # the direction is the printed one
    FAILS = "does not hold"
    DEPENDS = "depends"  # on a choice that the paper does not print
    NOT_SHOWN = "not shown"  # chance is not excluded, or no feasible result was found
    NOT_RUN = "not run"  # with this effort


MARKS = dict(zip(Ruling, "✔≈✘◆?–", strict=True))


@dataclass(frozen=True, slots=True)
class Judgement:
    """The result on a claim, and our numbers."""

    verdict: Ruling
    here: str = ""

    def __str__(self) -> str:
        return f"{MARKS[self.verdict]} {self.verdict}"


@dataclass(frozen=True, slots=True)
class Found:
    """Our numbers: values, series (k, n), or the final values of runs (k, n), and the two-sided p-values of a test (m,)."""

    values: Any
    p: Any = None


@dataclass(frozen=True, slots=True)
class Alternatives:
    """Our numbers by the values of a choice that the paper does not print."""

    choice: str  # "the time of a step"
    found: Mapping[str, Any]


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


def judge(claim: ClaimRow, value: Any) -> Judgement:
    """Return the result on a claim from what its function returned; alternatives that differ make it depend on their choice."""
    if isinstance(value, Alternatives):
        return compare_alternatives(value.choice, {label: judge(claim, one) for label, one in value.found.items()})
    found = value if value is None or isinstance(value, Found) else Found(value)
    return Judgement(decide(claim, found), describe(claim, found))


def compare_alternatives(choice: str, judged: Mapping[str, Judgement]) -> Judgement:
    """Return the common result of alternatives, or that it depends on their choice, with each of them."""
    first = next(iter(judged.values()))
    if len(judged) == 1:
        return first
    if all(one.verdict is first.verdict for one in judged.values()):
        return Judgement(first.verdict, "; ".join(f"{label}: {one.here}" for label, one in judged.items()))
    words = "; ".join(f"{label}: {one.verdict} ({one.here})" for label, one in judged.items())
    return Judgement(Ruling.DEPENDS, f"on {choice}: {words}")


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
    if kind == "ahead":
        low, high = np.quantile(np.atleast_2d(ours), BAND, axis=1) / 100
        if (low > RIPPLE).all():
            return Ruling.HOLDS
        return Ruling.FAILS if (high < -RIPPLE).any() else Ruling.NOT_SHOWN
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
    low, high = np.quantile(runs, BAND, axis=1)
    beyond = np.maximum(low - printed, printed - high)
    if (beyond <= 0).all():
        return Ruling.HOLDS
    return Ruling.NOT_SHOWN if (beyond <= high - low).all() else Ruling.FAILS


def _say(holds: bool) -> Ruling:
    return Ruling.HOLDS if holds else Ruling.FAILS


def describe(claim: ClaimRow, result: Found | None) -> str:
    """Return our numbers as a cell shows them; long series by their ends, runs by the rank of the printed value."""
    if result is None:
        return "no feasible result"
    values, kind = np.asarray(result.values, dtype=float), claim.parts[0]
    unit = f" {claim.unit}" if claim.unit else ""
    if kind == "rank":
        rows = np.atleast_2d(values)
        ranks = " / ".join(str((row < printed).sum()) for row, printed in zip(rows, claim.values, strict=True))
        ends = "; ".join(f"{row.min():.4g} to {row.max():.4g}" for row in rows)
        return f"{ends}{unit}; {ranks} of {rows.shape[1]} runs below"
    if kind == "ahead":
        ends = np.quantile(np.atleast_2d(values), BAND, axis=1).T
        return (
            "; ".join(f"{low:.1f} to {high:.1f}" for low, high in ends) + f"{unit} (90 % of {values.shape[-1]} pairs)"
        )
    signed = kind == "within" and claim.signed
    text = "; ".join(_join(row, signed) for row in np.atleast_2d(values)) + unit
    if kind == "within" and values.size > 3:
        text += f"; {_count_rounded(claim, values)} of {values.size} round to the print"
    if result.p is None:
        return text
    tests = np.atleast_1d(result.p)
    spread = f" ({tests.min():.2g} to {tests.max():.2g} in {tests.size} tests)" if tests.size > 1 else ""
    return f"{text}, p = {np.median(tests):.2g}{spread}"


def _count_rounded(claim: ClaimRow, values: np.ndarray[Any, Any]) -> int:
    """Return how many values are the printed ones, rounded to as many decimals."""
    decimals = [len(printed.partition(".")[2]) for printed in claim.printed.split(" / ")]
    pairs = zip(values, claim.values, decimals, strict=True)
    return sum(abs(value - printed) <= 0.5 * 10.0**-digits for value, printed, digits in pairs)


def _join(row: Sequence[float], signed: bool) -> str:
    """Return values with common decimals, four digits of the largest one; each with its own if they differ a thousandfold."""
    sign, sizes = "+" if signed else "", [abs(value) for value in row if value]
    form = f"{sign}z.4g"
    if all(float(value).is_integer() for value in row):
        form = f"{sign}z.0f"
    elif sizes and max(sizes) < 1000 * min(sizes) and len(row) > 1:
        form = f"{sign}z.{max(0, 3 - int(np.floor(np.log10(max(sizes)))))}f"
    shown = [format(value, form) for value in row]
    return f"{shown[0]} to {shown[-1]}" if len(shown) > 9 else " / ".join(shown)
