"""Identity of a problem: what it is called and made of, and what it evaluates to at three points.

Keys of files hash names and numbers. A stored value is used only where the problem still evaluates to what was stored with it, to
1e-9 of each row's scale: other formulas for the same functions, names of inner functions and releases of CasADi change nothing.
"""

import hashlib
import inspect
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from nlp_gait.backends.exact import ExactModel, build_exact_model
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import find_maker, hash_files
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import shorten_name

PROBES, FILES, VALUES = "probes", "files", "values"
POINTS, ROWS = 3, 12
AGREEMENT = 1e-9  # in units of each row's scale, or of its value where that is larger
SUM = "weighted sum of all rows and their bounds"
# Fractional parts of multiples of these numbers spread points evenly (Roberts 2018); none lies on a symmetry or a kink.
STEP, SHIFT = 0.7548776662466927, 0.5698402909980532
MIDDLE = 0.5  # width of the probed part of each variable's range


def hash_json(data: Any, code: str = "") -> str:
    """Return a hash of plain data, and of the text of the code that uses it."""
    return hashlib.sha256((json.dumps(data, sort_keys=True) + code).encode()).hexdigest()


def identify_problem(problem: GaitProblem) -> dict[str, Any]:
    """Return how to load a problem, and its probes: objective, violation and rows in units of their scales."""
    identity: dict[str, Any] = {"name": problem.address, "options": dict(problem.options)}
    changed = {
        q.name: value for q, value in zip(problem.parameters, problem.p.tolist(), strict=True) if value != q.default
    }
    identity |= {"parameters": changed, "mathematics": problem.mathematics}
    if files := problem.build_once(_hash_files):
        identity[FILES] = files
    memory = problem.build_once(_make_memory)
    key = problem.p.tobytes()
    if key not in memory:
        memory[key] = _evaluate_probes(problem)
    return {**identity, PROBES: memory[key]}


def fingerprint(problem: GaitProblem) -> dict[str, Any]:
    """Return a problem's identity as inputs of a stored result."""
    identity = identify_problem(problem)
    return {**make_key(identity), PROBES: identity[PROBES]}


def make_key(problem: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the names of files depend on: an identity without paths, of its probes six digits.

    The digits give derived problems of one name, and user code before and after a change, files of their own.
    """
    identity = {key: value for key, value in problem.items() if key not in (PROBES, FILES)}
    numbers = (probe[key] for probe in problem.get(PROBES, ()) for key in ("objective", "violation"))
    digits = " ".join("nan" if number is None else f"{number:.6g}" for number in numbers)
    options = {**_drop_defaults(problem["name"], problem["options"]), **problem.get(FILES, {})}
    return {**identity, "name": shorten_name(problem["name"]), "options": options, VALUES: digits}


def _drop_defaults(name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a problem of this package that differ from its defaults: a new option changes no key."""
    parameters = inspect.signature(find_maker(name)).parameters if name in PROBLEMS else {}
    return {key: value for key, value in options.items() if key not in parameters or parameters[key].default != value}


def split_probes(data: Any) -> tuple[Any, list[Any]]:
    """Return plain data without the probes in it, and these in order."""
    if not isinstance(data, Mapping):
        return data, []
    plain, probes = dict[str, Any](), list[Any]()
    for key, value in data.items():
        if key == PROBES:
            probes.append(value)
            continue
        plain[key], inner = split_probes(value)
        probes += inner
    return plain, probes


def describe_difference(stored: Mapping[str, Any], problem: Mapping[str, Any]) -> str:
    """Return in words how two problems differ, and by how much; empty if they agree, perhaps under two names."""
    if (before := stored.get("mathematics")) != (after := problem.get("mathematics")):
        return f"its formulas are of version {after}, not {before}"
    if stored.get("name") == problem.get("name"):
        values, new_values = stored.get("parameters", {}), problem.get("parameters", {})
        for name in {**values, **new_values}:
            if values.get(name) != new_values.get(name):
                return (
                    f"parameter {name} is {new_values.get(name, 'its default')}, not {values.get(name, 'its default')}"
                )
    return _compare_probes(stored.get(PROBES, ()), problem.get(PROBES, ()))


def _compare_probes(before: Sequence[Mapping[str, Any]], after: Sequence[Mapping[str, Any]]) -> str:
    if not before or len(before) != len(after):
        return "it was stored without probes, so it cannot be compared" if not before else "its probes are incomplete"
    differences = [
        difference for k, pair in enumerate(zip(before, after, strict=True), 1) for difference in _compare(k, *pair)
    ]
    return max(differences)[1] if differences else ""


def _compare(number: int, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[tuple[float, str]]:
    """Yield the differences of two probes in units of their scales, each with a sentence."""
    if len(before["x"]) != len(after["x"]):
        yield math.inf, f"it has {len(after['x'])} variables, not {len(before['x'])}"
        return
    pairs = {f"variable {k}": pair for k, pair in enumerate(zip(before["x"], after["x"], strict=True))}
    pairs |= {key: (before[key], after[key]) for key in ("objective", "violation")}
    for name in dict.fromkeys((*before["rows"], *after["rows"])):
        if name not in before["rows"] or name not in after["rows"]:
            yield math.inf, f"only one of them has the constraint {name}"
            continue
        pairs[name] = before["rows"][name], after["rows"][name]
    for name, (a, b) in pairs.items():
        if a == b:
            continue
        if a is None or b is None:
            yield math.inf, f"{name} at probe {number} is {b}, not {a}"
            continue
        size = max(abs(a), abs(b), 0.0 if name == "objective" else 1.0)
        if not abs(a - b) <= AGREEMENT * size:
            yield (
                abs(a - b) / size,
                f"{name} at probe {number} is {b:.10g}, not {a:.10g}: {abs(a - b) / size:.2g} of its scale",
            )


def _hash_files(problem: GaitProblem) -> dict[str, str]:
    return dict(sorted(hash_files(problem.options).items()))


def _make_memory(problem: GaitProblem) -> dict[bytes, list[dict[str, Any]]]:
    """Return the probes by parameter values, at first none; copies with other values share it."""
    return {}


def _evaluate_probes(problem: GaitProblem) -> list[dict[str, Any]]:
    n = np.arange(1, len(problem.names) + 1)
    width = problem.upper - problem.lower
    shares = [(1.0 - MIDDLE) / 2 + MIDDLE * np.mod(STEP * n + SHIFT * k, 1.0) for k in range(1, POINTS + 1)]
    points = [[float(f"{value:.6g}") for value in problem.lower + share * width] for share in shares]
    return [_evaluate_probe(build_exact_model(problem), problem, x) for x in points]


def _evaluate_probe(model: ExactModel, problem: GaitProblem, x: list[float]) -> dict[str, Any]:
    values = model.at(x, problem.p)
    rows, lower, upper = (numbers / model.row_scales for numbers in (values.g, values.lower, values.upper))
    chosen = np.unique(np.linspace(0, len(rows) - 1, ROWS).round().astype(int))
    weights = 1.0 + np.arange(len(rows)) % 7
    total = sum(
        factor * float((weights * numbers)[np.isfinite(numbers)].sum())
        for factor, numbers in ((1.0, rows), (0.3, lower), (0.1, upper))
    )
    return {
        "x": x,
        "objective": _round(problem.objective.sign * values.cost),
        "violation": _round(values.violation),
        "rows": {**{model.row_names[k]: _round(rows[k]) for k in chosen}, SUM: _round(total)},
    }


def _round(value: float, digits: int = 12) -> float | None:
    return float(f"{value:.{digits}g}") if math.isfinite(value) else None
