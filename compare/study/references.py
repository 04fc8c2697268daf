"""Shipped best known values and proven bounds, by the hash of a problem: the references from which gaps are measured."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import HASH, identify_problem
from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError
from nlp_gait.formulation import Objective, load
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.gaitbench.facts import SIX_DIGITS
from nlp_gait.providers import FUNCTIONS, PROBLEMS, import_object

# Relative difference of an objective that is computed on another machine or by other compiled code.
SAME_VALUE = 1e-9
# A result is better than the best known value by more than this, relatively: less is the tolerance of feasibility.
BETTER = 1e-6
OWN = "the best of this study"


@dataclass(frozen=True, kw_only=True)
class Reference:
    """The best known objective of a problem and its source."""

    objective: float | None = None  #: in the problem's sense; None if none is shipped for these settings
    x: tuple[float, ...] = ()  #: (n,) its point
    bound: float | None = None  #: proven: no feasible point has a better objective; None without a certificate
    source: str = OWN  #: in words, for example "shipped, proven to 1 %"
    proven_as: str = ""  #: hash of the problem of the certificate

    def to_json(self) -> dict[str, Any]:
        """Return value, bound and source as plain data."""
        return {"best_known": self.objective, "proven_bound": self.bound, "best_known_source": self.source}

    def is_beaten_by(self, value: float, objective: Objective) -> bool:
        """Return whether a feasible objective is better than the best known one, beyond the tolerance of feasibility."""
        if self.objective is None or math.isnan(value):
            return False
        return objective.sign * (self.objective - value) > BETTER * abs(self.objective)


@dataclass(frozen=True, kw_only=True)
class Shipped:
    """A shipped value."""

    problem: StoredProblem
    objective: float  # in the problem's sense
    x: tuple[float, ...]  # (n,) its point; its total violation is at most the judge's tolerance
    found_by: str  # solvers and their number of runs, in words
    bound: float | None = None  # of its shipped certificate: no feasible point has a better objective
    # Hash of the certificate's problem, which may be another form of this one, such as with fixed variables for constants
    proven_as: str = ""


@cache
def load_shipped() -> tuple[Shipped, ...]:
    """Return the shipped values; equal problems of different names have equal values."""
    raw = json.loads(files("compare.study").joinpath("best_known.json").read_text(encoding="utf-8"))
    return tuple(decode(Shipped, item) for item in raw)


@cache
def _index_by_hash() -> Mapping[str, Shipped]:
    return {entry.problem.sha256: entry for entry in load_shipped()}


def find_reference(problem: Mapping[str, Any]) -> Reference:
    """Return the reference of a problem as ``identify_problem`` describes it; without a shipped value, one that says so.

    The hash decides. It depends on the version of CasADi, so a problem with an unknown hash and the name, options and values of a
    shipped one is accepted if its exact functions have the shipped objective at the shipped point.
    """
    shipped = _index_by_hash().get(str(problem.get(HASH, ""))) or _find_by_settings(json.dumps(problem, sort_keys=True))
    if shipped is None:
        known = any(entry.problem.name == problem.get("name") for entry in load_shipped())
        none = Reference(source=f"{OWN}; none is shipped for {'these settings' if known else 'this problem'}")
        return _find_generated(str(problem.get("options", {}).get("instance", "")), str(problem.get(HASH, ""))) or none
    return Reference(
        proven_as=shipped.proven_as,
        objective=shipped.objective,
        x=shipped.x,
        bound=shipped.bound,
        source=f"shipped, best of {shipped.found_by}"
        if shipped.bound is None
        else f"shipped, proven to {describe_gap(shipped.bound, shipped.objective)}",
    )


@cache
def _find_generated(id: str, sha256: str) -> Reference | None:
    """Return the best known point of a generated instance, which may take some seconds if this machine has not found it yet."""
    instance = import_object(FUNCTIONS["load_generated"])(id)
    if instance is None or identify_problem(instance.gait_problem)[HASH] != sha256:
        return None
    sign = instance.gait_problem.objective.sign
    source = f"generated with {instance.evidence}"
    return Reference(objective=sign * instance.best_known, x=tuple(instance.best_x.tolist()), source=source)


def describe_gap(bound: float, objective: float) -> str:
    """Return the relative gap of a proof in words: ``six digits`` or ``1 %``."""
    gap = abs(bound - objective) / (abs(objective) or 1.0)
    return "six digits" if gap <= SIX_DIGITS else f"{100 * gap:.2g} %"


@cache
def _find_by_settings(description: str) -> Shipped | None:
    """Return the shipped value of a problem with the same name, options and values, if it has the same exact functions."""
    raw = json.loads(description)
    if raw.get("name") not in PROBLEMS:  # user code is not run
        return None
    try:
        problem = decode(StoredProblem, {**raw, HASH: ""})
        return next((s for s in load_shipped() if replace(s.problem, sha256="") == problem and _has_value(s)), None)
    except (GaitError, ValueError):
        return None


def _has_value(shipped: Shipped) -> bool:
    stored = shipped.problem
    problem = load(stored.name, **stored.options).with_values(**stored.parameters)
    if len(shipped.x) != len(problem.names):
        return False
    values = build_exact_model(problem).at(shipped.x, problem.p)
    same = abs(problem.objective.sign * values.cost - shipped.objective) <= SAME_VALUE * abs(shipped.objective)
    return same and values.violation <= FEASIBILITY_TOLERANCE
