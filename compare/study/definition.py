"""What a run depends on: keys of definitions, whether two are equal, and their differences in words.

Paths are part of a definition, for its readers, but not of its hash: a robot or user code is identified by its content.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from nlp_gait.backends.identity import VALUES, describe_difference, hash_json, make_key
from nlp_gait.user_code import hash_file, shorten_name

SHOWN_DIGITS = 8  # of a hash
SOURCE = "source_sha256"  # of user code, see ``hash_file``
MATHEMATICS = "the problem's mathematics or limits"
WORDS: Mapping[tuple[str, ...], str] = {
    ("problem", VALUES): MATHEMATICS,
    ("solver", SOURCE): "the solver's source",
    ("polishes", "key"): "the search that it polishes",
}


def hash_solver_source(solver: object) -> str | None:
    """Return the hash of a user-defined solver's source file; None without a file, as in a notebook, or if it is ours."""
    kind = solver if inspect.isroutine(solver) else type(solver)
    if kind.__module__.partition(".")[0] == "metaheuristics":
        return None
    try:
        path = inspect.getsourcefile(kind)
    except (TypeError, OSError):
        return None
    return hash_file(Path(path)) if path is not None and Path(path).is_file() else None


def hash_definition(definition: Mapping[str, Any]) -> str:
    """Return the hash of a definition without paths and probes, for names of files."""
    return hash_json(_remove_paths(definition))


def is_same_definition(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Return whether two definitions have equal results: the problem evaluates to the same values, all else is equal."""
    return not describe_difference(old["problem"], new["problem"]) and hash_definition(old) == hash_definition(new)


def select_shared(definition: Mapping[str, Any]) -> dict[str, Any]:
    """Return what all runs of a solver in a study share: the definition without seed, start point and paths."""
    return {key: part for key, part in _remove_paths(definition).items() if key not in ("seed", "start", "imported")}


def describe_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Return the differences of two definitions in words: ``evaluations 500 -> 1000, the solver's source``."""
    differences = _join(_compare_definitions(old, new))
    changed = describe_difference(old["problem"], new["problem"])
    return f"{MATHEMATICS}: {changed}" if differences in ("", MATHEMATICS) and changed else differences


def describe_edition(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Return what a definition has where it differs from another one: ``evaluations 500``, ``source 3fa9c1d2``."""
    parts = []
    for place, before, _ in _compare_definitions(old, new):
        name = {VALUES: "mathematics", SOURCE: "source"}.get(place[-1], place[-1])
        parts.append(
            f"{name} {str(before)[:SHOWN_DIGITS] if place[-1] in (VALUES, SOURCE, 'key') else _shorten(before)}"
        )
    return ", ".join(parts)


HASH = re.compile("[0-9a-f]{64}")  # in place of a file that an option names
Difference = tuple[tuple[str, ...], Any, Any]
"""Place, and the values there."""


def _remove_paths(definition: Mapping[str, Any]) -> dict[str, Any]:
    problem, solver = make_key(definition["problem"]), definition["solver"]
    if isinstance(solver, Mapping) and "name" in solver:
        solver = {**solver, "name": shorten_name(solver["name"])}
    return {**definition, "problem": problem, "solver": solver}


def _compare_definitions(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[Difference]:
    """Differences of two definitions; that of the values only if nothing else in the problem explains it."""
    found = list(_compare(_remove_paths(old), _remove_paths(new)))
    explained = any(place[0] == "problem" and place[-1] != VALUES for place, _, _ in found)
    return [difference for difference in found if not explained or difference[0] != ("problem", VALUES)]


def _compare(old: Any, new: Any) -> Iterator[Difference]:
    before, after = dict(_list_leaves(old)), dict(_list_leaves(new))
    for place in {**before, **after}:
        if before.get(place) != after.get(place):
            yield place, before.get(place), after.get(place)


def _list_leaves(data: Any, place: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from _list_leaves(value, (*place, str(key)))
    else:
        yield place, data


def _join(found: list[Difference]) -> str:
    texts = []
    for place, before, after in found:
        words = WORDS.get(place)
        if not words and all(HASH.fullmatch(str(value)) for value in (before, after)):
            words = f"the file of {place[-1]}"
        texts.append(words or f"{place[-1]} {_shorten(before)} -> {_shorten(after)}")
    return ", ".join(dict.fromkeys(texts))


def _shorten(value: Any) -> str:
    text = "none" if value is None else str(value)
    return text if len(text) <= 40 else f"{text[:40]} ..."
