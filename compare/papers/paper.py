"""The frame of the papers: a paper is a module and a table of claims of the same name, ``mypaper.py`` and ``mypaper.csv``.

A row of the table is a claim that can be tested::

    id,where,claim,printed,unit,rule,note
    power,Table 7,PSO's least power,1.283,W,within 5 %,at the printed solution

The rules are in ``compare.papers.rules``. The module names the readings of the paper, the literal one first, computes results for
each of them, and has a function for each claim, which returns our numbers. ``examples/your_own_paper.py`` is a complete one.

Beside the module there may be ``notes.md``, with what cannot be tested, and ``differences.csv``, with a row for each thing that
is not as printed. Its effect is a text in its row, or a function computes it::

    id,where,printed,here,option,effect
    gravity,(19),z'' - g with g = -9.8,z'' + 9.8,zmp_gravity=printed,

The literal reading decides, or the next one if the print excludes it. Another reading that differs in a choice which the paper
does not print, see ``Paper.choices``, makes a result that it changes depend on that choice.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, TypeVar

from compare.drawing.gait_figure import draw_gaits, prepare_gait
from compare.papers.paper_runs import Effort, Runner, tabulate, tabulate_runs
from compare.papers.rules import ClaimRow, Judgement, Ruling, compare_alternatives, judge
from compare.report.document import Document, Figure, Part, Prose, Section, Table, make_text_table
from compare.report.interactive import describe_gaits
from compare.report.provenance import TERMS, format_settings, make_solver_table
from compare.report.writing import make_own_version_table, write_document
from compare.study.record import format_now, list_versions
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

    @property
    def options(self) -> dict[str, Any]:
        """The options NAME=VALUE of a problem in ``option``."""
        return parse_settings(self.option)[0]


def parse_settings(text: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the options NAME=VALUE and the parameters --set NAME=VALUE in a text."""
    options, values = dict[str, Any](), dict[str, Any]()
    for flag, name, value in SETTING.findall(text):
        (values if flag else options)[name] = _parse(value)
    return options, values


