"""Options and output of the commands that answer a question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.cli.endings import describe_stored, end_interrupted, fail
from compare.cli.options import RESULTS, AsJson, OutFolder
from compare.cli.printing import describe_command, print_result, print_table, say, show_progress, stdout
from compare.study.store import Store
from nlp_gait.backends.identity import identify_problem
from nlp_gait.files import make_writable_folder
from nlp_gait.interrupts import defer_interrupts

if TYPE_CHECKING:
    from compare.questions.question import Answer, Question


@dataclass(frozen=True, kw_only=True)
class Output:
    """Folder of the answer, and how it is printed."""

    out: OutFolder = RESULTS
    as_json: AsJson = False

    def __post_init__(self) -> None:
        """Require a writable folder before the work."""
        make_writable_folder(self.out)

    def answer(self, question: Question[Any]) -> None:
        """Answer a question, continuing from stored results; write and print the answer, also a partial one after Ctrl-C.

        Raises as ``write``.
        """
        from compare.questions.question import Work

        findings, stopped, notes = None, "", 0
        with show_progress(question.counts, question.total) as advance:

            def progress(note: str) -> None:
                nonlocal notes
                notes += 1
                advance(note)

            try:
                store = Store(self.out, say)
                for found in question.find(Work(store=store, progress=progress)):
                    findings = found
            except KeyboardInterrupt as interrupt:
                part = "" if question.total is None else f" after {notes} of {question.total} {question.counts}"
                stopped = str(interrupt) or f"interrupted{part}"
        if findings is None:
            end_interrupted(f"{stopped}; {describe_stored(self.out)}")
        if store.summary:
            say(store.summary)
        self.write(question.add_best_known(findings), stopped, [identify_problem(question.problem)])
        failures = question.failures(findings)
        if failures:
            fail("; ".join(failures))

    def write(self, answer: Answer, stopped: str = "", problems: Sequence[Mapping[str, Any]] = ()) -> None:
        """Write an answer, citing the sources of problems, and print it; where the work stopped, end with that message.

        Raises OutputError if a file cannot be written; the answer is printed nevertheless.
        """
        from compare.report.writing import add_session

        written: list[Path] = []
        with defer_interrupts() as pressed:
            try:
                written = add_session(answer, describe_command(), problems).write(self.out)
            finally:
                print_result(self.as_json, answer.data, written, lambda: _print(answer))
        if stopped or pressed():
            message = stopped or "interrupted at the end"
            end_interrupted(f"{message}; the results are in {self.out}; rerun the command to continue")


def _print(answer: Answer) -> None:
    """Print sentences and tables, without those for other programs."""
    from compare.report.document import Table, iterate_leaves

    for part in (answer.title, *answer.verdict, *iterate_leaves(answer.parts)):
        if isinstance(part, str):
            stdout.print(part, soft_wrap=True)
        elif isinstance(part, Table) and not part.name:
            print_table(part.caption, tuple(part.columns), [[cell.text for cell in row] for row in part.cells])
