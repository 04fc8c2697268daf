"""The common frame of the reproductions of papers.

A reproduction runs what a paper ran, checks its claims, and writes tables, figures and a report. Its text is a template in
Markdown (see ``compare.report.template``) with places for values, tables and figures; ``{claims}`` is the table of claims.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from compare.drawing.figures import style
from compare.papers.paper_runs import Effort, Runner
from compare.report.document import Rows, Table
from compare.report.template import fill_template
from compare.report.writing import write_document, write_parts
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.files import make_writable_folder
from nlp_gait.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SIGNIFICANT = 0.05  # p-value below which a difference is not put down to chance


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
    """A claim of a paper, and what is found here.

    Attributes:
        where: section, table, page or source.
        text: what is claimed.
        printed: value in print.
        criterion: what decides, where the claim leaves it open.
        found: our numbers.
        verdict: what follows from them.
        detail: of the verdict, for example by how much a claim holds.
    """

    where: str
    text: str
    printed: str = ""
    criterion: str = ""
    found: str
    verdict: Verdict
    detail: str = ""


def check_claim(
    holds: bool, *, where: str, text: str, found: str, printed: str = "", criterion: str = "", detail: str = ""
) -> Claim:
    """Return a claim that holds, as the detail says, or does not hold."""
    verdict = Verdict.HOLDS if holds else Verdict.FAILS
    detail = detail if holds else ""
    return Claim(
        where=where, text=text, printed=printed, criterion=criterion, found=found, verdict=verdict, detail=detail
    )


def make_claims_table(claims: Sequence[Claim]) -> Table:
    """Return the table of claims; columns that are empty in all rows are left out."""
    columns = {
        "where": [claim.where for claim in claims],
        "claim": [claim.text for claim in claims],
        "printed": [claim.printed for claim in claims],
        "decided by": [claim.criterion for claim in claims],
        "found here": [claim.found for claim in claims],
        "verdict": [f"{claim.verdict} {claim.detail}".rstrip() for claim in claims],
    }
    shown = {heading: cells for heading, cells in columns.items() if any(cells)}
    return Table(
        name="claims", columns=dict.fromkeys(shown, ""), rows=list(zip(*shown.values(), strict=True)), prose=True
    )


E = TypeVar("E", bound=Effort)
F = TypeVar("F")


@dataclass(frozen=True, kw_only=True)
class Reproduction(Generic[E, F]):
    """How a paper is reproduced. E is its effort, F its findings: all results of the runs.

    Attributes:
        template: text of the report, a file below this folder.
        full: effort of the paper.
        quick: least effort that fills every table and figure.
        run: computes the findings.
        values: of the places in the text.
        tables: rows by name in the text.
        figures: by name in the text.
        claims: in the order of the report.
        csv_tables: tables that are not in the text.
    """

    template: str
    full: E
    quick: E
    run: Callable[[Runner, E], F]
    values: Callable[[F], Mapping[str, Any]]
    tables: Callable[[F], Mapping[str, Rows]]
    figures: Callable[[F], Mapping[str, Figure]]
    claims: Callable[[F], Sequence[Claim]] = lambda _: ()
    csv_tables: Callable[[F], Sequence[Table]] = lambda _: ()

    def reproduce(self, out: Path, effort: E, progress: Progress, jobs: int | None = None) -> F:
        """Write the report (HTML, Markdown), tables (CSV) and figures (PNG, SVG), and return the findings.

        Args:
            out: folder; results that an earlier call has stored in it are reused.
            effort: how much is computed.
            progress: receives a line for each run, each step and the report, ``effort.steps`` times.
            jobs: worker processes; None for one on each core.

        Raises:
            OutputError: the folder cannot be written to.
        """
        folder = make_writable_folder(out)
        findings = self.run(Runner(folder=folder, progress=progress, jobs=jobs or available_cores()), effort)
        progress("figures, tables and report")
        self.write_report(folder, findings)
        return findings

    def write_report(self, folder: Path, findings: F) -> None:
        """Write the report, tables and figures."""
        text = (resources.files("compare.papers") / self.template).read_text(encoding="utf-8")
        claims = make_claims_table(self.claims(findings))
        with style():
            figures = self.figures(findings)
        document = fill_template(
            text,
            values=self.values(findings),
            tables=self.tables(findings),
            figures=figures,
            whole_tables=[claims],
        )
        write_document(folder, document)
        write_parts(folder, self.csv_tables(findings))
