"""A gait that was found, read back from a file: what `solve --out` writes, a study's record, or a few lines by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import read_json
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.formulation.motion.signals import Array
from nlp_gait.formulation.registry import load
from nlp_gait.user_code import resolve_code

SCHEMA = 1  # of a result, and the default


@dataclass(frozen=True, kw_only=True)
class StoredProblem:
    """A problem as a study's record holds it.

    Attributes:
        name: that ``load`` takes.
        options: of its maker.
        parameters: that differ from the defaults.
        sha256: hash of the mathematics and the parameters.
        source_sha256: hash of the source of a problem of one's own.
    """

    name: str
    options: Mapping[str, str | int | float | bool]
    parameters: Mapping[str, float]
    sha256: str
    source_sha256: str = ""


@dataclass(frozen=True, kw_only=True)
class _RecordFile:
    """What is read of a study's record."""

    schema: Literal[3]
    definition: Mapping[str, Any]
    x: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class _ResultFile:
    """What is read of a result; more is not needed in one that is written by hand."""

    schema: Literal[1] = 1
    problem: str
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    robot: str | None = None
    x: Mapping[str, float]


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
        return _of_record(raw) if isinstance(raw, dict) and "definition" in raw else _of_result(raw)
    except ValueError as error:
        raise InputError(
            f"result {str(path)!r}: {error}; `nlp-gait solve ... --out FILE` writes a valid one"
        ) from error
    except GaitError as error:
        raise InputError(f"result {str(path)!r}: {error}") from error


def _of_record(raw: Mapping[str, Any]) -> Result:
    record = decode(_RecordFile, raw, ignore_unknown=True)
    problem = decode(StoredProblem, record.definition.get("problem"), "definition.problem")
    return _result(problem.name, problem.options, problem.parameters, record.x)


def _of_result(raw: Any) -> Result:
    file = decode(_ResultFile, raw, ignore_unknown=True)
    result = _result(file.problem, file.options, file.parameters, file.x)
    if file.robot not in (None, result.problem.options.get("robot")):
        raise InputError(f"'robot' is {file.robot!r}, but the option of that name decides: write it into 'options'")
    return result


def _result(
    name: str, options: Mapping[str, str | int | float | bool], parameters: Mapping[str, float], x: Mapping[str, float]
) -> Result:
    problem = load(resolve_code(name, "problem", "it"), **options).with_values(**parameters)
    return Result(problem=problem, x=problem.check_x(x))
