"""What shipped certificates prove of a problem's optimum, for the problem of a definition."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from compare.analysis.comparison import Comparison
from compare.analysis.units import with_unit
from nlp_gait.backends.identity import HASH

CERTIFICATES = Path(str(files("nlp_gait.proofs") / "certificates"))


@cache
def _bounds() -> Mapping[str, float]:
    """By the hash of a problem, the bound that is closest to its incumbent."""
    found: dict[str, tuple[float, float]] = {}
    for path in CERTIFICATES.glob("*.json"):
        raw = json.loads(path.read_text(encoding="utf-8"))
        proof, problem = raw["certificate"], raw["problem"][HASH]
        gap = abs(proof["bound"] - proof["objective"])
        found[problem] = min(found.get(problem, (gap, proof["bound"])), (gap, proof["bound"]))
    return {problem: bound for problem, (_, bound) in found.items()}


def proven_bound(problem: Mapping[str, Any]) -> float | None:
    """Objective that no feasible point betters, proven by branch and bound; None without a shipped proof.

    Args:
        problem: as in a definition, with the hash of its mathematics and numbers.
    """
    return _bounds().get(str(problem.get(HASH, "")))


def proven_words(problem: Mapping[str, Any], best: float, unit: str) -> str:
    """For example ``no feasible point is better than 0.837410 W, 1 % from it``; empty without a proof."""
    bound = proven_bound(problem)
    if bound is None:
        return ""
    gap = 100 * abs(bound - best) / abs(best)
    return f"no feasible point is better than {with_unit(bound, unit)}, {gap:.2g} % from it (proven)"


def proven_of(comparison: Comparison) -> str:
    """The same of the best that a comparison knows."""
    holder = comparison.reference_holder
    if holder is None:
        return ""
    return proven_words(holder.definition["problem"], comparison.reference, comparison.objective.unit)
