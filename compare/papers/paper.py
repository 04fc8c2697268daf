"""The frame of the papers: a paper is a folder with tables in CSV and one module that computes their numbers.

``claims.csv`` has a row for each claim that can be tested, ``differences.csv`` one for each thing that is not as printed, and
printed tables are CSV files beside them::

    id,where,claim,printed,unit,rule,note
    power,Table 7,PSO's least power,1.283,W,within 5 %,at the printed solution
    better,5.3.1,PSO needs less power than GA,,mW,p < 0.05,lead of the medians; rank-sum test of 11 runs
    higher-hip,5.1,a higher hip needs less power,,W,falls,sweep of x1

    id,where,printed,here,option,effect
    gravity,(19),z'' - g with g = -9.8,z'' + 9.8,zmp_gravity=printed,

The rules are in ``compare.papers.rules``. The module names the readings of the paper, the literal one first, computes results for
each of them, and gives the numbers of every claim; what is not computed in a quick run is marked ``runs=True``::

    BOOK = read_book("mypaper")

    @BOOK.claim("power")
    def measure_power(found: Results) -> float:            # results of one reading
        return found.evaluate(PRINTED_X)["power_W"]

    @BOOK.claim("better", runs=True)                       # None: no feasible result
    def measure_lead(found: Results) -> Found:
        return Found(1000 * (median(found.ga) - median(found.pso)), p=rank_sum(found.pso, found.ga))

    @BOOK.effect("gravity")                                # a row of differences.csv without a text of its effect
    def measure_gravity(results: Mapping[str, Results]) -> str:
        return f"margins by {results['physical'].margin_mm - results['literal'].margin_mm:.1f} mm"

    REPRODUCTION = Paper(
        book=BOOK,                                         # raises for ids that only one side knows
        title="...",
        full=MyEffort(runs=11), quick=MyEffort(runs=0),    # without runs, claims on runs are "not run"
        readings={"literal": "as printed", "physical": "..."},
        run_readings={"constant": "...", "damped": "..."}, # of the claims on runs, if they differ
        compute=compute,                                   # (runner, effort) -> results by reading of both kinds
        headlines=("better", "power"),                     # at most ten
        tables=make_tables, figure=draw, explain=explain,
    )

Claims may share a function: ``@BOOK.claim("power-ssp", phase="ssp")`` above ``@BOOK.claim("power-dsp", phase="dsp")``. The page
shows headlines, tables, the figure and what is not explained; claims and differences are folded. The literal reading decides.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, Generic, TypeVar

from compare.drawing.figures import use_style
from compare.papers.paper_runs import Effort, Runner
from compare.papers.rules import ClaimRow, Found, Ruling, decide, describe
from compare.report.document import Document, Figure, Part, Prose, Section, Table, make_text_table
from compare.report.provenance import TERMS, format_settings, make_reference_table, make_solver_table
from compare.report.writing import make_citation_section, make_session_section, write_document
from compare.study.settings import Session
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.files import make_writable_folder, write_json
from nlp_gait.progress import Progress, ignore_progress

E = TypeVar("E", bound=Effort)
R = TypeVar("R")
F = TypeVar("F", bound=Callable[..., Any])
MOST_HEADLINES = 10


@dataclass(frozen=True, slots=True)
class DifferenceRow:
    """A row of ``differences.csv``."""

    id: str
    where: str  # equation, section or table
    printed: str
    here: str
    option: str  # that selects the printed choice
    effect: str  # in words; empty where a function computes it


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict on a claim in one reading, and our numbers."""

    verdict: Ruling
    here: str = ""


@dataclass(frozen=True)
class Book:
    """Claims and differences of a paper, and the functions that compute their numbers."""

    name: str  # of the folder
    claims: Mapping[str, ClaimRow]
    differences: Mapping[str, DifferenceRow]
    functions: dict[str, Callable[..., Any]] = field(default_factory=dict)
    on_runs: set[str] = field(default_factory=set)  # ids that a quick run leaves out

    def claim(self, id: str, *, runs: bool = False, **arguments: Any) -> Callable[[F], F]:
        """Return a decorator for the function that returns the numbers of a claim."""
        return self._bind(id, self.claims, runs, arguments)

    def effect(self, id: str, *, runs: bool = False) -> Callable[[F], F]:
        """Return a decorator for the function that returns the effect of a difference in words."""
        return self._bind(id, self.differences, runs, {})

    def _bind(self, id: str, known: Mapping[str, Any], runs: bool, arguments: Mapping[str, Any]) -> Callable[[F], F]:
        if id not in known or id in self.functions:
            raise KeyError(f"{self.name}: {id!r} is {'bound twice' if id in known else 'in no table'}")

        def bind(function: F) -> F:
            self.functions[id] = partial(function, **arguments)
            if runs:
                self.on_runs.add(id)
            return function

        return bind

    def check(self) -> None:
        """Raise KeyError if a claim, or a difference without a text, has no function."""
        wanted = [*self.claims, *(row.id for row in self.differences.values() if not row.effect)]
        if missing := [id for id in wanted if id not in self.functions]:
            raise KeyError(f"{self.name}: no function gives the numbers of {', '.join(missing)}")


