"""GaitBench 1: the definition of each instance, its best known point with its evidence, and values that must never change.

A definition never changes; an instance that has to change gets a new id.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, Literal

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


def read_data(file: str) -> Any:
    """Return the content of one of the package's JSON files."""
    return json.loads(files("nlp_gait.gaitbench").joinpath(file).read_text(encoding="utf-8"))


DEFINITIONS = tuple(decode(Definition, entry) for entry in read_data("definitions.json"))
BY_ID = {definition.id: definition for definition in DEFINITIONS}


def list_instances(subset: Subset = "full") -> tuple[str, ...]:
    """Return the ids of all instances or of the ``"small"`` subset (ten, minutes), from easy to hard; raises UnknownNameError."""
    if subset not in ("small", "full"):
        raise unknown("subset of GaitBench", str(subset), ("small", "full"))
    return tuple(definition.id for definition in DEFINITIONS if definition.small or subset == "full")


def get_definition(id: str) -> Definition:
    """Return the definition of an instance; raises UnknownNameError."""
    if id not in BY_ID:
        raise unknown("instance of GaitBench", id, BY_ID)
    return BY_ID[id]


SIX_DIGITS = 1.01e-6  # a proof with at most this relative gap has six digits: 1e-6, and what rounding adds


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Why the best known objective may be the optimum."""

    starts: int  #: of IPOPT, from random points
    agreeing: int  #: how many of them reach the best within 1e-6, relatively
    cma_runs: int = 0  #: long runs of CMA-ES, which shares nothing with IPOPT but the functions; 0 if there were none
    cma_evaluations: int = 0  #: of each of them
    #: by how much the best of them is worse, relatively; negative if it is better, None if none was feasible
    cma_gap: float | None = None
    #: no feasible point is better than the best known by more than this, relatively; None without a proof
    proven_gap: float | None = None

    def __str__(self) -> str:
        parts = [f"{self.agreeing} of {self.starts} starts of IPOPT"]
        if self.proven_gap is not None:
            six = self.proven_gap <= SIX_DIGITS
            parts.insert(0, "proven to six digits" if six else f"proven to {100 * self.proven_gap:.2g} %")
        elif self.agreeing <= 1:
            parts.insert(0, "best known")
        if self.cma_runs:
            if self.cma_gap is None:
                parts.append("CMA-ES finds nothing feasible")
            elif abs(self.cma_gap) < 1e-8:
                parts.append("CMA-ES ends at the same value")
            else:
                side = "above" if self.cma_gap > 0 else "below"
                parts.append(f"CMA-ES ends {100 * abs(self.cma_gap):.2g} % {side} it")
        return "; ".join(parts)


@dataclass(frozen=True, kw_only=True)
class Probe:
    """Published values at a point, which the instance must always have."""

    x: tuple[float, ...]  # (n,) the point
    objective: float
    violation: float
    rows: float  # sum over all rows k of ``(1 + k % 7) * G[k]``


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Facts about an instance."""

    best_known: float  # least feasible objective known, in the sense of minimisation
    best_x: tuple[float, ...]  # (n,) its point; its violation is exactly zero
    evidence: Evidence
    probes: tuple[Probe, ...] = ()  # of GaitBench 1
    feasible_share: float = math.nan  # of 100 000 uniform random points; NaN for generated instances
    # processor time of one evaluation in a batch of many, on one core of the machine that made the suite [us]; likewise
    evaluation_us: float = math.nan


@cache
def load_facts(file: str = "facts.json") -> Mapping[str, Facts]:
    """Return the facts about all instances of GaitBench 1 by id, or those of another file."""
    return {id: decode(Facts, entry, id) for id, entry in read_data(file).items()}


def find_shipped_facts(id: str) -> Facts | None:
    """Return the facts about an instance of GaitBench 1, or a drawn one with a baseline; None for others."""
    return load_facts().get(id) or load_facts("drawn_facts.json").get(id)
