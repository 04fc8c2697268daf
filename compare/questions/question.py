"""A question about a problem: its inputs, its stored results, and its answer as a report, tables and JSON.

A new question is one file with a subclass of ``Question``, and a command that declares its options.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from compare.analysis.units import describe_value
from compare.report.document import Document, Table, Value, make_text_table
from compare.report.writing import write_document
from compare.study.memo import Memo
from compare.study.references import find_reference
from nlp_gait.backends.exact import identify_problem
from nlp_gait.decoding import decode_value
from nlp_gait.files import replace_nan, write_json
from nlp_gait.formulation import GaitProblem
from nlp_gait.interrupts import Progress, ignore_progress

T = TypeVar("T")
F = TypeVar("F")


@dataclass(frozen=True, kw_only=True)
class Work:
    """How a question stores its results and reports its progress; by default it does neither."""

    memo: Memo = field(default_factory=Memo)  #: of finished results
    progress: Progress = ignore_progress  #: receives a note after each step

    def compute(self, kind: type[T], name: str, inputs: Mapping[str, Any], function: Callable[[], T]) -> T:
        """Return the stored data class, or tuple of data classes, of a kind, or compute and store it, see ``Memo.compute``.

        Infinite numbers are not stored.
        """

        def compute() -> Any:
            value: Any = function()
            return replace_nan([asdict(item) for item in value] if isinstance(value, tuple) else asdict(value))

        stored: T = decode_value(kind, self.memo.compute(name, inputs, compute), name)
        return stored


@dataclass(frozen=True, kw_only=True, eq=False)
class Question(ABC, Generic[F]):
    """A question about a problem, whose findings are of type F; its fields are its inputs."""

    name: ClassVar[str]  #: of the question and its command
    counts: ClassVar[str] = "steps"  #: what the progress counts

    problem: GaitProblem  #: with its current parameter values

    @property
    def total(self) -> int | None:
        """Number of progress notes; None if unknown."""
        return None

    @abstractmethod
    def find(self, work: Work) -> Iterator[F]:
        """Yield the findings whenever a report can be made of them; the last ones are complete.

        Raises:
            InputError: an input is not allowed, or there is nothing to report.
            KeyboardInterrupt: Ctrl-C; what was yielded before is valid.
        """

    @abstractmethod
    def report(self, findings: F) -> "Answer":
        """Return the answer."""

    def get_optimum(self, findings: F) -> float | None:
        """Return the objective of the best point found for the problem itself; None if only changed problems are solved."""
        return None

    def add_best_known(self, findings: F) -> "Answer":
        """Return the answer with the shipped best known value of the problem and its distance from the optimum found."""
        answer, reference = self.report(findings), find_reference(identify_problem(self.problem))
        data = {**answer.data, **reference.to_json()}
        if reference.objective is None:
            return replace(answer, data=data)
        optimum, what = self.get_optimum(findings), "the optimum found here"
        sentence = describe_value(reference, optimum, self.problem.objective, what)
        return replace(answer, headline=(*answer.headline, f"{sentence}."), data=data)


def find(question: Question[F], work: Work | None = None) -> F:
    """Return the complete findings of a question; raises as ``Question.find``."""
    *_, findings = question.find(work or Work())
    return findings


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer(Document):
    """A report with its data. Named tables are written as CSV files and are not printed."""

    stem: str  #: file name of the report and the data, without suffix
    data: Mapping[str, Any]  #: the whole answer as plain data
    #: gaits or certificates for other commands, by file name without suffix
    results: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def write(self, folder: Path) -> list[Path]:
        """Write report, tables, figures, results and data, and return their paths; raises OutputError if that fails."""
        written = write_document(folder, self, self.stem)
        for name, data in {**self.results, self.stem: self.data}.items():
            written.append(folder / f"{name}.json")
            write_json(written[-1], replace_nan(data))
        return written


def make_table(caption: str, items: Iterable[T], columns: Mapping[str, Callable[[T], str]]) -> Table:
    """Return a table of texts with a row for each item; each column maps an item to its cell."""
    return make_text_table(tuple(columns), [[cell(item) for cell in columns.values()] for item in items], caption)


def make_record_table(name: str, records: Iterable[Any], leave_out: Sequence[str] = ()) -> Table:
    """Return a table that is written to a CSV file with all digits, with a row for each data class or mapping.

    Columns are the fields; parts of a field have its name in front (``x.hip_height_m``, ``reach.0``).
    """
    flat = [dict(_flatten(record)) for record in records]
    names = dict.fromkeys(key for row in flat for key in row if key.partition(".")[0] not in leave_out)
    columns = [key for key in names if not any(other.startswith(f"{key}.") for other in names)]
    rows = [[row.get(key) for key in columns] for row in flat]
    return Table(name=name, columns=dict.fromkeys(columns, ".6g"), rows=rows, caption=f"As in {name}.csv, rounded")


def _flatten(value: Any, path: str = "") -> Iterator[tuple[str, Value]]:
    """Yield paths and values of all numbers and texts in plain data or data classes."""
    if is_dataclass(value):
        value = {item.name: getattr(value, item.name) for item in fields(value)}
    elif isinstance(value, tuple | list):
        value = dict(enumerate(value))
    if not isinstance(value, Mapping):
        yield path, value
        return
    for key, entry in value.items():
        yield from _flatten(entry, f"{path}.{key}" if path else str(key))
