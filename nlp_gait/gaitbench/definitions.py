"""GaitBench 1: the definition of each instance. An entry never changes; an instance that has to change gets a new id."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Literal

from nlp_gait.decoding import decode
from nlp_gait.errors import unknown

Difficulty = Literal["easy", "medium", "hard"]
Subset = Literal["small", "full"]


@dataclass(frozen=True, kw_only=True)
class Definition:
    """What an instance is made from."""

    id: str  #: its name, which never changes
    what: str  #: one line
    problem: str  #: name, as in ``nlp-gait list``
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)  #: of the problem
    values: Mapping[str, float] = field(default_factory=dict)  #: parameters that differ from their defaults
    held: Mapping[str, float] = field(default_factory=dict)  #: variables that are constants here
    #: graded by the results of the shipped baseline: variables, share of feasible points, local optima
    difficulty: Difficulty
    small: bool = False  #: whether it also belongs to the subset ``small``
    source: str  #: paper that the problem comes from


_FILE = files("nlp_gait.gaitbench") / "definitions.json"
DEFINITIONS = tuple(decode(Definition, entry) for entry in json.loads(_FILE.read_text(encoding="utf-8")))
BY_ID = {definition.id: definition for definition in DEFINITIONS}


def names(subset: Subset = "full") -> tuple[str, ...]:
    """Return the ids of all instances or of the ``"small"`` subset (ten, minutes), from easy to hard; raises UnknownNameError."""
    if subset not in ("small", "full"):
        raise unknown("subset of GaitBench", str(subset), ("small", "full"))
    return tuple(definition.id for definition in DEFINITIONS if definition.small or subset == "full")


def get_definition(id: str) -> Definition:
    """Return the definition of an instance; raises UnknownNameError."""
    if id not in BY_ID:
        raise unknown("instance of GaitBench", id, BY_ID)
    return BY_ID[id]
