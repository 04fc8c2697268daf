"""A gait that was found, read back from a file: what `solve --out` writes, a study's record, or a few lines by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from nlp_gait.errors import GaitError, InputError, unknown
from nlp_gait.files import read_json
from nlp_gait.problem.gait_problem import GaitProblem, is_number
from nlp_gait.problem.registry import load
from nlp_gait.problem.signals import Array
from nlp_gait.problem.solution import Solution

SCHEMA = 1  # of a result; one without it is taken as the first
RECORD_SCHEMA = 2  # of a study's record, which is told by its ``definition``
BY_HAND = ("schema", "problem", "options", "parameters", "x")
# What `solve`, `evaluate` and `export --format json` write.
RESULT_KEYS = frozenset(
    (
        *BY_HAND,
        *(field.name for field in fields(Solution)),
        *("robot", "indexes", "constraints", "feasible", "dense", "dense_violations", "dense_intervals", "signals"),
    )
)
RECORD_KEYS = frozenset(
    (
        *(
            "schema",
            "problem",
            "algorithm",
            "run",
            "seed",
            "definition",
            "settings",
            "status",
            "success",
            "x",
            "objective",
        ),
        *(
            "violation",
            "verdict",
            "evaluations",
            "failed_evaluations",
            "iterations",
            "active_constraints",
            "history",
            "time_s",
        ),
    )
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Result:
    """A point of a problem.

    Attributes:
        problem: with the options and parameter values that it was solved with.
        x: (n,) decision variables.
    """

    problem: GaitProblem
    x: Array


def load_result(path: Path) -> Result:
    """Result from a JSON object with ``problem``, ``x`` by variable name and, if not the defaults, ``options``, ``parameters``.

    Raises:
        InputError: the file cannot be read, is damaged, or holds values that the problem does not allow.
    """
    raw = read_json(path, "result")
    try:
        return _result(raw)
    except GaitError as error:
        raise InputError(f"result {str(path)!r}: {error}") from error


def _result(raw: Any) -> Result:
    if not isinstance(raw, dict):
        raise InputError(
            f"must be a JSON object, got {type(raw).__name__}; write one with `nlp-gait solve ... --out FILE`"
        )
    is_record = "definition" in raw
    schema, found = (RECORD_SCHEMA if is_record else SCHEMA), raw.get("schema", SCHEMA)
    if type(found) is not int or found != schema:
        raise InputError(f"'schema' must be {schema}, got {found!r}; another version of nlp-gait may read it")
    for key in raw:
        if key not in (RECORD_KEYS if is_record else RESULT_KEYS):
            raise unknown("key", key, BY_HAND)
    problem = _problem(
        _object(_object(raw["definition"], "definition").get("problem"), "problem") if is_record else raw
    )
    values = _object(raw.get("x"), "x")
    missing = [variable for variable in problem.names if variable not in values]
    if missing:
        raise InputError(f"'x' lacks {', '.join(missing)}")
    for key, value in values.items():
        problem.variable_index(key)
        if not is_number(value):
            raise InputError(f"'x': {key} must be a number, got {value!r}")
    return Result(problem=problem, x=problem.check_x([values[key] for key in problem.names]))


def _problem(raw: Mapping[str, Any]) -> GaitProblem:
    """Problem of an object with ``problem`` or, in a record, ``name``, and ``options`` and ``parameters``."""
    name = raw.get("problem", raw.get("name"))
    if not isinstance(name, str):
        raise InputError(f"'problem' must be the name of a problem, got {name!r}; see `nlp-gait list`")
    options, parameters = (_object(raw.get(key, {}), key) for key in ("options", "parameters"))
    problem = load(name, **options).with_values(**parameters)
    robot = raw.get("robot", problem.options.get("robot"))
    if robot != problem.options.get("robot"):
        raise InputError(f"'robot' is {robot!r}, but the option of that name decides: write it into 'options'")
    return problem


def _object(value: Any, key: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{key!r} must be an object of values by name, got {value!r}")
    return value
