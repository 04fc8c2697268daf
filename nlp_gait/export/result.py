"""A gait that was found, read back from a file: what `solve --out` writes, a study's record, or a few lines by hand."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nlp_gait.errors import GaitError, InputError
from nlp_gait.problems import GaitProblem, load, problem_maker
from nlp_gait.problems.gait_problem import Array


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
    try:
        raw = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"result {str(path)!r} cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"result {str(path)!r} is not valid JSON: {error}") from error
    try:
        return _result(raw)
    except GaitError as error:
        raise InputError(f"result {str(path)!r}: {error}") from error


def _result(raw: Any) -> Result:
    if not isinstance(raw, dict):
        raise InputError(
            f"must be a JSON object, got {type(raw).__name__}; write one with `nlp-gait solve ... --out FILE`"
        )
    name = raw.get("problem")
    if not isinstance(name, str):
        raise InputError(f"'problem' must be the name of a problem, got {name!r}; see `nlp-gait list`")
    options, parameters = (_object(raw.get(key, {}), key) for key in ("options", "parameters"))
    _check_types(name, options)
    problem = load(name, **options).with_values(**parameters)
    values = _object(raw.get("x"), "x")
    missing = [variable for variable in problem.names if variable not in values]
    if missing:
        raise InputError(f"'x' lacks {', '.join(missing)}")
    for key, value in values.items():
        problem.variable_index(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(f"'x': {key} must be a number, got {value!r}")
    return Result(problem=problem, x=problem.check_x([values[key] for key in problem.names]))


def _check_types(name: str, options: Mapping[str, Any]) -> None:
    """Refuse a value of another type than the option's default."""
    known = inspect.signature(problem_maker(name)).parameters
    for key, value in options.items():
        expected = type(known[key].default) if key in known else type(value)
        if type(value) is not expected and not (expected is float and type(value) is int):
            raise InputError(f"option {key} must be a {expected.__name__}, got {value!r}")


def _object(value: Any, key: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{key!r} must be an object of values by name, got {value!r}")
    return value
