"""The common frame of the reproductions of papers.

A reproduction runs what a paper ran, checks its claims, and writes tables, figures and a report. Its text is a template in
Markdown (see ``fill_template``) with places for values, tables and figures; ``{claims}`` and ``{differences}`` are the
tables of ``<paper>_claims.toml``. To add a claim, add it to that file. If our numbers decide it, ``checks`` has a function with
its id, or the file names one (``claims.bind_checks``); else the file gives ``found`` and ``verdict``. ``summary.json`` has both
tables and what computed them: its copy from a full reproduction, ``docs/papers/<paper>.json``, is what the documentation shows.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from compare.drawing.figures import use_style
from compare.papers.claims import (
    Check,
    Claim,
    ClaimsFile,
    ClaimVerdict,
    decide,
    fill_differences,
    make_claims_table,
    make_differences_table,
    read_claims,
    read_tables,
)
from compare.papers.paper_runs import Effort, Runner
from compare.report.document import Document, Figure, Part, Prose, Rows, Section, Table, make_text_table
from compare.report.provenance import TERMS, format_settings, make_reference_table, make_solver_table
from compare.report.writing import make_citation_section, make_session_section, write_document, write_parts
from compare.study.settings import Session
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.decoding import decode, decode_value
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, make_writable_folder, read_json, write_json
from nlp_gait.progress import Progress, ignore_progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

E = TypeVar("E", bound=Effort)
F = TypeVar("F")
NOTES = {
    "full": [],
    "quick": [
        "Quick run: the fewest runs, points and evaluations that fill every table. Statistics, medians and the verdicts that "
        "rest on them are not those of the full reproduction."
    ],
    "reduced": [
        "Reduced run: its settings differ from those of the full reproduction, see the end. Verdicts are those of this effort."
    ],
}


@dataclass(frozen=True, kw_only=True)
class Reproduction(Generic[E, F]):
    """How a paper is reproduced. E is its effort, F its findings: all results of the runs."""

    name: str  # of the folder, and the beginning of the names of its files
    full: E  # effort of the paper
    run: Callable[[Runner, E], F]  # computes the findings
    values: Callable[[F], Mapping[str, Any]]  # of the places in the text and in the table of differences
    tables: Callable[[F], Mapping[str, Rows]]  # rows by name in the text, which has their headings and formats
    figures: Callable[[F], Mapping[str, Drawing]]  # by name in the text
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

    def reproduce(
        self,
        out: Path,
        effort: E,
        progress: Progress,
        jobs: int | None = None,
        command: str = "python",
        on_outdated: Progress = ignore_progress,
        scheduler: str | None = None,
    ) -> F:
        """Write the report (HTML, Markdown), tables (CSV) and figures (PNG, SVG), and return the findings.

        Args:
            out: folder; results that an earlier call has stored in it are reused.
            effort: how much is computed.
            progress: receives a line for each run, each step and the report, ``effort.steps`` times.
            jobs: worker processes; None for one on each core.
            command: command line, for the report.
            on_outdated: receives a line for each solver whose stored runs are recomputed, with the reason.
            scheduler: address of a Dask scheduler, whose workers perform the runs; None for processes of this machine.

        Raises:
            OutputError: the folder cannot be written to.
            InputError: its list of sessions is damaged.
        """
        folder, jobs = make_writable_folder(out), jobs or available_cores()
        path, sessions = folder / "sessions.json", []
        if os.path.lexists(path):
            with convert_errors(f"{str(path)!r} is damaged", InputError, "delete it; the results stay valid"):
                sessions += decode_value(tuple[Session, ...], read_json(path, "sessions"), "sessions")
        sessions.append(Session.begin(command, scheduler or str(jobs)))
        write_json(path, [asdict(session) for session in sessions])
        runner = Runner(folder=folder, progress=progress, jobs=jobs, scheduler=scheduler, on_outdated=on_outdated)
        findings = self.run(runner, effort)
        progress("figures, tables and report")
        self.write_report(folder, findings, effort, runner, sessions)
        return findings

    def check_claims(self, findings: F, values: Mapping[str, Any] | None = None) -> dict[str, Claim]:
        """Return all claims by id, in the order of the report; their texts may have values of the report."""
        checked = {}
        for name, claim in self.printed.claims.items():
            check = self.checks[name](findings) if name in self.checks else decide(ClaimVerdict(claim.verdict))
            checked[name] = replace(check, values={**(values or {}), **check.values}).apply(claim)
        return checked

    def write_report(self, folder: Path, findings: F, effort: E, runner: Runner, sessions: Sequence[Session]) -> None:
        """Write the report, tables, figures and ``summary.json``."""
        template = (resources.files("compare.papers") / self.name / f"{self.name}_report.md").read_text(
            encoding="utf-8"
        )
        values = {"effort": effort, **self.values(findings)}
        records = runner.records
        claims = self.check_claims(findings, values)
        differences = fill_differences(self.printed.differences, values)
        with use_style():
            figures = self.figures(findings)
        own = {"claims": make_claims_table(claims.values()), "differences": make_differences_table(differences)}
        document = fill_template(template, values=values, tables={**self.tables(findings), **own}, figures=figures)
        label = "full" if effort == self.full else "quick" if effort == self.quick else "reduced"
        settings = [(name, format_settings(value)) for name, value in asdict(effort).items()]
        parts = (make_text_table(("effort", "value"), settings, prose=True), TERMS, make_reference_table(records))
        calls = (make_session_section(k, session) for k, session in enumerate(sessions, start=1))
        title = "Versions, machine, seeds and settings"
        provenance = Section(title=title, parts=(*parts, make_solver_table(records), *calls))
        citations = make_citation_section(record.definition["problem"] for record in records)
        document = replace(
            document,
            title=document.title if label == "full" else f"{document.title} ({label})",
            verdict=[*NOTES[label], count_verdicts(claims)],
            parts=(*document.parts, provenance, citations),
        )
        write_document(folder, document)
        write_parts(folder, self.csv_tables(findings))
        full = asdict(self.full)
        summary = {
            "effort": label,
            "settings": {name: value for name, value in asdict(effort).items() if value != full[name]},
            "session": asdict(sessions[-1]),
            "claims": {name: asdict(claim) for name, claim in claims.items()},
            "differences": [asdict(row) for row in differences],
        }
        write_json(folder / "summary.json", summary)


def count_verdicts(claims: Mapping[str, Claim]) -> str:
    """Return a sentence with the numbers of rows, claims, tested claims and rows by verdict."""
    counts = Counter(claim.verdict for claim in claims.values())
    words = ", ".join(f'{count} "{verdict}"' for verdict, count in counts.items())
    every = {name: claim.reading_of or name for name, claim in claims.items()}
    tested = {every[name] for name, claim in claims.items() if claim.verdict != ClaimVerdict.UNTESTABLE}
    return f"{len(claims)} rows on {len({*every.values()})} claims, of which {len(tested)} are tested here: {words}."


HEADING = re.compile(r"(#+) (.+)")
TABLE = re.compile(r"\{([\w-]+)\}(?:\n\|(.+)\|\n\|(.+)\|)?")
FIGURE = re.compile(r"!\[(.*)\]\((.+)\.png\)", re.DOTALL)


def fill_template(
    text: str,
    *,
    values: Mapping[str, Any],
    tables: Mapping[str, Rows | Table],
    figures: Mapping[str, Drawing],
) -> Document:
    """Return the document of a text.

    Blocks of the text are separated by empty lines. A block is the title after ``#``, a heading after ``##`` or ``###``, a table,
    or ``![what it shows](name.png)`` for the drawing of that name. Anything else is a paragraph, a list or a table in Markdown,
    in which ``{name:.3f}`` is a value as ``str.format`` writes it. A table has three lines, the last one with the formats of the
    columns; ``:--`` in all of them makes it a table of sentences::

        {name}
        | solver | power [W] |
        | | .3f |

    ``{name}`` alone is a table that has its own headings.

    Raises:
        KeyError: the text names a value, table or drawing that is missing.
    """
    title, *blocks = re.split(r"\n{2,}", text.strip())
    open_sections: list[tuple[str, list[Part]]] = [(title.removeprefix("# "), [])]

    def close(level: int) -> None:
        while len(open_sections) > level:
            name, parts = open_sections.pop()
            open_sections[-1][1].append(Section(title=name, parts=parts))

    for block in blocks:
        parts = open_sections[-1][1]
        if heading := HEADING.fullmatch(block):
            close(len(heading[1]) - 1)
            open_sections.append((heading[2].format_map(values), []))
        elif (place := TABLE.fullmatch(block)) and place[1] in tables:
            name, *lines = place.groups()
            table = tables[name]
            filled = (line.format_map(values) for line in lines)
            parts.append(table if isinstance(table, Table) else _make_table(table, name, *filled))
        elif figure := FIGURE.fullmatch(block):
            parts.append(Figure(name=figure[2], caption=figure[1].format_map(values), drawing=figures[figure[2]]))
        else:
            parts.append(Prose(block.format_map(values)))
    close(1)
    return Document(title=open_sections[0][0], parts=open_sections[0][1])


def _make_table(rows: Rows, name: str, header: str, formats: str) -> Table:
    headings, forms = ([cell.strip() for cell in line.split("|")] for line in (header, formats))
    prose = set(forms) == {":--"}
    columns = {heading: "" if prose else form for heading, form in zip(headings, forms, strict=True)}
    return Table(name=name, columns=columns, rows=rows, prose=prose)
