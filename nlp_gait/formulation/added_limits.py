"""Limits that the user adds to those of a gait's phases, as objects or by name."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from nlp_gait.errors import InputError, unknown
from nlp_gait.providers import LIMITS, import_object

SINGLE, DOUBLE = "single_support:", "double_support:"  # in front of a name: the limit is of these phases only


@dataclass(frozen=True, kw_only=True)
class AddedLimits:
    """Limits (see ``nlp_gait.limits.Limit``) by kind of phase, and their names, which are recorded as an option."""

    single_support: tuple[Any, ...] = ()
    double_support: tuple[Any, ...] = ()
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        return ",".join(self.names)

    def select(self, standing: Iterable[str]) -> tuple[Any, ...]:
        """Return the limits of a phase from the sides of the feet that stand."""
        return self.single_support if len(tuple(standing)) == 1 else self.double_support

    def extend(self, added: "AddedLimits") -> "AddedLimits":
        """Return these limits and more."""
        return AddedLimits(
            single_support=self.single_support + added.single_support,
            double_support=self.double_support + added.double_support,
            names=self.names + added.names,
        )


def make_added_limits(single_support: Iterable[Any], double_support: Iterable[Any]) -> AddedLimits:
    """Return limits that are given as objects; raises InputError for a class in place of an object."""
    single, double = tuple(single_support), tuple(double_support)
    for limit in (*single, *double):
        if isinstance(limit, type) or not callable(getattr(limit, "add", None)):
            raise InputError(f"a limit must be an object with a method add, got {limit!r}; for example FrictionCone()")
    of_single, of_double = ([type(limit).__name__ for limit in limits] for limits in (single, double))
    names = [name if name in of_double else f"{SINGLE}{name}" for name in of_single]
    names += [f"{DOUBLE}{name}" for name in of_double if name not in of_single]
    return AddedLimits(single_support=single, double_support=double, names=tuple(dict.fromkeys(names)))


def parse_limits(value: str | AddedLimits) -> AddedLimits:
    """Return the limits of an option: objects, or names separated by commas, of limits that every phase gets.

    After ``single_support:`` or ``double_support:`` a limit is of these phases only. A name is that of a limit of this package,
    of an installed package's entry point, or ``file.py:name`` or ``module:name`` of a class without required arguments. Raises
    UnknownNameError, and UserCodeError for code that is not found or fails.
    """
    if isinstance(value, AddedLimits):
        return value
    names = split_names(value)
    limits = [(phase, _load_limit(name)) for phase, name in names]
    return AddedLimits(
        single_support=tuple(limit for phase, limit in limits if phase != DOUBLE),
        double_support=tuple(limit for phase, limit in limits if phase != SINGLE),
        names=tuple(phase + name for phase, name in names),
    )


def resolve_limits(text: str, owner: str) -> str:
    """Return names of limits in a data file (the owner) as the user gave them; raises as ``resolve_code``."""
    import nlp_gait.user_code as user_code

    return ",".join(phase + user_code.resolve_code(name, "limit", owner) for phase, name in split_names(text))


def hash_limits(text: str) -> str:
    """Return the hashes of user code among names of limits, or an empty text."""
    import nlp_gait.user_code as user_code

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
    if name in LIMITS:
        return import_object(LIMITS[name])()
    import nlp_gait.user_code as user_code

    if not user_code.is_user_code(name, "limit"):
        raise unknown("limit", name, [*LIMITS, *user_code.find_entry_points("limit")])
    user_code.allow_code(name)
    loaded: Any = user_code.load_object(name, "limit")
    path = user_code.parse_reference(name, "limit").home
    limit = user_code.call_user_code(name, path, loaded) if isinstance(loaded, type) else loaded
    if not callable(getattr(limit, "add", None)):
        raise InputError(f"{name!r} must be a class of limits with a method add, got {loaded!r}")
    return limit
