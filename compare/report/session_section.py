"""The section of a report with the command, machine and versions that made it."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from compare.report.document import Document, Section, text_table
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


def add_session(document: D, command: str, jobs: str = "1") -> D:
    """Return a document with the session that makes it: this command, machine and versions."""
    return replace(document, parts=(*document.parts, make_session_section(1, Session.begin(command, jobs))))
