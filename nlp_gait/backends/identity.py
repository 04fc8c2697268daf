"""Identity of a problem: hashes of its mathematics, its parameter values and its source."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem
from nlp_gait.user_code import hash_source

HASH, SOURCE, FORMULAS = "sha256", "source_sha256", "mathematics_sha256"


def sha256_of(data: Any, code: str = "") -> str:
    """Hash of plain data, and of the text of the code that takes it."""
    return hashlib.sha256((json.dumps(data, sort_keys=True) + code).encode()).hexdigest()


def fingerprint(problem: GaitProblem) -> dict[str, Any]:
    """What identifies a problem's mathematics and its parameter values: every number of a robot is in one of both."""
    return {
        "problem": problem.address,
        "options": dict(problem.options),
        "parameters": problem.p.tolist(),
        FORMULAS: problem.build_once(_hash_mathematics),
    }


def _hash_mathematics(problem: GaitProblem) -> str:
    return hashlib.sha256(build_exact_model(problem).function.serialize().encode()).hexdigest()


def problem_part(problem: GaitProblem) -> dict[str, Any]:
    """A problem in a definition: how to make it again, and the hash of what was made."""
    found = fingerprint(problem)
    content = [found[FORMULAS], found["parameters"], problem.names]
    part = {
        "name": found["problem"],
        "options": found["options"],
        "parameters": dict(problem.values),
        HASH: sha256_of(content),
    }
    if problem.loaded_as:
        part[SOURCE] = hash_source(problem.loaded_as, "problem")
    return part
