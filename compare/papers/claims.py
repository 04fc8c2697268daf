"""What papers print: claims, our differences and tables, read from TOML files next to the code that checks them.

A verdict never looks at signs alone: rules such as ``compare_levels`` compare sizes with the tolerance that the claim states; a
check that decides by other means names them in the claim's ``criterion``.
"""

import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from importlib import resources
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from compare.report.document import Table
from nlp_gait.decoding import decode

CALL = ("check", "part", "arguments")  # keys of a claim in its file that say what decides, see ``bind_checks``
ROUNDING = 1e-9  # of a tolerance, so that a value at its edge is within it
SIGNIFICANT = 0.05  # p-value below which a difference is not put down to chance
T = TypeVar("T")


class ClaimVerdict(StrEnum):
    """What the numbers say about a claim."""

    HOLDS = "holds"
    SIZE_DIFFERS = "direction holds, size does not"
    FAILS = "does not hold"
    NOT_SHOWN = "not shown"
    UNTESTABLE = "cannot be tested here"


class Series(list[float]):
    """Values that a text shows next to each other."""

    def __format__(self, spec: str) -> str:
        return " / ".join(format(value, spec or ".4g") for value in self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A claim of a paper, and what is found here; texts have fields such as ``{power:.2f}`` for values of its check."""

    where: str  # section, table, page or source
    text: str  # what is claimed
    printed: str = ""  # value in print
    criterion: str = ""  # what decides, where the claim leaves it open
    # Of sizes, for example "5 %" of the printed value, or "2 mm" in the unit of the compared values.
    tolerance: str = ""
    least: str = ""  # smallest change that counts where no size is printed, for example "1 %" in the unit of the change
    found: str = ""  # our numbers
    verdict: str = ""  # a ``ClaimVerdict``; in a file only of a claim without a check
    detail: str = ""  # of the verdict, for example by how much a claim holds
    reading_of: str = ""  # id of the row of the same claim in its first reading


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A difference between a paper and our computation; texts have fields for values of the report."""

    where: str  # equation, section or table
    printed: str
    ours: str
    reason: str = ""
    option: str = ""  # that selects the printed choice
    effect: str = ""  # of the difference, as a number: the same result with the printed choice
    cannot_run: str = ""  # why there is no such result


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimsFile:
    """Content of ``<paper>_claims.toml``."""

    claims: Mapping[str, Claim] = field(default_factory=dict)  # by id, in the order of the report
    differences: tuple[Difference, ...] = ()


@dataclass(frozen=True, slots=True)
class Check:
    """The rule that gives the verdict on a claim and its detail, and the values of the fields in the claim's texts."""

    rule: Callable[[Claim], tuple[ClaimVerdict, str]]
    values: Mapping[str, Any]

    def apply(self, claim: Claim) -> Claim:
        """Return the claim with this verdict; the text of the detail of a claim that does not hold is dropped."""
        verdict, note = self.rule(claim)
        texts = {name: text.format_map(self.values) for name, text in asdict(claim).items()}
        detail = "" if verdict is ClaimVerdict.FAILS else texts["detail"]
        return replace(claim, **{**texts, "verdict": verdict, "detail": f"{detail} {note}".strip()})


def decide(verdict: bool | ClaimVerdict | Sequence[bool], /, **values: Any) -> Check:
    """Return a check whose verdict is given, or whether the claim holds; the claim states its criterion.

    Of several readings of the paper, under each of which it holds or not, all have to agree: else it cannot be tested.
    """
    counts, detail = Counter(np.atleast_1d(verdict).tolist()), ""
    if len(counts) == 2:
        verdict = ClaimVerdict.UNTESTABLE
        detail = f"(holds under {counts[True]} of {counts.total()} readings)"
    elif not isinstance(verdict, ClaimVerdict):
        verdict = ClaimVerdict.HOLDS if counts[True] else ClaimVerdict.FAILS
    return Check(lambda _: (verdict, detail), values)


def compare_levels(printed: ArrayLike, ours: ArrayLike, signed: bool = False, /, **values: Any) -> Check:
    """Return a check of values: the claim holds if all of ours are within its tolerance.

    Signed values are changes, whose signs have to be the printed ones, too; if only these are, their direction holds.
    """

    def rule(claim: Claim) -> tuple[ClaimVerdict, str]:
        same = np.atleast_1d(np.sign(ours) == np.sign(printed)) | (not signed)
        within = _find_within(claim, printed, ours) & same
        kept = ClaimVerdict.SIZE_DIFFERS if signed and same.all() else ClaimVerdict.FAILS
        verdict = ClaimVerdict.HOLDS if within.all() else kept
        if within.size > 1:
            return verdict, f"({within.sum()} of {within.size} within the tolerance)"
        sizes = f"(printed {float(np.squeeze(printed)):z.4g}, here {float(np.squeeze(ours)):z.4g})"
        return verdict, "" if within.all() else sizes

    return Check(rule, values)


def compare_changes(printed: ArrayLike, ours: ArrayLike, /, **values: Any) -> Check:
    """Return a check of signed values."""
    return compare_levels(printed, ours, True, **values)


def compare_readings(printed: ArrayLike, ours: ArrayLike, /, **values: Any) -> Check:
    """Return a check of values (n,) by ours (readings, n), where a paper can be read or measured in several ways.

    The claim holds if all are within its tolerance. It does not hold if one value is too high under every reading, or too low
    under every one. Otherwise the choice of a reading would decide, and it cannot be tested.
    """

    def rule(claim: Claim) -> tuple[ClaimVerdict, str]:
        rows = np.atleast_2d(ours)
        off = [np.where(_find_within(claim, printed, row), 0.0, np.sign(row - printed)) for row in rows]
        if not np.any(off):
            return ClaimVerdict.HOLDS, ""
        wrong = np.abs(np.mean(off, axis=0)) == 1.0
        if wrong.any():
            return ClaimVerdict.FAILS, f"({wrong.sum()} of {wrong.size} under every reading)" if wrong.size > 1 else ""
        return ClaimVerdict.UNTESTABLE, "(readings differ)"

    return Check(rule, values)


def require_change(ours: ArrayLike, /, **values: Any) -> Check:
    """Return a check of a claim that prints a direction without a size.

    It holds if all of our changes, positive in the claimed direction, are at least as large as the claim's ``least``; of changes
    (readings, n), under every reading.
    """

    def rule(claim: Claim) -> tuple[ClaimVerdict, str]:
        least, _ = _parse_size(claim.least)
        return decide([bool((row >= least).all()) for row in np.atleast_2d(ours)]).rule(claim)

    return Check(rule, values)


def require_feasible(check: Check, infeasible: Iterable[str]) -> Check:
    """Return a check whose verdict is "not shown" if a result that it needs is infeasible, for texts that say by how much."""
    texts = "; ".join(infeasible)
    return Check(lambda _: (ClaimVerdict.NOT_SHOWN, f"({texts})"), check.values) if texts else check


def require_significance(check: Check, test: str, p: float) -> Check:
    """Return a check whose verdict is "not shown" unless the p-value of a test, two-sided, excludes chance."""
    if p < SIGNIFICANT:
        return check
    return Check(lambda _: (ClaimVerdict.NOT_SHOWN, f"({test}, p = {p:.2g})"), check.values)


def _parse_size(text: str) -> tuple[float, str]:
    """Return the number and the unit of a text such as "5 %"; raises ValueError without a number."""
    number, _, unit = text.partition(" ")
    return float(number), unit


def _find_within(claim: Claim, printed: ArrayLike, ours: ArrayLike) -> np.ndarray[Any, np.dtype[np.bool_]]:
    size, unit = _parse_size(claim.tolerance)
    scale = np.abs(printed) / 100 if unit == "%" else 1.0
    return np.atleast_1d(np.abs(np.subtract(ours, printed)) <= size * scale * (1 + ROUNDING))


def read_printed(cls: Callable[..., T], file: str) -> T:
    """Return what a TOML file below this folder contains, as a dataclass.

    Raises:
        ValueError: with the place: a key is missing or unknown, or a value has another type.
    """
    return decode(cls, read_tables(file), file)


def read_claims(file: str) -> ClaimsFile:
    """Return claims and differences; ``like = "id"`` in a claim stands for the fields of an earlier one that it omits."""
    texts = {
        name: {key: value for key, value in claim.items() if key not in CALL}
        for name, claim in _merge_claims(file).items()
    }
    return decode(ClaimsFile, {**read_tables(file), "claims": texts}, file)


def bind_checks(file: str, functions: Mapping[str, Callable[..., Check]]) -> dict[str, Callable[[Any], Check]]:
    """Return the checks of a file's claims by id, as functions of the findings.

    ``check = "name"`` in a claim names the function ``_check_name``, ``arguments`` are its arguments besides the findings, and
    ``part`` is the attribute of the findings that it takes, if not all of them.

    Raises:
        KeyError: there is no such function.
    """

    def bind(check: str, part: str = "", arguments: Mapping[str, Any] | None = None) -> Callable[[Any], Check]:
        function = functions[f"_check_{check}"]
        return lambda findings: function(getattr(findings, part) if part else findings, **(arguments or {}))

    calls = {name: {key: claim[key] for key in CALL if key in claim} for name, claim in _merge_claims(file).items()}
    return {name: bind(**call) for name, call in calls.items() if call}


def _merge_claims(file: str) -> dict[str, dict[str, Any]]:
    claims: dict[str, dict[str, Any]] = {}
    for name, claim in read_tables(file).get("claims", {}).items():
        claims[name] = {**claims.get(claim.pop("like", ""), {}), **claim}
    return claims


def read_tables(file: str) -> dict[str, Any]:
    """Return the content of a TOML file below this folder."""
    return tomllib.loads((resources.files("compare.papers") / file).read_text(encoding="utf-8"))


def make_claims_table(claims: Iterable[Claim]) -> Table:
    """Return the table of claims."""
    rows = [
        {
            "where": claim.where,
            "claim": claim.text,
            "printed": claim.printed,
            "decided by": describe_criterion(claim),
            "found here": claim.found,
            "verdict": f"{claim.verdict} {claim.detail}".rstrip(),
        }
        for claim in claims
    ]
    return _make_table("claims", rows)


def describe_criterion(claim: Claim) -> str:
    """Return what decides about a claim: its criterion, tolerance and least change."""
    parts = [
        claim.criterion,
        claim.tolerance and f"within {claim.tolerance}",
        claim.least and f"at least {claim.least}",
    ]
    return "; ".join(part for part in parts if part)


def fill_differences(differences: Iterable[Difference], values: Mapping[str, Any]) -> list[Difference]:
    """Return differences with values of the report in their texts."""
    return [Difference(**{k: text.format_map(values) for k, text in asdict(row).items()}) for row in differences]


def make_differences_table(differences: Iterable[Difference]) -> Table:
    """Return the table of differences, whose texts are complete."""
    rows = [
        {
            "where": row.where,
            "printed": row.printed,
            "ours": row.ours,
            "reason": row.reason,
            "printed choice by": row.option,
            "effect": row.effect or (row.cannot_run and f"The printed choice cannot run: {row.cannot_run}"),
        }
        for row in differences
    ]
    return _make_table("differences", rows)


def _make_table(name: str, rows: list[dict[str, str]]) -> Table:
    """Table of texts; columns that are empty in all rows are left out."""
    shown = [heading for heading in (rows[0] if rows else {}) if any(row[heading] for row in rows)]
    cells = [[row[heading] for heading in shown] for row in rows]
    return Table(name=name, columns=dict.fromkeys(shown, ""), rows=cells, prose=True)