def read_book(name: str) -> Book:
    """Return the claims and differences of the paper in a folder beside this file."""
    claims = [ClaimRow(**row) for row in read_table(name, "claims")]
    differences = [DifferenceRow(**row) for row in read_table(name, "differences")]
    book = Book(name, {row.id: row for row in claims}, {row.id: row for row in differences})
    if len({*book.claims, *book.differences}) < len(claims) + len(differences):
        raise ValueError(f"{name}: an id has two rows")
    return book


def read_table(name: str, table: str) -> list[dict[str, str]]:
    """Return the rows of ``<table>.csv`` in the folder of a paper."""
    text = (resources.files("compare.papers") / name / f"{table}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines(), strict=True))


@dataclass(frozen=True, kw_only=True)
class Paper(Generic[E, R]):
    """How a paper is reproduced. E is its effort, R the results of one reading."""

    book: Book
    title: str
    full: E
    quick: E  # without runs
    readings: Mapping[str, str]  # label to a sentence; the literal one is first
    run_readings: Mapping[str, str] = field(default_factory=dict)  # of the claims on runs; empty: the same
    compute: Callable[[Runner, E], Mapping[str, R]]
    headlines: Sequence[str]  # ids of claims
    tables: Callable[[Mapping[str, R]], Sequence[Table]]
    figure: Callable[[Mapping[str, R]], Figure]
    # What stays unexplained, and what cannot be tested and why, in Markdown
    explain: Callable[[Mapping[str, R]], Sequence[str]]

    def __post_init__(self) -> None:
        self.book.check()
        if len(self.headlines) > MOST_HEADLINES or not {*self.headlines} <= {*self.book.claims}:
            raise ValueError(f"{self.name}: headlines are at most {MOST_HEADLINES} ids of claims")

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.book.name

    def reproduce(
        self,
        out: Path,
        effort: E,
        progress: Progress,
        jobs: int | None = None,
        command: str = "python",
        on_outdated: Progress = ignore_progress,
        scheduler: str | None = None,
    ) -> dict[str, Any]:
        """Write the report (HTML, Markdown), tables (CSV) and the figure, and return the record, ``summary.json``.

        Args:
            out: folder; results that an earlier call has stored in it are reused.
            effort: how much is computed.
            progress: receives a line for each run and each step.
            jobs: worker processes; None for one on each core.
            command: command line, for the report.
            on_outdated: receives a line for each solver whose stored runs are recomputed, with the reason.
            scheduler: address of a Dask scheduler, whose workers perform the runs; None for processes of this machine.

        Raises:
            OutputError: the folder cannot be written to.
        """
        folder, jobs = make_writable_folder(out), jobs or available_cores()
        session = Session.begin(command, scheduler or str(jobs))
        runner = Runner(folder=folder, progress=progress, jobs=jobs, scheduler=scheduler, on_outdated=on_outdated)
        results = self.compute(runner, effort)
        progress("figure, tables and report")
        judged = self.judge(results, effort)
        label = "full" if effort == self.full else "quick" if effort == self.quick else "reduced"
        parts = self._make_parts(results, judged, effort)
        record = {
            "effort": label,
            "settings": {k: v for k, v in asdict(effort).items() if v != getattr(self.full, k)},
            "session": asdict(session),
            "verdicts": {id: {reading: str(one.verdict) for reading, one in row.items()} for id, row in judged.items()},
            "parts": [encode_part(part) for part in parts if not isinstance(part, Figure)],
        }
        write_json(folder / "summary.json", record)
        settings = [(name, format_settings(value)) for name, value in asdict(effort).items()]
        tables = (make_reference_table(runner.records), make_solver_table(runner.records)) if runner.records else ()
        origin = (make_text_table(("effort", "value"), settings, prose=True), TERMS, *tables)
        ending = Section(
            title="Versions, machine, seeds and settings", parts=(*origin, make_session_section(1, session))
        )
        cited = make_citation_section(record.inputs.problem for record in runner.records)
        title = self.title if label == "full" else f"{self.title} ({label})"
        write_document(folder, Document(title=title, headline=[count_verdicts(judged)], parts=(*parts, ending, cited)))
        return record

    def judge(self, results: Mapping[str, R], effort: E) -> dict[str, dict[str, Judgement]]:
        """Return the verdicts on all claims by reading; claims on runs are not run without runs."""
        return {
            id: {reading: self._judge(id, results, reading, effort) for reading in self._list_readings(id)}
            for id in self.book.claims
        }

    def _list_readings(self, id: str) -> Mapping[str, str]:
        return (self.run_readings or self.readings) if id in self.book.on_runs else self.readings

    def _judge(self, id: str, results: Mapping[str, R], reading: str, effort: E) -> Judgement:
        if id in self.book.on_runs and not effort.runs:
            return Judgement(Ruling.NOT_RUN)
        claim, found = self.book.claims[id], self.book.functions[id](results[reading])
        if found is not None and not isinstance(found, Found):
            found = Found(found)
        return Judgement(decide(claim, found), describe(claim, found))

    def _make_parts(
        self, results: Mapping[str, R], judged: Mapping[str, Mapping[str, Judgement]], effort: E
    ) -> list[Part]:
        with use_style():
            figure = self.figure(results)
        own = [id for id in self.book.claims if id not in self.book.on_runs]
        runs = [id for id in self.book.claims if id in self.book.on_runs]
        return [
            self._tabulate_headlines(judged),
            *map(Prose, self.explain(results)),
            *self.tables(results),
            figure,
            self._fold("Claims decided by computation", own, judged),
            self._fold("Claims decided by runs of the searches", runs, judged),
            Section(title="What is not as printed", parts=(self._tabulate_differences(results, effort),), folded=True),
        ]

    def _tabulate_headlines(self, judged: Mapping[str, Mapping[str, Judgement]]) -> Table:
        rows = []
        for id in sorted(self.headlines, key=lambda id: next(iter(judged[id].values())).verdict is Ruling.NOT_RUN):
            claim, row = self.book.claims[id], judged[id]
            first = next(iter(row.values()))
            held = [reading for reading, one in row.items() if one.verdict is Ruling.HOLDS]
            holds_in = "every reading" if len(held) == len(row) else "; ".join(held) or "no reading"
            run = first.verdict is not Ruling.NOT_RUN
            rows.append((claim.claim, _add_unit(claim), first.here, str(first.verdict), holds_in if run else ""))
        headings = ("claim", "printed", "here", "verdict", "holds in")
        return Table(name="headlines", columns=dict.fromkeys(headings, ""), rows=rows, prose=True)

    def _fold(self, title: str, ids: Sequence[str], judged: Mapping[str, Mapping[str, Judgement]]) -> Section:
        readings = self._list_readings(ids[0]) if ids else {}
        rows = []
        for id in ids:
            claim = self.book.claims[id]
            cells = [f"{one.verdict}: {one.here}" if one.here else str(one.verdict) for one in judged[id].values()]
            rows.append((claim.where, claim.claim, _add_unit(claim), claim.rule, claim.note, *cells))
        headings = (
            "where",
            "claim",
            "printed",
            "rule",
            "what is compared",
            *(f"reading: {label}" for label in readings),
        )
        name = "claims" if title.endswith("computation") else "claims-on-runs"
        table = Table(name=name, columns=dict.fromkeys(headings, ""), rows=rows, prose=True)
        words = "\n".join(f"- *{label}*: {sentence}" for label, sentence in readings.items())
        return Section(title=title, parts=(Prose(words), table), folded=True)

    def _tabulate_differences(self, results: Mapping[str, R], effort: E) -> Table:
        rows = []
        for row in self.book.differences.values():
            run = effort.runs or row.id not in self.book.on_runs
            effect = row.effect or (self.book.functions[row.id](results) if run else str(Ruling.NOT_RUN))
            rows.append((row.where, row.printed, row.here, row.option, effect))
        headings = ("where", "printed", "here", "option", "effect")
        return Table(name="differences", columns=dict.fromkeys(headings, ""), rows=rows, prose=True)


def count_verdicts(judged: Mapping[str, Mapping[str, Judgement]]) -> str:
    """Return a sentence with the number of claims by verdict in the literal reading."""
    counts = Counter(next(iter(row.values())).verdict for row in judged.values())
    return (
        f"{len(judged)} claims, in the literal reading: "
        + ", ".join(f'{n} "{word}"' for word, n in counts.items())
        + "."
    )


def encode_part(part: Part) -> dict[str, Any]:
    """Return a text, table or section as plain data, with the cells as the page shows them."""
    if isinstance(part, Section):
        return {"title": part.title, "parts": [encode_part(child) for child in part.parts]}
    if isinstance(part, Table):
        rows = [[cell.text for cell in row] for row in part.cells]
        return {"caption": part.caption, "columns": [*part.columns], "rows": rows}
    return {"text": part.markdown if isinstance(part, Prose) else str(part)}


def _add_unit(claim: ClaimRow) -> str:
    return f"{claim.printed} {claim.unit}".strip() if claim.printed else ""
