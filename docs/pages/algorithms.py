"""One page of all algorithms and solvers with their settings and sources."""

from __future__ import annotations

from pathlib import Path

import metaheuristics
from compare.report.provenance import Description, describe_solver
from docs.pages.markdown import code, literal, page, table, write_all
from metaheuristics.multi_objective import FRONT_ALGORITHMS
from nlp_gait.backends.solvers.registry import SOLVERS

INTRODUCTION = """# Algorithms and solvers

Every name here stands wherever a command asks for an algorithm, and settings are given in Python:
`metaheuristics.make_algorithm("pso", population=80)`, `nlp_gait.make_solver("ipopt", ...)`. `nlp-gait list NAME` prints it, too.
[Your own algorithm](../researcher.md) takes part as `FILE.py:NAME`. How often each default search comes within 0.1 % of the
best known point stands on the [page of each problem](problems/index.md)."""
PARTS = {
    "Searches": ("They see the compiled objective in batches, and no derivatives.", metaheuristics.ALGORITHMS),
    "Searches of other packages": (
        "With the extra `algorithms`.",
        metaheuristics.ADAPTERS,
    ),
    "For several objectives": ("For `nlp-gait pareto` only, with the extra `algorithms`.", FRONT_ALGORITHMS),
    "NLP solvers": ("They see the lifted NLP with exact derivatives; see [computing](../computing.md).", SOLVERS),
}


def write(folder: Path) -> None:
    """Write ``algorithms.md`` and nothing else."""
    blocks = [INTRODUCTION]
    for title, (words, names) in PARTS.items():
        blocks += [f"## {title}", words, *(_section(describe_solver(name)) for name in names)]
    write_all(folder, {"algorithms.md": page(*blocks)})


def _section(description: Description) -> str:
    rows = [(code(s.name), code(s.default), literal(s.meaning)) for s in description.settings]
    return page(
        f"### {description.name}",
        literal(description.title),
        table(("setting", "default", "what"), rows) if rows else "",
        f"Source: {literal(description.source)}" if description.source else "",
    ).strip()
