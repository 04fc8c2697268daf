"""Reproductions of papers: their tables, figures and claims next to ours.

Each folder with a module and a table of claims of the folder's name is a paper; ``compare.papers.paper`` says what they contain.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from compare.papers.paper import Paper
from nlp_gait.errors import UserCodeError, unknown
from nlp_gait.user_code import load_object

REPRODUCTIONS = tuple(sorted(t.stem for t in Path(__file__).parent.glob("*/*.csv") if t.stem == t.parent.name))


def load_reproduction(paper: str) -> Paper[Any, Any]:
    """Return the reproduction of a paper, by name or as FILE.py with a ``REPRODUCTION``.

    Raises:
        UnknownNameError: there is no reproduction of that name.
        UserCodeError: the file has none, or fails.
    """
    if paper.endswith(".py"):
        reproduction = load_object(f"{paper}:REPRODUCTION", "paper")
        if not isinstance(reproduction, Paper):
            raise UserCodeError(f"{paper}: REPRODUCTION must be a compare.papers.paper.Paper, got {reproduction!r}")
        return reproduction
    if paper not in REPRODUCTIONS:
        raise unknown("reproduction", paper, REPRODUCTIONS)
    return import_module(f"compare.papers.{paper}.{paper}").REPRODUCTION
