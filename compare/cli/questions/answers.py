"""Where the commands that ask a question put its answer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.cli.common import end_interrupted, print_result, print_table, say, stdout
from compare.cli.options import RESULTS, AsJson
from nlp_gait.files import make_writable_folder
from nlp_gait.interrupts import defer_interrupts

if TYPE_CHECKING:
    from compare.questions.answer import Answer
    from compare.study.store import Store


@dataclass(frozen=True, kw_only=True)
class Output:
    """The folder of an answer, which is checked before the work, and how the answer is printed."""

    out: Annotated[Path, typer.Option(help="Folder for report, tables, pictures and data.")] = RESULTS
    as_json: AsJson = False

    def __post_init__(self) -> None:
        """Refuse a folder that cannot be written to."""
        make_writable_folder(self.out)

    def take(self, answer: Answer, stopped: str = "", store: Store | None = None) -> None:
        """Write an answer and print it, as one JSON object or in tables and sentences.

        Args:
            answer: what was found.
            stopped: sentence on where the work was interrupted, if it was; the command ends with it.
            store: of finished results; reports how many were stored by an earlier run.

        Raises:
            OutputError: a file cannot be written; the answer is printed all the same.
        """
        if store is not None and store.summary:
            say(store.summary)
        written: list[Path] = []
        with defer_interrupts() as pressed:  # it takes a moment; pressed again, Ctrl-C does not wait
            try:
                written = answer.write(self.out)
            finally:
                print_result(self.as_json, answer.data, written, lambda: _print(answer))
        if stopped or pressed():
            end_interrupted(
                f"{stopped or 'interrupted at the end'}; what was found is in {self.out}; the same command continues"
            )


def _print(answer: Answer) -> None:
    """Sentences and tables in the document's order, without what stands on the page for other programs."""
    from compare.report.document import Table, iterate_leaves

    for part in (answer.title, *answer.verdict, *iterate_leaves(answer.parts)):
        if isinstance(part, str):
            stdout.print(part, soft_wrap=True)
        elif isinstance(part, Table) and not part.name:
            print_table(part.caption, tuple(part.columns), [[cell.text for cell in row] for row in part.cells])
