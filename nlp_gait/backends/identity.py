"""Identity of a problem: hashes of its mathematics, its parameter values and its source."""

import hashlib
import json
from typing import Any

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import hash_files
from nlp_gait.user_code import hash_source

HASH, SOURCE, FORMULAS, FILES = "sha256", "source_sha256", "mathematics_sha256", "files"


def hash_json(data: Any, code: str = "") -> str:
    """Return a hash of plain data, and of the text of the code that uses it."""
    return hashlib.sha256((json.dumps(data, sort_keys=True) + code).encode()).hexdigest()


def fingerprint(problem: GaitProblem) -> dict[str, Any]:
    """Identify a problem's mathematics and parameter values; every number of a robot is part of one of them."""
    formulas = problem.build_once(_hash_mathematics)
    options = dict(problem.options)
    return {"problem": problem.address, "options": options, "parameters": problem.p.tolist(), FORMULAS: formulas}


def _hash_mathematics(problem: GaitProblem) -> str:
    return hashlib.sha256(build_exact_model(problem).function.serialize().encode()).hexdigest()


def _find_files(problem: GaitProblem) -> list[str]:
    return sorted(hash_files(problem.options))


def identify_problem(problem: GaitProblem) -> dict[str, Any]:
    """Return the problem's part of a definition: how to load it, and a hash of its content."""
    content = [problem.build_once(_hash_mathematics), problem.p.tolist(), problem.names]
    part = {"name": problem.address, "options": dict(problem.options), "parameters": dict(problem.values)}
    part[HASH] = hash_json(content)
    files = problem.build_once(_find_files)
    if files:
        part[FILES] = files
    if problem.loaded_as:
        part[SOURCE] = hash_source(problem.loaded_as, "problem")
    return part
