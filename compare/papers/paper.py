"""The frame of the papers: a paper is a module and a table of claims of the same name, ``mypaper.py`` and ``mypaper.csv``.

A row of the table is a claim that can be tested::

    id,where,claim,printed,unit,rule,note
    power,Table 7,PSO's least power,1.283,W,within 5 %,at the printed solution

The rules are in ``compare.papers.rules``. The module names the readings of the paper, the literal one first, computes results for
each of them, and binds a function to each claim, which returns our numbers. ``examples/your_own_paper.py`` is a complete one.

Beside the module there may be ``differences.csv``, with a row for each thing that is not as printed, ``notes.md``, with what
cannot be tested, and printed tables. The effect of a difference is a text in its row, or a function computes it::

    id,where,printed,here,option,effect
    gravity,(19),z'' - g with g = -9.8,z'' + 9.8,zmp_gravity=printed,

The literal reading decides, or the next one if the print excludes it. Another reading that differs in a choice which the paper
does not print, see ``Paper.choices``, makes a result that it changes depend on that choice. The page shows the citation, three
sentences, the picture with which ``show`` begins, the headlines and what else it returns; notes, claims and differences are
folded.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from compare.analysis.best_known import compute_gap
from compare.analysis.record_statistics import find_best_known
from compare.analysis.units import format_percent, with_unit
from compare.drawing.gait_figure import draw_gaits, prepare_gait
from compare.papers.paper_runs import Effort, Runner, tabulate, tabulate_runs
from compare.papers.rules import ClaimRow, Judgement, Ruling, compare_alternatives, judge
from compare.report.document import Document, Figure, Part, Prose, Section, Table, make_text_table
from compare.report.interactive import describe_gaits
from compare.report.provenance import TERMS, format_settings, make_solver_table
from compare.report.writing import make_citation_section, make_own_version_table, write_document
from compare.study.record import RunRecord, format_now, group_by, list_versions
from compare.study.references import find_reference
from nlp_gait.backends.identity import hash_json, make_key
from nlp_gait.files import make_writable_folder, write_json
from nlp_gait.formulation import GaitProblem, Result

E = TypeVar("E", bound=Effort)
R = TypeVar("R")
MOST_HEADLINES = 10
SETTING = re.compile(r"(--set )?([\w.]+)=(\S+)")


@dataclass(frozen=True, slots=True)
class DifferenceRow:
    """A row of ``differences.csv``."""

    id: str
    where: str  # equation, section or table
    printed: str
    here: str
    option: str  # that selects the printed choice
    effect: str  # in words; empty where a function computes it


def parse_settings(text: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the options NAME=VALUE and the parameters --set NAME=VALUE in a text."""
    options, values = dict[str, Any](), dict[str, Any]()
    for flag, name, value in SETTING.findall(text):
        (values if flag else options)[name] = _parse(value)
    return options, values


def _parse(text: str) -> str | int | float | bool:
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


@dataclass(frozen=True)
class Book:
    """Claims and differences of a paper, and the functions that compute their numbers."""

    name: str
    folder: Path
    claims: Mapping[str, ClaimRow]
    differences: Mapping[str, DifferenceRow]
    functions: dict[str, Callable[..., Any]] = field(default_factory=dict)
    on_runs: set[str] = field(default_factory=set)  # ids that a quick run leaves out

    def bind(self, functions: Mapping[str, Callable[..., Any]], *, runs: bool = False) -> None:
        """Name the functions that return the numbers of claims, by id, or the effects of differences.

        Args:
            functions: of a claim from the results of one reading, to values, ``Found``, ``Alternatives``, or None without a
                feasible result; of a difference from the results of all readings, to words, or numbers by name.
            runs: they need runs of searches, which a quick run leaves out.
        """
        for id, function in functions.items():
            if id in self.functions or id not in {**self.claims, **self.differences}:
                raise KeyError(f"{self.name}: {id!r} is {'bound twice' if id in self.functions else 'in no table'}")
            self.functions[id] = function
        self.on_runs.update(functions if runs else ())

    def check(self) -> None:
        """Raise KeyError if a claim, or a difference without a text, has no function."""
        wanted = [*self.claims, *(row.id for row in self.differences.values() if not row.effect)]
        if missing := [id for id in wanted if id not in self.functions]:
            raise KeyError(f"{self.name}: no function gives the numbers of {', '.join(missing)}")

    @property
    def notes(self) -> list[Part]:
        """Paragraphs of ``notes.md`` beside the module."""
        file = self.folder / "notes.md"
        words = file.read_text(encoding="utf-8") if file.exists() else ""
        return [Section(title="What is not judged, and why", parts=(Prose(words),), folded=True)] if words else []


