"""Shipped best known values and proven bounds: the references from which gaps are measured."""

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from nlp_gait.backends.exact import describe_difference, hash_json, identify_problem, make_key
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.formulation import Objective
from nlp_gait.gaitbench.facts import SIX_DIGITS
from nlp_gait.gaitbench.generated import is_generated

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
    proven_as: str = ""  #: name of the certificate

    def to_json(self) -> dict[str, Any]:
        """Return value, bound and source as plain data."""
        return {"best_known": self.objective, "proven_bound": self.bound, "best_known_source": self.source}

    def is_beaten_by(self, value: float, objective: Objective) -> bool:
        """Return whether a feasible objective is better than the best known one, beyond the tolerance of feasibility."""
        if self.objective is None or math.isnan(value):
            return False
        return objective.sign * (self.objective - value) > BETTER * abs(self.objective)


@dataclass(frozen=True, kw_only=True)
class Shipped(Reference):
    """A shipped value; its certificate may be of another form of the problem, such as with fixed variables for constants."""

    problem: Mapping[str, Any]  #: as ``identify_problem`` describes it
    found_by: str  #: solvers and their number of runs, in words


@cache
def load_shipped() -> Mapping[str, Shipped]:
    """Return the shipped values by the hash of their problem's key."""
    raw = json.loads(files("compare.study").joinpath("best_known.json").read_text(encoding="utf-8"))
    entries = [decode(Shipped, item) for item in raw]
    return {hash_json(make_key(entry.problem)): entry for entry in entries}


def find_reference(problem: Mapping[str, Any], folder: Path | None = None) -> Reference:
    """Return the reference of a problem as ``identify_problem`` describes it; without a known value, one that says so.

    What is not shipped may be proven in a folder, or in the folder ``certainty`` next to it, by ``nlp-gait certainty``.
    """
    shipped = load_shipped().get(hash_json(make_key(problem)))
    if shipped is None:
        if folder is not None and (proven := _find_proven(problem, folder)):
            return proven
        if generated := _find_generated(str(problem.get("options", {}).get("instance", "")), problem):
            return generated
        listed = any(entry.problem["name"] == problem["name"] for entry in load_shipped().values())
        return Reference(source=f"{OWN}; none is shipped for {'these settings' if listed else 'this problem'}")
    objective, bound = shipped.objective, shipped.bound
    if bound is None or objective is None:
        return replace(shipped, source=f"shipped, best of {shipped.found_by}")
    return replace(shipped, source=f"shipped, proven to {describe_gap(bound, objective)}")


def _find_proven(problem: Mapping[str, Any], folder: Path) -> Reference | None:
    """Return the tightest proof of a problem in a folder or next to it; files that are no certificates are left out."""
    paths = [
        path for place in (folder, folder.parent / "certainty") for path in sorted(place.glob("*-certificate.json"))
    ]
    if not paths:
        return None
    from nlp_gait.proofs.certificate import read_certificate

    proofs = []
    for path in paths:
        with suppress(InputError):
            file = read_certificate(path)
            if not describe_difference(file.problem, problem) and math.isfinite(file.certificate.bound):
                proofs.append((file.certificate.gap, file.certificate, path.name))
    if not proofs:
        return None
    _, proof, name = min(proofs, key=lambda found: found[0])
    source = f"proven to {describe_gap(proof.bound, proof.objective)} by `nlp-gait certainty` on this machine ({name})"
    return Reference(objective=proof.objective, x=proof.x, bound=proof.bound, source=source, proven_as=name)


def _find_generated(id: str, problem: Mapping[str, Any]) -> Reference | None:
    """Return the best known point of a generated instance, which may take some seconds if this machine has not found it yet."""
    from nlp_gait import gaitbench

    if not is_generated(id):
        return None
    instance = gaitbench.load(id)
    if describe_difference(problem, identify_problem(instance.gait_problem)):
        return None
    sign = instance.gait_problem.objective.sign
    source = f"generated with {instance.evidence}"
    return Reference(objective=sign * instance.best_known, x=tuple(instance.best_x.tolist()), source=source)


def describe_gap(bound: float, objective: float) -> str:
    """Return the relative gap of a proof in words: ``six digits`` or ``1 %``."""
    gap = abs(bound - objective) / (abs(objective) or 1.0)
    return "six digits" if gap <= SIX_DIGITS else f"{100 * gap:.2g} %"
