"""Where numbers come from: settings and seeds of solvers, and the commands, machines and versions that computed them."""

from __future__ import annotations

import json
from collections.abc import Iterable

from compare.report.document import Section, Table, text_table
from compare.study.manifest import Session
from compare.study.record import RunRecord


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


def make_solver_table(records: Iterable[RunRecord]) -> Table:
    """Return settings, seeds and evaluations of the solvers of all records, a row for each difference."""
    rows: dict[tuple[str, str], list[RunRecord]] = {}
    for record in records:
        rows.setdefault((record.solver, format_settings(record.settings)), []).append(record)
    cells = [
        (
            solver,
            settings,
            f"{min(r.seed for r in group)} to {max(r.seed for r in group)}",
            str(len(group)),
            str(len({r.problem for r in group})),
        )
        for (solver, settings), group in rows.items()
    ]
    return text_table(("solver", "settings", "seeds", "runs", "problems"), cells, prose=True)


def format_settings(settings: object) -> str:
    """Return plain data on one line, without quotes."""
    return json.dumps(settings, sort_keys=True).replace('"', "").strip("{}")
