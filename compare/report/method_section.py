"""The section of a report on methods: counting, settings, machine, versions, seeds, command."""

from __future__ import annotations

import json
from collections.abc import Sequence

from compare.analysis.comparison import Comparison
from compare.analysis.statistics.run_length import Weighting
from compare.report.document import Section, text_table
from compare.study.manifest import Manifest, Session


def method_section(comparisons: Sequence[Comparison], manifest: Manifest, weighting: Weighting) -> Section:
    """Return everything needed to reproduce or question the study."""
    return Section(
        title="Methods",
        parts=(
            _counting(comparisons, weighting),
            _solver_settings(comparisons),
            *(_session(number, session) for number, session in enumerate(manifest.sessions, start=1)),
        ),
    )


def _counting(comparisons: Sequence[Comparison], weighting: Weighting) -> Section:
    sizes = {c.problem: max((len(r.x) for r in c.records), default=0) for c in comparisons}
    rows = [(problem, *(f"{w:g}" for w in weighting.of_kind(n).values())) for problem, n in sizes.items()]
    return Section(
        title="Counting",
        parts=(
            "One evaluation is the objective and all constraints at one point. By default a first derivative counts n + 1, a "
            "Hessian (n + 1)(n + 2)/2 for n variables, objective and constraints separately, like finite differences,"
            " so gradient methods are never favoured. A gradient run reaches its targets at its end. A "
            "polished run includes the cost of its search. Times are wall times of the solve, without building or "
            "compiling.",
            "Searches with equal seeds start from the same points; run k has the study's seed plus k. Settings of all "
            "algorithms are the defaults of their sources; none was tuned on these problems.",
            text_table(("weight of a call", "f", "g", "gradient", "Jacobian", "Hessian"), rows),
        ),
    )


def _solver_settings(comparisons: Sequence[Comparison]) -> Section:
    rows = []
    for comparison in comparisons:
        for solver in comparison.solvers:
            settings = next((r.settings for r in solver.records if r.settings), {})
            seeds = f"{solver.records[0].seed} to {solver.records[-1].seed}"
            rows.append((comparison.problem, solver.name, seeds, _plain(settings)))
        problem = comparison.records[0].definition.get("problem", {})
        rows.append(
            (
                comparison.problem,
                "(problem)",
                "-",
                _plain({**problem.get("options", {}), **problem.get("parameters", {})}),
            )
        )
    return Section(
        title="Settings and seeds", parts=(text_table(("problem", "solver", "seeds", "settings"), rows, prose=True),)
    )


def _session(number: int, session: Session) -> Section:
    rows = [
        ("command", session.command),
        ("started", session.started),
        *session.machine.items(),
        ("workers", session.jobs),
        ("compiled objective", session.kernel),
        ("versions", ", ".join(f"{name} {version}" for name, version in session.versions.items())),
    ]
    return Section(title=f"Session {number}", parts=(text_table(("what", "value"), rows, prose=True),))


def _plain(settings: object) -> str:
    return json.dumps(settings, sort_keys=True).replace('"', "").strip("{}")
