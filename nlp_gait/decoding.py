"""Dataclasses from the plain data that files hold: every key, and nothing but the type that the dataclass states.

A number that was not finite stands as null in a file: where the dataclass has a ``float``, null is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")

WORDS = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", NoneType: "null"}


def decoded(cls: Callable[..., T], raw: Any, where: str = "") -> T:
    """Instance of a dataclass.

    Args:
        cls: its fields may be texts, numbers, truth values, tuples, mappings by text, dataclasses, literals, and unions.
        raw: as JSON gives it.
        where: place in the file, for messages.

    Raises:
        ValueError: with the place: a key is missing or unknown, or a value has another type.
    """
    if not isinstance(raw, Mapping):
        raise ValueError(f"{where or 'it'} must be an object, got {_shown(raw)}")
    values = {}
    for name, (kind, needed) in _fields(cls).items():
        place = f"{where}.{name}" if where else name
        if name in raw:
            values[name] = _value(kind, raw[name], place)
        elif needed:
            raise ValueError(f"{place} is missing")
    unknown = [key for key in raw if key not in values]
    if unknown:
        raise ValueError(f"{where or 'it'} has an unknown key {unknown[0]!r}")
    return cls(**values)


@cache
def _fields(cls: Any) -> dict[str, tuple[Any, bool]]:
    """Type of each field, and whether it is needed."""
    hints = get_type_hints(cls)
    return {f.name: (hints[f.name], f.default is MISSING and f.default_factory is MISSING) for f in fields(cls)}


def _value(kind: Any, raw: Any, where: str) -> Any:
    if kind is Any:
        return raw
    if kind is float:
        return math.nan if raw is None else float(_checked((int, float), raw, where, WORDS[float]))
    if kind in WORDS:
        return _checked((kind,), raw, where, WORDS[kind])
    if isinstance(kind, type) and is_dataclass(kind):
        return decoded(kind, raw, where)
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Literal:
        if raw not in parts:
            raise ValueError(f"{where} must be {' or '.join(map(repr, parts))}, got {_shown(raw)}")
        return raw
    if origin is tuple:
        return tuple(_value(parts[0], item, f"{where}[{i}]") for i, item in enumerate(_list(raw, where)))
    if origin in (Union, UnionType):
        return _of_union(parts, raw, where)
    if not isinstance(raw, Mapping):
        raise ValueError(f"{where} must be an object, got {_shown(raw)}")
    return {key: _value(parts[1], value, f"{where}.{key}") for key, value in raw.items()}


def _of_union(parts: tuple[Any, ...], raw: Any, where: str) -> Any:
    if raw is None and NoneType in parts:
        return None
    exact = [part for part in parts if part is type(raw)]
    if exact:
        return raw
    others = [part for part in parts if part is not NoneType]
    for part in others[:-1]:
        try:
            return _value(part, raw, where)
        except ValueError:
            continue
    return _value(others[-1], raw, where)


def _checked(kinds: tuple[type, ...], raw: Any, where: str, wanted: str) -> Any:
    if not isinstance(raw, kinds) or (isinstance(raw, bool) and bool not in kinds):
        raise ValueError(f"{where} must be {wanted}, got {_shown(raw)}")
    return raw


def _list(raw: Any, where: str) -> list[Any]:
    if not isinstance(raw, list):
        raise ValueError(f"{where} must be a list, got {_shown(raw)}")
    return raw


def _shown(raw: Any) -> str:
    text = repr(raw)
    return text if len(text) <= 60 else f"{text[:60]} ..."
