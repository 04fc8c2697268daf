"""How the commands that answer a question hand it out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from compare.cli.common import print_result, print_table, stdout
from nlp_gait.errors import OutputError

if TYPE_CHECKING:
    from compare.questions.answer import Answer


def hand_out(answer: Answer, folder: Path, as_json: bool) -> None:
    """Write an answer and print it, as one JSON object or in tables and sentences.

    Raises:
        OutputError: a file cannot be written; the answer is printed all the same.
    """
    written: list[Path] = []
    unwritten: OutputError | None = None
    try:
        written = answer.write(folder)
    except OutputError as error:
        unwritten = error
    print_result(as_json, answer.data, written, lambda: _print(answer))
    if unwritten is not None:
        raise unwritten


def _print(answer: Answer) -> None:
    """Sentences and tables in the document's order, without what stands on the page for other programs."""
    from compare.report.document import Table, leaves

    for part in (answer.title, *answer.verdict, *leaves(answer.parts)):
        if isinstance(part, str):
            stdout.print(part, soft_wrap=True)
        elif isinstance(part, Table) and not part.name:
            print_table(part.caption, tuple(part.columns), [[cell.text for cell in row] for row in part.cells])
