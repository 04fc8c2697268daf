"""What papers print: claims, our differences and tables, read from TOML files next to the code that checks them."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from importlib import resources
from typing import Any, TypeVar

from compare.report.document import Table
from nlp_gait.decoding import decode

SIGNIFICANT = 0.05  # p-value below which a difference is not put down to chance
T = TypeVar("T")


class Verdict(StrEnum):
    """What the numbers say about a claim."""

    HOLDS = "holds"
    HOLDS_IN_PART = "holds in part"
    SIZE_DIFFERS = "direction holds, size does not"
    FAILS = "does not hold"
    NOT_SHOWN = "not shown"
    UNTESTABLE = "cannot be tested here"


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A claim of a paper, and what is found here; texts have fields such as ``{power:.2f}`` for values of its check."""

    where: str  # section, table, page or source
    text: str  # what is claimed
    printed: str = ""  # value in print
    criterion: str = ""  # what decides, where the claim leaves it open
    found: str = ""  # our numbers
    verdict: str = ""  # a ``Verdict``; in a file only of a claim without a check
    detail: str = ""  # of the verdict, for example by how much a claim holds


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A difference between a paper and our computation; texts have fields for values of the report."""

    where: str  # equation, section or table
    printed: str
    ours: str
    reason: str = ""
    effect: str = ""  # of the difference, as a number


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimsFile:
    """Content of ``<paper>_claims.toml``."""

    claims: Mapping[str, Claim] = field(default_factory=dict)  # by id, in the order of the report
    differences: tuple[Difference, ...] = ()


@dataclass(frozen=True, slots=True)
class Check:
    """Verdict on a claim, and the values of the fields in its texts."""

    verdict: Verdict
    values: Mapping[str, Any]

    def apply(self, claim: Claim) -> Claim:
        """Return the claim with this verdict; the detail of a claim that does not hold is dropped."""
        texts = {name: text.format_map(self.values) for name, text in asdict(claim).items()}
        detail = "" if self.verdict is Verdict.FAILS else texts["detail"]
        return replace(claim, **{**texts, "verdict": self.verdict, "detail": detail})


def decide(verdict: bool | Verdict, **values: Any) -> Check:
    """Return a check whose verdict is given, or whether the claim holds."""
    if not isinstance(verdict, Verdict):
        verdict = Verdict.HOLDS if verdict else Verdict.FAILS
    return Check(verdict, values)


def read_printed(cls: Callable[..., T], file: str) -> T:
    """Return what a TOML file below this folder contains, as a dataclass.

    Raises:
        ValueError: with the place: a key is missing or unknown, or a value has another type.
    """
    return decode(cls, read_tables(file), file)


def read_claims(file: str) -> ClaimsFile:
    """Return claims and differences; ``like = "id"`` in a claim stands for the fields of an earlier one that it omits."""
    raw = read_tables(file)
    claims: dict[str, Any] = {}
    for name, claim in raw.get("claims", {}).items():
        claims[name] = {**claims.get(claim.pop("like", ""), {}), **claim}
    return decode(ClaimsFile, {**raw, "claims": claims}, file)


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
            "decided by": claim.criterion,
            "found here": claim.found,
            "verdict": f"{claim.verdict} {claim.detail}".rstrip(),
        }
        for claim in claims
    ]
    return _make_table("claims", rows)


def make_differences_table(differences: Iterable[Difference], values: Mapping[str, Any]) -> Table:
    """Return the table of differences, with values of the report."""
    rows = [{name: text.format_map(values) for name, text in asdict(row).items()} for row in differences]
    return _make_table("differences", rows)


def _make_table(name: str, rows: list[dict[str, str]]) -> Table:
    """Table of texts; columns that are empty in all rows are left out."""
    shown = [heading for heading in (rows[0] if rows else {}) if any(row[heading] for row in rows)]
    cells = [[row[heading] for heading in shown] for row in rows]
    return Table(name=name, columns=dict.fromkeys(shown, ""), rows=cells, prose=True)
