"""The common frame of the reproductions of papers.

A reproduction runs what a paper ran, checks its claims, and writes tables, figures and a report. Its text is a template in
Markdown (see ``compare.report.template``) with places for values, tables and figures; ``{claims}`` and ``{differences}`` are the
tables of ``<paper>_claims.toml``. To add a claim, add it to that file, and a function with its id to ``checks`` if our numbers
decide it; else the file gives ``found`` and ``verdict``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from compare.drawing.figures import style
from compare.papers.claims import (
    Check,
    Claim,
    ClaimsFile,
    make_claims_table,
    make_differences_table,
    read_claims,
    read_tables,
)
from compare.papers.paper_runs import Effort, Runner
from compare.report.document import Rows, Table
from compare.report.template import fill_template
from compare.report.writing import write_document, write_parts
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.decoding import decode
from nlp_gait.files import make_writable_folder
from nlp_gait.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

E = TypeVar("E", bound=Effort)
F = TypeVar("F")


@dataclass(frozen=True, kw_only=True)
class Reproduction(Generic[E, F]):
    """How a paper is reproduced. E is its effort, F its findings: all results of the runs."""

    name: str  # of the folder, and the beginning of the names of its files
    full: E  # effort of the paper
    run: Callable[[Runner, E], F]  # computes the findings
    values: Callable[[F], Mapping[str, Any]]  # of the places in the text
    tables: Callable[[F], Mapping[str, Rows]]  # rows by name in the text
    figures: Callable[[F], Mapping[str, Figure]]  # by name in the text
    checks: Mapping[str, Callable[[F], Check]] = field(default_factory=dict)  # by id of the claim
    csv_tables: Callable[[F], Sequence[Table]] = lambda _: ()  # that are not in the text

    @cached_property
    def quick(self) -> E:
        """Least effort that fills every table and figure."""
        return decode(type(self.full), read_tables("quick_efforts.toml")[self.name])

    @cached_property
    def printed(self) -> ClaimsFile:
        """Claims of the paper, and our differences."""
        return read_claims(f"{self.name}/{self.name}_claims.toml")

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

    def check_claims(self, findings: F) -> dict[str, Claim]:
        """Return all claims by id, in the order of the report."""
        return {
            name: self.checks[name](findings).apply(claim) if name in self.checks else claim
            for name, claim in self.printed.claims.items()
        }

    def write_report(self, folder: Path, findings: F) -> None:
        """Write the report, tables and figures."""
        template = resources.files("compare.papers") / self.name / f"{self.name}_report.md"
        values = self.values(findings)
        claims = make_claims_table(self.check_claims(findings).values())
        with style():
            figures = self.figures(findings)
        document = fill_template(
            template.read_text(encoding="utf-8"),
            values=values,
            tables=self.tables(findings),
            figures=figures,
            whole_tables=[claims, make_differences_table(self.printed.differences, values)],
        )
        write_document(folder, document)
        write_parts(folder, self.csv_tables(findings))
