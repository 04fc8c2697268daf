"""What is proven about a gait between its samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nlp_gait.errors import CompilerError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs.time_functions import TimeFunctions, TimeRows, time_functions
from nlp_gait.proofs.time_search import GRAIN, ROUNDING, Search, beyond, first_pieces


@dataclass(frozen=True, kw_only=True)
class Breach:
    """A row that does not hold at all times, or is not shown to.

    Attributes:
        row: its name.
        unit: of the row.
        from_s: where the first piece of time begins in which it is not shown to hold [s].
        to_s: where that piece ends [s].
        least: the largest violation over all times is at least this [unit]; 0 if none is proven.
        most: and at most this [unit]; None if nothing is known.
    """

    row: str
    unit: str
    from_s: float
    to_s: float
    least: float
    most: float | None

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        when = f"from {self.from_s:.4g} to {self.to_s:.4g} s"
        if self.most is None:
            return f"{self.row} may fail by any amount, first {when}"
        if self.least > FEASIBILITY_TOLERANCE:
            return f"{self.row} fails by {self.least:.3g} to {self.most:.3g}{unit}, first {when}"
        return f"{self.row} may fail by {self.most:.3g}{unit} at most, first {when}"


@dataclass(frozen=True, kw_only=True)
class Guarantee:
    """What is proven about a gait between its samples.

    Attributes:
        holds: True if all rows that are functions of time hold at all times, to 1e-6 in their units; False if one is proven not
            to; None if neither is shown.
        breaches: rows that do not hold or are not shown to, by the time at which that begins.
        sampled: rows that are stated on samples by definition, and are judged there alone.
        means: bounds of true time means and integrals by the name of the index.
        pieces: of time that were enclosed.
        reason: why nothing is known, or empty.
    """

    holds: bool | None
    breaches: tuple[Breach, ...] = ()
    sampled: tuple[str, ...] = ()
    means: Mapping[str, tuple[float, float]]
    pieces: int = 0
    reason: str = ""

    def __str__(self) -> str:
        if self.reason:
            return f"not known ({self.reason})"
        kept = f"; {', '.join(self.sampled)}: on samples alone" if self.sampled else ""
        if self.holds:
            return f"all limits hold at all times{kept}"
        more = f"; {len(self.breaches) - 1} more rows" if len(self.breaches) > 1 else ""
        return f"{self.breaches[0]}{more}{kept}"

    @property
    def word(self) -> str:
        """Whether all limits hold at all times, for a table."""
        return "?" if self.holds is None else "yes" if self.holds else "no"


def guarantee(problem: GaitProblem, x: Array) -> Guarantee:
    """What is proven about x (n,) at all times.

    Rows of no time, such as those of a switch, are taken as the judge has them.
    """
    if not problem.rows_over_time:
        return Guarantee(holds=None, means={}, reason="sampled by definition: its rows are stated on samples alone")
    try:
        built = problem.build_once(_build_time_functions)
    except CompilerError as error:
        return Guarantee(holds=None, means={}, reason=str(error))
    found = [_examined(problem, part, np.asarray(x, dtype=float)) for part in built]
    means: dict[str, tuple[float, float]] = {}
    for part in found:
        for name, (low, high) in part.means.items():
            before = means.get(name, (0.0, 0.0))
            means[name] = (before[0] + low, before[1] + high)
    breaches = tuple(sorted((b for part in found for b in part.breaches), key=lambda b: b.from_s))
    proven = any(b.least > FEASIBILITY_TOLERANCE for b in breaches)
    return Guarantee(
        holds=False if proven else None if breaches else True,
        breaches=breaches,
        sampled=tuple(dict.fromkeys(name for part in built for name in part.sampled)),
        means=means,
        pieces=sum(part.pieces for part in found),
    )


def _build_time_functions(problem: GaitProblem) -> list[TimeFunctions]:
    return [time_functions(problem, rows) for rows in problem.rows_over_time]


class _Part(NamedTuple):
    breaches: list[Breach]
    means: dict[str, tuple[float, float]]
    pieces: int


def _examined(problem: GaitProblem, part: TimeFunctions, x: Array) -> _Part:
    """Examine one phase, piece by piece."""
    start, end = part.source.times({**problem.by_name(x), **problem.parameter_values})
    step = round(1.0 / part.source.intervals / GRAIN) * GRAIN
    given = np.concatenate([x, problem.p])
    breaches: list[Breach] = []
    means: dict[str, tuple[float, float]] = {}
    pieces = 0
    for rows, plain, shift in ((part.instants, part.plain, None), (part.changes, len(part.changes.names), step)):
        if rows.values is None:
            continue
        lower, upper = rows.limits(problem.p)
        search = Search(rows.values, given, shift, lower[:plain], upper[:plain])
        search.run(first_pieces(part.source.kinks, shift))
        limits = np.stack([lower[plain:], upper[plain:]], axis=-1)
        limits[[k - plain for k in part.squares if shift is None]] **= 2
        search.sharpen_integrals(limits)
        pieces += search.count
        for k in search.open_rows():
            a, b = search.first[k]
            piece = start + a * (end - start), start + b * (end - start)
            breaches.append(_breach(rows, k, piece, float(search.least[k]), float(search.most[k])))
        for k, (low, high) in enumerate(zip(*search.integrals(), strict=True), start=plain):
            if k in part.squares:
                low, high = np.sqrt(max(low, 0.0)) * (1 - ROUNDING), np.sqrt(max(high, 0.0)) * (1 + ROUNDING)
            if not rows.units[k]:
                if np.isfinite(low) and np.isfinite(high):
                    means[rows.names[k]] = (float(low), float(high))
                continue
            most, least = (float(v) for v in beyond(lower[k], upper[k], low, high))
            if not most <= FEASIBILITY_TOLERANCE:
                breaches.append(_breach(rows, k, (start, end), least, most))
    return _Part(breaches, means, pieces)


def _breach(rows: TimeRows, k: int, piece: tuple[float, float], least: float, most: float) -> Breach:
    """Of row k, first in a piece of time [s], by between least and most."""
    known = most if np.isfinite(most) else None
    from_s, to_s = piece
    return Breach(row=rows.names[k], unit=rows.units[k], from_s=from_s, to_s=to_s, least=max(least, 0.0), most=known)
