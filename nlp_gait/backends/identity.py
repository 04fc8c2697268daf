"""Identity of a problem: name, options, values, version of its formulas, and hashes of the user's files that it is made of."""

import hashlib
import inspect
import json
from collections.abc import Mapping
from typing import Any

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import find_maker
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import shorten_name


def hash_json(data: Any) -> str:
    """Return the SHA-256 of plain data."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def identify_problem(problem: GaitProblem) -> dict[str, Any]:
    """Return how to load a problem, and what it was made of; of a problem that no name loads, a hash of its formulas."""
    changed = {q.name: v for q, v in zip(problem.parameters, problem.p.tolist(), strict=True) if v != q.default}
    identity: dict[str, Any] = {"name": problem.address, "options": dict(problem.options), "parameters": changed}
    identity["mathematics"] = problem.mathematics
    files = dict(problem.files) if problem.has_origin else {"formulas": problem.build_once(hash_formulas)}
    return {**identity, "files": files} if files else identity


def hash_formulas(problem: GaitProblem) -> str:
    """Return a hash of a problem's exact function as CasADi writes it, of its rows' names, and of the parameters' defaults."""
    model = build_exact_model(problem)
    return hash_json([model.function.serialize(), model.row_names, [(q.name, q.default) for q in problem.parameters]])


def make_key(identity: Mapping[str, Any]) -> dict[str, Any]:
    """Return an identity without folders and without options that have their defaults: a new option changes no key."""
    name, files = identity["name"], identity.get("files", {})
    parameters = inspect.signature(find_maker(name)).parameters if name in PROBLEMS else {}
    options = {
        key: files.get(key, value)
        for key, value in identity["options"].items()
        if key not in parameters or parameters[key].default != value
    }
    return {"mathematics": 1, **identity, "name": shorten_name(name), "options": options, "files": dict(files)}


def describe_difference(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """Return in words how two problems differ; empty if they are the same."""
    a, b = make_key(before), make_key(after)
    for part, words in (("mathematics", "version of the formulas"), ("name", "name")):
        if a[part] != b[part]:
            return f"its {words} is {b[part]}, not {a[part]}"
    if a["files"] != b["files"]:
        changed = sorted(name for name in {**a["files"], **b["files"]} if a["files"].get(name) != b["files"].get(name))
        return f"the user's files that it is made of have changed ({', '.join(changed)})"
    for part, word in (("options", "option"), ("parameters", "parameter")):
        for name in {**a[part], **b[part]}:
            if a[part].get(name) != b[part].get(name):
                default = "its default"
                return f"{word} {name} is {b[part].get(name, default)}, not {a[part].get(name, default)}"
    return ""