def read_book(module: str) -> Book:
    """Return the claims and differences of a paper from its module's file."""
    file = Path(module)
    claims = [ClaimRow(**row) for row in read_rows(file.with_suffix(".csv"))]
    differing = file.with_name("differences.csv")
    differences = [DifferenceRow(**row) for row in read_rows(differing)] if differing.exists() else []
    book = Book(file.stem, file.parent, {row.id: row for row in claims}, {row.id: row for row in differences})
    if len({*book.claims, *book.differences}) < len(claims) + len(differences):
        raise ValueError(f"{book.name}: an id has two rows")
    return book


def read_rows(file: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file."""
    return list(csv.DictReader(file.read_text(encoding="utf-8").splitlines(), strict=True))


@dataclass(frozen=True, slots=True)
class Decided:
    """Results on all claims."""

    judged: Mapping[str, Mapping[str, Judgement]]  # by claim and reading
    excluded: Mapping[str, str]  # readings, with the reason
    overall: Mapping[str, Judgement]  # by claim


@dataclass(frozen=True, kw_only=True)
class Paper(Generic[E, R]):
    """How a paper is reproduced. E is its effort, R the results of one reading."""

    book: Book
    title: str
    citation: str = ""
    full: E
    quick: E  # without runs
    readings: Mapping[str, str]  # label to a sentence; the literal one is first
    run_readings: Mapping[str, str] = field(default_factory=dict)  # of the claims on runs; empty: the same
    choices: Mapping[str, str] = field(
        default_factory=dict
    )  # label of a reading to the unprinted choice that it varies
    exclude: Callable[[Mapping[str, R]], Mapping[str, str]] = (
        lambda results: {}
    )  # readings to why the print excludes them
    compute: Callable[[Runner, E], Mapping[str, R]]
    headlines: Sequence[str]  # ids of claims
    show: Callable[[Mapping[str, R]], Sequence[Part]] = lambda results: ()  # figures, sentences and tables

    def __post_init__(self) -> None:
        self.book.check()
        if len(self.headlines) > MOST_HEADLINES or not {*self.headlines} <= {*self.book.claims}:
            raise ValueError(f"{self.name}: headlines are at most {MOST_HEADLINES} ids of claims")

    @property
    def name(self) -> str:
        """Name of the module."""
        return self.book.name

    def reproduce(self, runner: Runner, effort: E, command: str = "python") -> dict[str, Any]:
        """Write the report (HTML, Markdown), tables (CSV) and figures to the runner's folder, and return ``summary.json``.

        Results that an earlier call has stored in the folder are reused. The report names the command.

        Raises:
            OutputError: the folder cannot be written to.
        """
        folder = make_writable_folder(runner.folder)
        results = self.compute(runner, effort)
        runner.progress("figures, tables and report")
        judged, excluded = self.judge(results, effort), self.exclude(results)
        decided = Decided(judged, excluded, {id: self.combine(row, excluded) for id, row in judged.items()})
        sentences = self.conclude(decided.overall)
        label = "full" if effort == self.full else "quick" if effort == self.quick else "reduced"
        parts = self._make_parts(results, decided, effort, runner)
        record = {
            "effort": label,
            "settings": {k: v for k, v in asdict(effort).items() if v != getattr(self.full, k)},
            "made": {"command": command, "date": format_now(), **list_versions()},
            "sentences": sentences,
            "results": {id: str(one.verdict) for id, one in decided.overall.items()},
            "verdicts": {id: {name: str(one.verdict) for name, one in row.items()} for id, row in judged.items()},
            "parts": [encode_part(part) for part in parts],
        }
        write_json(folder / "summary.json", record)
        settings = [(name, format_settings(value)) for name, value in asdict(effort).items()]
        tables = (make_reference_table(runner.records), make_solver_table(runner.records)) if runner.records else ()
        origin = (make_text_table(("effort", "value"), settings, prose=True), TERMS, *tables)
        ending = Section(
            title="Versions, machine, seeds and settings",
            parts=(*origin, make_own_version_table(command)),
            folded=True,
        )
        cited = make_citation_section(record.inputs.problem for record in runner.records)
        title = self.title if label == "full" else f"{self.title} ({label})"
        opening = Prose("\n\n".join([self.citation, *sentences]).strip())
        write_document(folder, Document(title=title, parts=(opening, *parts, ending, cited)))
        return record

    def judge(self, results: Mapping[str, R], effort: E) -> dict[str, dict[str, Judgement]]:
        """Return the results on all claims by reading; claims on runs are not run without runs."""
        return {
            id: {reading: self._judge(id, results, reading, effort) for reading in self._list_readings(id)}
            for id in self.book.claims
        }

    def combine(self, row: Mapping[str, Judgement], excluded: Iterable[str]) -> Judgement:
        """Return the result on a claim in the first reading that is not excluded, unless another choice changes it."""
        remaining = {name: one for name, one in row.items() if name not in {*excluded}} or row
        literal, first = next(iter(remaining.items()))
        others = {n: o for n, o in remaining.items() if n in self.choices and o.verdict is not first.verdict}
        choice = " and ".join(dict.fromkeys(self.choices[name] for name in others))
        return compare_alternatives(choice, {literal: first, **others})

    def conclude(self, overall: Mapping[str, Judgement]) -> list[str]:
        """Return up to three sentences: which headlines hold, which do not, and which are open, by what they depend on."""
        holding, failing, open_by_cause = list[str](), list[str](), dict[str, list[str]]()
        for id in self.headlines:
            claim, one = self.book.claims[id].claim, overall[id]
            if one.verdict is Ruling.HOLDS:
                holding.append(claim)
            elif one.verdict in (Ruling.FAILS, Ruling.SIZE_DIFFERS):
                failing.append(claim + " (its direction holds)" * (one.verdict is Ruling.SIZE_DIFFERS))
            else:
                on = f" {one.here.partition(':')[0]}" if one.verdict is Ruling.DEPENDS else ""
                open_by_cause.setdefault(f"{one.verdict}{on}", []).append(claim)
        each = [f"{'; '.join(group)} ({'each ' * (len(group) > 1)}{cause})" for cause, group in open_by_cause.items()]
        groups = {"Holds": holding, "Does not hold": failing, "Open": each}
        return [f"**{name}:** {'; '.join(claims)}." for name, claims in groups.items() if claims]

    def _list_readings(self, id: str) -> Mapping[str, str]:
        return (self.run_readings or self.readings) if id in self.book.on_runs else self.readings

    def _judge(self, id: str, results: Mapping[str, R], reading: str, effort: E) -> Judgement:
        if id in self.book.on_runs and not effort.runs:
            return Judgement(Ruling.NOT_RUN)
        return judge(self.book.claims[id], self.book.functions[id](results[reading]))

    def _make_parts(self, results: Mapping[str, R], decided: Decided, effort: E, runner: Runner) -> list[Part]:
        folded = list(self.book.notes)
        for name, title in (("claims", "computation"), ("claims-on-runs", "runs of the searches")):
            ids = [id for id in self.book.claims if (id in self.book.on_runs) is (name != "claims")]
            folded += self._fold(name, f"Claims decided by {title}", ids, decided)
        if self.book.differences:
            parts = (self._tabulate_differences(results, effort),)
            folded.append(Section(title="What is not as printed", parts=parts, folded=True))
        if effort.runs:
            folded.append(Section(title="Runs", parts=(tabulate_runs(runner.records),), folded=True))
        shown = list(self.show(results))
        picture = [shown.pop(0)] if shown and isinstance(shown[0], Figure) else []
        return [*picture, self._tabulate_headlines(decided.overall), *shown, *folded]

    def _tabulate_headlines(self, overall: Mapping[str, Judgement]) -> Table:
        rows = []
        for id in sorted(self.headlines, key=lambda id: overall[id].verdict is Ruling.NOT_RUN):
            claim, one = self.book.claims[id], overall[id]
            rows.append({"claim": claim.claim, "printed": _add_unit(claim), "here": one.here, "result": str(one)})
        return tabulate("headlines", "", rows, prose=True)

    def _fold(self, name: str, title: str, ids: Sequence[str], decided: Decided) -> list[Section]:
        """Return a folded table of claims, those first whose result depends on the reading; nothing without claims."""
        if not ids:
            return []
        rows = []
        for id in sorted(ids, key=lambda id: len({one.verdict for one in decided.judged[id].values()}) == 1):
            claim = self.book.claims[id]
            row = {
                "where": claim.where,
                "claim": claim.claim,
                "printed": _add_unit(claim),
                "result": str(decided.overall[id]),
            }
            row |= {"rule": claim.rule, "what is compared": claim.note}
            for reading, one in decided.judged[id].items():
                row[f"reading: {reading}"] = f"{one.verdict}: {one.here}" if one.here else str(one.verdict)
            rows.append(row)
        words = []
        for label, sentence in self._list_readings(ids[0]).items():
            ending = f"; **excluded by the print**: {decided.excluded[label]}" if label in decided.excluded else ""
            ending += f"; not printed: {self.choices[label]}" if label in self.choices else ""
            words.append(f"- *{label}*: {sentence}{ending}")
        parts = (Prose("\n".join(words)), tabulate(name, "", rows, prose=True))
        return [Section(title=title, parts=parts, folded=True)]

    def _tabulate_differences(self, results: Mapping[str, R], effort: E) -> Table:
        rows = []
        for row in self.book.differences.values():
            run = effort.runs or row.id not in self.book.on_runs
            effect = row.effect or (self.book.functions[row.id](results) if run else str(Ruling.NOT_RUN))
            if not isinstance(effect, str):
                effect = "; ".join(
                    f"{n}: {v if isinstance(v, str) else f'{round(v, 6):z.4g}'}" for n, v in effect.items()
                )
            shown = {"where": row.where, "printed": row.printed, "here": row.here, "option": row.option}
            rows.append({**shown, "effect": effect})
        return tabulate("differences", "", rows, prose=True)


def make_gait_figure(caption: str, gaits: Mapping[str, tuple[GaitProblem, Sequence[float]]]) -> Figure:
    """Return a figure of gaits by name, which the page moves."""
    curves = {name: prepare_gait(Result(problem=p, x=p.check_x(x))) for name, (p, x) in gaits.items()}
    return Figure(name="gait", caption=caption, drawing=draw_gaits(curves), gaits=describe_gaits(curves))


def count_results(results: Mapping[str, str]) -> str:
    """Return a sentence with the number of claims by result, from the ``results`` of ``summary.json``."""
    words = ", ".join(f'{n} "{word}"' for word, n in Counter(results.values()).most_common())
    return f"{len(results)} claims: {words}."


def encode_part(part: Part) -> dict[str, Any]:
    """Return a part as plain data, with the cells as the page shows them; of a figure its name and caption."""
    if isinstance(part, Section):
        return {"title": part.title, "parts": [encode_part(child) for child in part.parts]}
    if isinstance(part, Table):
        return {"caption": part.caption, "columns": [*part.columns], "rows": part.cells}
    if isinstance(part, Figure):
        return {"figure": part.name, "caption": part.caption}
    return {"text": part.markdown if isinstance(part, Prose) else str(part)}


def _add_unit(claim: ClaimRow) -> str:
    unit = "" if claim.parts[0] == "p <" else claim.unit  # which is that of the lead
    return f"{claim.printed} {unit}".strip() if claim.printed else ""


def make_reference_table(records: Iterable[RunRecord]) -> Table | str:
    """Return the best of the records next to the shipped best known value, a row for each problem that has one."""
    rows = []
    for group in group_by(records, lambda record: hash_json(make_key(record.inputs.problem))).values():
        reference, objective = find_reference(group[0].inputs.problem), group[0].inputs.objective
        best = find_best_known(group)
        if reference.objective is not None:
            gap = format_percent(compute_gap(best, reference.objective, objective))
            values = (with_unit(value, objective.unit) for value in (best, reference.objective))
            rows.append((group[0].problem, *values, gap, reference.source))
    if not rows:
        return "No best known value is shipped for the settings of these runs; gaps are relative to the best of them."
    header = ("problem", "best of these runs", "best known", "gap", "source of the best known value")
    return make_text_table(header, rows, "Best known values", prose=True)
