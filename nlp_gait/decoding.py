"""Data classes from plain data of files, and from the options of a function.

A file must have the required keys, no unknown ones, and values of the declared types; numbers that are not finite are written as
null, so null becomes NaN for a ``float``. An argument annotated with a data class stands for the fields of that class.
"""

import inspect
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from nlp_gait.errors import WORDS, GaitError, format_value, unknown
from nlp_gait.files import convert_errors, read_json

T = TypeVar("T")

MISSPELLED = 0.8  # similarity, see ``difflib``


def decode(
    cls: Callable[..., T],
    raw: Any,
    where: str = "",
    *,
    given: Mapping[str, Any] | None = None,
    unread: Collection[str] = (),
    ignore_unknown: bool = False,
) -> T:
    """Return an instance of a dataclass with fields of texts, numbers, booleans, tuples, mappings from text, dataclasses, unions.

    ``where`` is the place in the file, ``given`` are fields that are not in it, and ``unread`` keys that are not fields. With
    ``ignore_unknown`` all other keys are allowed, too, except those that look like a misspelled field. Raises ValueError with the
    place of a key that is missing or unknown, or of a value of another type.
    """
    if not isinstance(raw, Mapping):
        raise ValueError(f"{where or 'it'} must be an object, got {format_value(raw)}")
    values = dict(given or {})
    readable = {name: field for name, field in _list_fields(cls).items() if name not in values}
    for name, (kind, needed) in readable.items():
        place = f"{where}.{name}" if where else name
        if name in raw:
            values[name] = decode_value(kind, raw[name], place)
        elif needed:
            raise ValueError(f"{place} is missing")
    for key in raw:
        ignored = key in unread or (ignore_unknown and not get_close_matches(key, readable, cutoff=MISSPELLED))
        if key not in readable and not ignored:
            raise ValueError(str(unknown(f"key of {where}" if where else "key", key, readable)))
    return cls(**values)


def read_dataclass(cls: Callable[..., T], path: Path, what: str, *, error: type[GaitError]) -> T:
    """Return an instance of a dataclass from a JSON file, see ``decode``; raises ``error`` if it cannot be read or decoded."""
    raw = read_json(path, what, error=error)
    with convert_errors(f"{what} {str(path)!r}", error):
        return decode(cls, raw)


@cache
def _list_fields(cls: Any) -> dict[str, tuple[Any, bool]]:
    hints = get_type_hints(cls)
    return {f.name: (hints[f.name], f.default is MISSING and f.default_factory is MISSING) for f in fields(cls)}


def decode_value(kind: Any, raw: Any, where: str) -> Any:
    """Return a value of a field's type; arguments and errors as ``decode``."""
    if kind is Any:
        return raw
    if kind is float:
        return math.nan if raw is None else float(_check_type((int, float), raw, where, WORDS[float]))
    if kind in WORDS:
        return _check_type((kind,), raw, where, WORDS[kind])
    if isinstance(kind, type) and is_dataclass(kind):
        return decode(kind, raw, where)
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Literal:
        if not any(raw == choice and type(raw) is type(choice) for choice in parts):
            raise ValueError(f"{where} must be {' or '.join(map(repr, parts))}, got {format_value(raw)}")
        return raw
    if origin is tuple:
        any_length = parts[-1] is ...
        if not isinstance(raw, list) or not (any_length or len(raw) == len(parts)):
            count = "" if any_length else f" of {len(parts)} values"
            raise ValueError(f"{where} must be a list{count}, got {format_value(raw)}")
        kinds = parts[:1] * len(raw) if any_length else parts
        plain = WORDS.keys() & (get_args(parts[0]) if get_origin(parts[0]) in (Union, UnionType) else parts[:1])
        if any_length and plain.issuperset(map(type, raw)):  # long histories of numbers
            return tuple(raw)
        return tuple(decode_value(kinds[i], item, f"{where}[{i}]") for i, item in enumerate(raw))
    if origin in (Union, UnionType):
        return _decode_union(parts, raw, where)
    if not isinstance(raw, Mapping):
        raise ValueError(f"{where} must be an object, got {format_value(raw)}")
    key, value = parts
    return {decode_value(key, k, f"a key of {where}"): decode_value(value, v, f"{where}.{k}") for k, v in raw.items()}


def _decode_union(parts: tuple[Any, ...], raw: Any, where: str) -> Any:
    if type(raw) in parts:
        return raw
    choices = [choice for choice in parts if choice is not NoneType]
    if all(choice in WORDS for choice in parts) and not (float in parts and type(raw) in (int, NoneType)):
        raise ValueError(f"{where} must be {' or '.join(WORDS[choice] for choice in parts)}, got {format_value(raw)}")
    for choice in choices[:-1]:
        try:
            return decode_value(choice, raw, where)
        except ValueError:
            continue
    return decode_value(choices[-1], raw, where)


def _check_type(kinds: tuple[type, ...], raw: Any, where: str, wanted: str) -> Any:
    if not isinstance(raw, kinds) or (isinstance(raw, bool) and bool not in kinds):
        raise ValueError(f"{where} must be {wanted}, got {format_value(raw)}")
    return raw


def find_groups(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the data classes among a function's arguments, by argument."""
    parameters = inspect.signature(inspect.unwrap(function), eval_str=True).parameters
    return {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}


def list_options(function: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Return the options of a function by name: its arguments, and in place of each group the fields of the class."""
    options: dict[str, inspect.Parameter] = {}
    for name, parameter in inspect.signature(function, eval_str=True).parameters.items():
        group = is_dataclass(parameter.annotation)
        options |= list_options(parameter.annotation) if group else {name: parameter}
    return options


def pack_options(groups: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a function's arguments from the values of its options; those of each group are packed into its class."""
    packed = {field.name for group in groups.values() for field in fields(group)}
    arguments = {name: value for name, value in values.items() if name not in packed}
    for name, group in groups.items():
        arguments[name] = group(**{field.name: values[field.name] for field in fields(group)})
    return arguments


def replace_signature(function: Any, options: Sequence[inspect.Parameter]) -> None:
    """Give a function that takes any keywords the signature of these options."""
    function.__signature__ = inspect.Signature(list(options))
    function.__annotations__ = {option.name: option.annotation for option in options}
