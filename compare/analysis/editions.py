"""Different names for problems or solvers of the same name but with different definitions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from compare.study.definition import describe_edition, select_shared
from compare.study.record import RunRecord
from nlp_gait.backends.identity import hash_json

# An edition's name is a label, so that files can be named after it.
NOT_IN_LABELS = re.compile(r"[^A-Za-z0-9._+: -]")
LONGEST = 30


def label_editions(records: Sequence[RunRecord]) -> list[RunRecord]:
    """Rename records whose problem or solver differs from the latest one of that name: ``pso (evaluations 500)``.

    The definition of the first record keeps the name; ``read_records`` puts the latest first.
    """
    first: dict[str, dict[str, Any]] = {}
    named: dict[tuple[str, str], str] = {}
    found = []
    for record in records:
        whole = select_shared(record.definition)
        problem = _name(record.problem, {"problem": whole["problem"], "solver": ""}, first, named)
        solver = _name(f"{problem}\0{record.solver}", whole, first, named).partition("\0")[2]
        found.append(replace(record, problem=problem, solver=solver))
    return found


def _name(
    label: str, definition: Mapping[str, Any], first: dict[str, dict[str, Any]], named: dict[tuple[str, str], str]
) -> str:
    """Return a label with the differences from the first definition of that label."""
    key = label, hash_json(definition)
    if key not in named:
        name = label
        if label in first:
            difference = NOT_IN_LABELS.sub("", describe_edition(definition, first[label]))[:LONGEST]
            name = f"{label} ({difference})"
            name = name if name not in named.values() else f"{label} ({key[1][:8]})"
        first.setdefault(label, dict(definition))
        named[key] = name
    return named[key]