def _parse(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def read_rows(file: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file."""
    return list(csv.DictReader(file.read_text(encoding="utf-8").splitlines(), strict=True))


@dataclass(frozen=True, kw_only=True)
class Paper(Generic[E, R]):
    """How a paper is reproduced. E is its effort, R the results of one reading.

    A function of a claim returns values, ``Found``, ``Alternatives``, or None without a feasible result, from the results of one
    reading; one of a difference returns its effect, from its row and the results of all readings, as numbers by name, or None
    where it was not run.
    """

    module: str  # file of the module, beside its tables
    title: str
    citation: str = ""
    full: E
    quick: E  # without runs
    readings: Mapping[str, str]  # label to a sentence; the literal one is first
    run_readings: Mapping[str, str] = field(default_factory=dict)  # of the claims on runs; empty: the same
    choices: Mapping[str, str] = field(default_factory=dict)  # unprinted choices, by the readings that vary them
    exclude: Callable[[Mapping[str, R]], Mapping[str, str]] = lambda results: {}  # reasons, by excluded reading
    compute: Callable[[Runner, E], Mapping[str, R]]
    numbers: Mapping[str, Callable[[R], Any]]  # of claims, by id
    numbers_of_runs: Mapping[str, Callable[[R], Any]] = field(default_factory=dict)  # which a quick run leaves out
    effects: Mapping[str, Callable[[DifferenceRow, Mapping[str, R]], Any]] = field(default_factory=dict)
    headlines: Sequence[str]  # ids of claims
    show: Callable[[Mapping[str, R]], Sequence[Part]] = lambda results: ()  # a picture, then other parts

    def __post_init__(self) -> None:
        if len(self.headlines) > MOST_HEADLINES or not {*self.headlines} <= {*self.claims}:
            raise ValueError(f"{self.name}: headlines are at most {MOST_HEADLINES} ids of claims")
        bound = [*self.numbers, *self.numbers_of_runs, *self.effects]
        rows = [*self.claims, *(id for id, row in self.differences.items() if not row.effect)]
        if odd := {id for id in {*bound, *rows} if bound.count(id) != 1 or rows.count(id) != 1}:
            raise ValueError(f"{self.name}: these ids need one row and one function each: {', '.join(sorted(odd))}")

    @property
    def name(self) -> str:
        """Name of the module."""
        return Path(self.module).stem

    @cached_property
    def claims(self) -> dict[str, ClaimRow]:
        """Claims by id."""
        return {row["id"]: ClaimRow(**row) for row in read_rows(Path(self.module).with_suffix(".csv"))}

    @cached_property
    def differences(self) -> dict[str, DifferenceRow]:
        """What is not as printed, by id."""
        file = Path(self.module).with_name("differences.csv")
        return {row["id"]: DifferenceRow(**row) for row in read_rows(file)} if file.exists() else {}

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
        overall = {id: self.combine(row, excluded) for id, row in judged.items()}
        sentences = self.conclude(overall)
        label = "full" if effort == self.full else "quick" if effort == self.quick else "reduced"
        shown = self.show(results)
        parts = [*shown[:1], self._tabulate_headlines(overall), *shown[1:], *self._list_notes()]
        parts += self._tabulate_claims(judged, overall, excluded)
        if self.differences:
            parts.append(_fold("What is not as printed", self._tabulate_differences(results)))
        if effort.runs:
            parts.append(_fold("Runs", tabulate_runs(runner.records)))
        record = {
            "made": {"command": command, "date": format_now(), **list_versions()},
            "sentences": sentences,
            "results": {id: str(one.verdict) for id, one in overall.items()},
            "verdicts": {id: {name: str(one.verdict) for name, one in row.items()} for id, row in judged.items()},
            "parts": [encode_part(part) for part in parts],
        }
        write_json(folder / "summary.json", record)
        settings = [(name, format_settings(value)) for name, value in asdict(effort).items()]
        tables = (make_solver_table(runner.records),) if runner.records else ()
        origin = (make_text_table(("effort", "value"), settings, prose=True), TERMS, *tables)
        ending = _fold("Versions, machine, seeds and settings", *origin, make_own_version_table(command))
        title = self.title if label == "full" else f"{self.title} ({label})"
        opening = Prose("\n\n".join([self.citation, *sentences]).strip())
        write_document(folder, Document(title=title, parts=(opening, *parts, ending)))
        return record

    def judge(self, results: Mapping[str, R], effort: E) -> dict[str, dict[str, Judgement]]:
        """Return the results on all claims by reading; claims on runs are not run without runs."""
        judged = {}
        for id, claim in self.claims.items():
            function = self.numbers.get(id) or self.numbers_of_runs[id]
            readings = self.readings if id in self.numbers else self._run_readings
            if id in self.numbers or effort.runs:
                judged[id] = {name: judge(claim, function(results[name])) for name in readings}
            else:
                judged[id] = dict.fromkeys(readings, Judgement(Ruling.NOT_RUN))
        return judged

    @property
    def _run_readings(self) -> Mapping[str, str]:
        return self.run_readings or self.readings

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
            claim, one = self.claims[id].claim, overall[id]
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

    def _list_notes(self) -> list[Section]:
        file = Path(self.module).with_name("notes.md")
        return [_fold("What is not judged, and why", Prose(file.read_text(encoding="utf-8")))] if file.exists() else []

    def _tabulate_headlines(self, overall: Mapping[str, Judgement]) -> Table:
        rows = []
        for id in sorted(self.headlines, key=lambda id: overall[id].verdict is Ruling.NOT_RUN):
            claim, one = self.claims[id], overall[id]
            rows.append({"claim": claim.claim, "printed": _add_unit(claim), "here": one.here, "result": str(one)})
        return tabulate("headlines", "", rows, prose=True)

    def _tabulate_claims(
        self,
        judged: Mapping[str, Mapping[str, Judgement]],
        overall: Mapping[str, Judgement],
        excluded: Mapping[str, str],
    ) -> list[Section]:
        """Return folded tables of the claims, those first whose result depends on the reading."""
        sections = []
        for name, title, ids, readings in (
            ("claims", "computation", self.numbers, self.readings),
            ("claims-on-runs", "runs of the searches", self.numbers_of_runs, self._run_readings),
        ):
            rows, chosen = [], [id for id in self.claims if id in ids]
            for id in sorted(chosen, key=lambda id: len({one.verdict for one in judged[id].values()}) == 1):
                claim = self.claims[id]
                row = {"where": claim.where, "claim": claim.claim, "printed": _add_unit(claim)}
                row |= {"result": str(overall[id]), "rule": claim.rule, "what is compared": claim.note}
                for reading, one in judged[id].items():
                    row[f"reading: {reading}"] = f"{one.verdict}: {one.here}" if one.here else str(one.verdict)
                rows.append(row)
            words = []
            for label, sentence in readings.items():
                ending = f"; **excluded by the print**: {excluded[label]}" if label in excluded else ""
                ending += f"; not printed: {self.choices[label]}" if label in self.choices else ""
                words.append(f"- *{label}*: {sentence}{ending}")
            if rows:
                table = tabulate(name, "", rows, prose=True)
                sections.append(_fold(f"Claims decided by {title}", Prose("\n".join(words)), table))
        return sections

    def _tabulate_differences(self, results: Mapping[str, R]) -> Table:
        rows = []
        for row in self.differences.values():
            numbers = {} if row.effect else self.effects[row.id](row, results)
            words = [f"{n}: {v if isinstance(v, str) else f'{round(v, 6):z.4g}'}" for n, v in (numbers or {}).items()]
            effect = row.effect or "; ".join(words) or str(Ruling.NOT_RUN)
            shown = {"where": row.where, "printed": row.printed, "here": row.here, "option": row.option}
            rows.append({**shown, "effect": effect})
        return tabulate("differences", "", rows, prose=True)


def _fold(title: str, *parts: Part) -> Section:
    return Section(title=title, parts=parts, folded=True)


def make_gait_figure(caption: str, gaits: Mapping[str, tuple[GaitProblem, Sequence[float]]]) -> Figure:
    """Return a figure of gaits by name, which the page moves."""
    curves = {name: prepare_gait(Result(problem=p, x=p.check_x(x))) for name, (p, x) in gaits.items()}
    return Figure(name="gait", caption=caption, drawing=draw_gaits(curves), gaits=describe_gaits(curves))


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
