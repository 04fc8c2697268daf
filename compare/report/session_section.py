"""The last sections of every report: the command, machine and versions that made it, and what to cite."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from compare.report.document import Document, Prose, Section, text_table
from compare.study.description import cite_problems
from compare.study.manifest import Session

D = TypeVar("D", bound=Document)


def make_session_section(number: int, session: Session) -> Section:
    """Return the command, machine and versions of a session."""
    rows = [
        ("command", session.command),
        ("started", session.started),
        *session.machine.items(),
        ("workers", session.jobs),
        ("compiled objective", session.kernel),
        ("versions", ", ".join(f"{name} {version}" for name, version in session.versions.items())),
    ]
    return Section(title=f"Session {number}", parts=(text_table(("what", "value"), rows, prose=True),))


def make_citation_section(problems: Iterable[Mapping[str, Any]]) -> Section:
    """Return how to cite the software and the sources of problems, given by name and options."""
    words = "The software and the papers whose problems are used here; `nlp-gait cite` prints these entries:"
    entries = f"```bibtex\n{cite_problems(problems)}\n```"
    return Section(title="How to cite", parts=(Prose(f"{words}\n\n{entries}"),))


def add_session(document: D, command: str, problems: Iterable[Mapping[str, Any]], jobs: str = "1") -> D:
    """Return a document with the session that makes it (this command, machine and versions) and what to cite."""
    ending = (make_session_section(1, Session.begin(command, jobs)), make_citation_section(problems))
    return replace(document, parts=(*document.parts, *ending))
