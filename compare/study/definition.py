"""What a run depends on, by content: the one hash of a problem, and when two definitions are of the same run.

Paths are part of a definition, for whoever reads it, and no part of its key: a robot or code of one's own is what its text says,
wherever it lies.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from nlp_gait.backends.identity import FORMULAS, HASH, SOURCE, hash_json
from nlp_gait.robots.loading import is_robot_file
from nlp_gait.user_code import hash_file, shorten_name

SHOWN_DIGITS = 8  # of a hash
MATHEMATICS = "the problem's mathematics or limits"
WORDS: Mapping[tuple[str, ...], str] = {
    ("problem", HASH): MATHEMATICS,
    ("problem", SOURCE): "the problem's source",
    ("solver", SOURCE): "the solver's source",
    ("polishes", "key"): "the search that it polishes",
}
INPUT_WORDS = {
    FORMULAS: MATHEMATICS,
    "parameters": "values of the problem's parameters",
    "code_sha256": "the program has changed",
}


def source_of(algorithm: object) -> str | None:
    """Hash of the source file of an object of a program's own; None for this package's, and without a file, as in a notebook."""
    kind = algorithm if inspect.isroutine(algorithm) else type(algorithm)
    if kind.__module__.partition(".")[0] == "metaheuristics":
        return None
    try:
        path = inspect.getsourcefile(kind)
    except (TypeError, OSError):
        return None
    if path is None or not Path(path).is_file():
        return None
    return hash_file(Path(path))


def key_of(definition: Mapping[str, Any]) -> str:
    """Hash of a definition without what says only where something lies."""
    return hash_json(_content(definition))


def group_of(definition: Mapping[str, Any]) -> dict[str, Any]:
    """What all runs of a solver in a study share: no seed, no start point, and nothing that says only where something lies."""
    return {key: part for key, part in _content(definition).items() if key not in ("seed", "start", "imported")}


def _content(definition: Mapping[str, Any]) -> dict[str, Any]:
    problem = dict(definition["problem"])
    if SOURCE in problem:
        problem["name"] = shorten_name(problem["name"])
    robot = problem["options"].get("robot")
    if isinstance(robot, str) and is_robot_file(robot):
        problem["options"] = {**problem["options"], "robot": ""}  # the hash includes the robot
    solver = definition["solver"]
    if isinstance(solver, Mapping) and "name" in solver:
        solver = {**solver, "name": shorten_name(solver["name"])}
    return {**definition, "problem": problem, "solver": solver}


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """In words, what differs between two definitions: ``evaluations 500 -> 1000, the algorithm's source``."""
    found = {
        place: WORDS.get(place) or f"{place[-1]} {_shown(before)} -> {_shown(after)}"
        for place, before, after in _changed(old, new)
    }
    return ", ".join(found.values())


def input_differences(old: Any, new: Any) -> str:
    """In words, what differs between two steps' inputs: ``starts 5 -> 10``; the mathematics only where nothing else does."""
    before, after = dict(_leaves(old)), dict(_leaves(new))
    places = [place for place in {**before, **after} if before.get(place) != after.get(place)]
    causes = [place for place in places if place[-1] != FORMULAS]
    return ", ".join(
        INPUT_WORDS.get(place[-1]) or f"{place[-1]} {_shown(before.get(place))} -> {_shown(after.get(place))}"
        for place in causes or places
    )


def edition(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """In a few words, what a definition has where it differs from another one: ``evaluations 500``, ``source 3fa9c1d2``."""
    said = []
    for place, before, _ in _changed(old, new):
        name = {HASH: "mathematics", SOURCE: "source"}.get(place[-1], place[-1])
        said.append(f"{name} {str(before)[:SHOWN_DIGITS] if place[-1] in (HASH, SOURCE, 'key') else _shown(before)}")
    return ", ".join(said)


def _changed(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[tuple[tuple[str, ...], Any, Any]]:
    """Places at which two definitions differ, with both values; the mathematics only where nothing else explains it."""
    before, after = dict(_leaves(_content(old))), dict(_leaves(_content(new)))
    places = [place for place in {**before, **after} if before.get(place) != after.get(place)]
    causes = [place for place in places if place[0] == "problem" and place[-1] != HASH]
    for place in places:
        if place != ("problem", HASH) or not causes:
            yield place, before.get(place), after.get(place)


def _leaves(data: Any, place: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from _leaves(value, (*place, str(key)))
    else:
        yield place, data


def _shown(value: Any) -> str:
    text = "none" if value is None else str(value)
    return text if len(text) <= 40 else f"{text[:40]} ..."
