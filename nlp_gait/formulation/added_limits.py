"""Limits that the user adds to those of a gait's phases, as objects or by name."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from nlp_gait import user_code
from nlp_gait.errors import InputError, unknown
from nlp_gait.providers import LIMITS, import_object

SINGLE, DOUBLE = "single_support:", "double_support:"  # in front of a name: the limit is of these phases only


@dataclass(frozen=True)
class AddedLimits:
    """Limits with their names, which are recorded as an option."""

    #: Prefix (empty for a limit of every phase), name, and limit, see ``nlp_gait.limits.Limit``
    entries: tuple[tuple[str, str, Any], ...] = ()

    def __str__(self) -> str:
        return ",".join(prefix + name for prefix, name, _ in self.entries)

    def select(self, standing: Iterable[str]) -> tuple[Any, ...]:
        """Return the limits of a phase from the sides of the feet that stand."""
        kind = SINGLE if len(tuple(standing)) == 1 else DOUBLE
        return tuple(limit for prefix, _, limit in self.entries if prefix in ("", kind))


def add_limits(present: str | AddedLimits, single_support: Iterable[Any], double_support: Iterable[Any]) -> AddedLimits:
    """Return present limits and more, which are given as objects; raises InputError for a class in place of an object."""
    kinds = ((SINGLE, single_support), (DOUBLE, double_support))
    added = [(prefix, type(limit).__name__, limit) for prefix, limits in kinds for limit in limits]
    for _, name, limit in added:
        _check_limit(limit, name)
    return AddedLimits((*parse_limits(present).entries, *added))


def parse_limits(value: str | AddedLimits) -> AddedLimits:
    """Return the limits of an option: objects, or names separated by commas, of limits that every phase gets.

    After ``single_support:`` or ``double_support:`` a limit is of these phases only. A name is that of a limit of this package,
    of an installed package's entry point, or ``file.py:name`` or ``module:name`` of a class without required arguments. Raises
    UnknownNameError, and UserCodeError for code that is not found or fails.
    """
    if isinstance(value, AddedLimits):
        return value
    return AddedLimits(tuple((prefix, name, _load_limit(name)) for prefix, name in split_names(value)))


def resolve_limits(text: str, owner: str) -> str:
    """Return names of limits in a data file (the owner) as the user gave them; raises as ``resolve_code``."""
    return ",".join(prefix + user_code.resolve_code(name, "limit", owner) for prefix, name in split_names(text))


def hash_limits(text: str) -> str:
    """Return the hashes of user code among names of limits, or an empty text."""
    references = [name for _, name in split_names(text) if user_code.is_reference(name)]
    return ",".join(user_code.read_source_files(name, "limit").digest for name in references)


def split_names(text: str) -> list[tuple[str, str]]:
    """Return the prefix that restricts a limit to some phases, or an empty text, and its name."""
    names = []
    for name in filter(None, map(str.strip, text.split(","))):
        phase = next((prefix for prefix in (SINGLE, DOUBLE) if name.startswith(prefix)), "")
        names.append((phase, name.removeprefix(phase)))
    return names


def _load_limit(name: str) -> Any:
    shipped = import_object(LIMITS)
    if name in shipped:
        return shipped[name]()
    if not user_code.is_user_code(name, "limit"):
        raise unknown("limit", name, [*shipped, *user_code.find_entry_points("limit")])
    user_code.allow_code(name)
    loaded: Any = user_code.load_object(name, "limit")
    limit = user_code.call_user_code(name, loaded) if isinstance(loaded, type) else loaded
    _check_limit(limit, name)
    return limit


def _check_limit(limit: Any, name: str) -> None:
    if isinstance(limit, type) or not callable(getattr(limit, "add", None)):
        raise InputError(f"limit {name!r} must be an object with a method add, such as FrictionCone(), got {limit!r}")
