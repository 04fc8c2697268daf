"""How the commands that ask a question hand out its answer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from compare.cli.common import end_interrupted, print_result, print_table, stdout
from nlp_gait.errors import OutputError

if TYPE_CHECKING:
    from compare.questions.answer import Answer


def hand_out(answer: Answer, folder: Path, as_json: bool, stopped: str = "") -> None:
    """Write an answer and print it, as one JSON object or in tables and sentences.

    Args:
        answer: what was found.
        folder: where the files go.
        as_json: print one JSON object.
        stopped: sentence on where the work was interrupted, if it was; the command ends with it.

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
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")


def _print(answer: Answer) -> None:
    """Sentences and tables in the document's order, without what stands on the page for other programs."""
    from compare.report.document import Table, leaves

    for part in (answer.title, *answer.verdict, *leaves(answer.parts)):
        if isinstance(part, str):
            stdout.print(part, soft_wrap=True)
        elif isinstance(part, Table) and not part.name:
            print_table(part.caption, tuple(part.columns), [[cell.text for cell in row] for row in part.cells])
