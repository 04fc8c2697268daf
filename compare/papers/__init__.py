"""Reproductions of papers: their tables, figures and claims next to ours."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from compare.papers.paper import Paper
from nlp_gait.errors import unknown

# Modules with a REPRODUCTION, by name of the paper.
REPRODUCTIONS = {
    "nao": "compare.papers.nao.nao",
    "walk12": "compare.papers.walk12.walk12",
    "stairs": "compare.papers.stairs.stairs",
}


def load_reproduction(paper: str) -> Paper[Any, Any]:
    """Return the reproduction of a paper.

    Raises:
        UnknownNameError: there is no reproduction of that name.
    """
    if paper not in REPRODUCTIONS:
        raise unknown("reproduction", paper, REPRODUCTIONS)
    reproduction: Paper[Any, Any] = import_module(REPRODUCTIONS[paper]).REPRODUCTION
    return reproduction
