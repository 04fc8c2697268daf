"""Forged records: each changes one stored run of an honest study, as edited by hand."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

Raw = dict[str, Any]
Records = dict[str, Raw]
"""Plain records by the name of their file, such as ``pso-0001``."""

BOUND = 0.96  # better than what is proven of walk12 at lambda = 0.4: 0.9222


@dataclass(frozen=True)
class Forgery:
    """A change of some records, and the record that must be named."""

    name: str
    apply: Callable[[Records], None]
    victim: str  # name of the file, after the change


def forge_records() -> Iterator[Forgery]:
    """Yield all forgeries of records and histories."""
    for victim in ("pso-0001", "ipopt-0001"):
        for name, change in {**_numbers(), **_points(), **_definitions(), **_counts()}.items():
            yield Forgery(f"{victim}: {name}", _on(victim, change), victim)
    for name, change in {**_histories(), **_claims(), **_origins()}.items():
        yield Forgery(f"pso-0001: {name}", _on("pso-0001", change), "pso-0001")
    for name, apply, victim in _copies():
        yield Forgery(name, apply, victim)


def _on(victim: str, change: Callable[[Raw], None]) -> Callable[[Records], None]:
    return lambda records: change(records[victim])


def _put(*place: str | int, value: Any) -> Callable[[Raw], None]:
    def change(raw: Raw) -> None:
        at: Any = raw
        for key in place[:-1]:
            at = at[key]
        at[place[-1]] = value(at[place[-1]]) if callable(value) else value

    return change


def _all(*changes: Callable[[Raw], None]) -> Callable[[Raw], None]:
    def change(raw: Raw) -> None:
        for each in changes:
            each(raw)

    return change


def _everywhere(value: float) -> Callable[[Raw], None]:
    """Change the objective wherever a careful forger finds it."""

    def change(raw: Raw) -> None:
        raw["verdict"]["objective"] = raw["claimed_objective"] = value
        raw["history"]["objective"][-1] = value
        for indexes in (raw["verdict"]["indexes"], raw["verdict"]["dense"] or {}):
            for name in indexes:
                if name == "f":
                    indexes[name] = value

    return change


def _numbers() -> dict[str, Callable[[Raw], None]]:
    objective = ("verdict", "objective")
    found = {
        f"objective times {factor}": _put(*objective, value=lambda v, k=factor: v * k)
        for factor in (1.6, 1.01, 1 + 1e-7)
    }
    found |= {
        "no objective": _put(*objective, value=None),
        "a better value everywhere": _everywhere(0.9221),
        "better than the bound everywhere": _everywhere(BOUND),
        "infeasible": _put("verdict", "feasible", value=False),
        "a violation": _put("verdict", "violation", value=0.01),
        "an index": _put("verdict", "indexes", value=lambda v: {**v, next(iter(v)): 0.5}),
        "an index less": _put("verdict", "indexes", value=lambda v: dict(list(v.items())[1:])),
    }
    return found


def _points() -> dict[str, Callable[[Raw], None]]:
    def shift(x: dict[str, float]) -> dict[str, float]:
        name = list(x)[1]
        return {**x, name: x[name] - 1e-5}

    return {
        "another point": _put("x", value=shift),
        "a point of three variables": _put("x", value=lambda x: dict(list(x.items())[1:])),
        "a variable of another name": _put("x", value=lambda x: {**dict(list(x.items())[1:]), "speed": 1.0}),
        "no point": _put("x", value={}),
        "a coordinate that is no number": _put("x", value=lambda x: {**x, next(iter(x)): None}),
    }


def _definitions() -> dict[str, Callable[[Raw], None]]:
    problem = ("definition", "problem")
    return {
        "another weight": _put(*problem, "parameters", value={"lambda": 0.1}),
        "another probe": _put(*problem, "probes", 1, "objective", value=lambda f: f * (1 + 1e-8)),
        "no probes": _put(*problem, "probes", value=[]),
        "formulas of another version": _put(*problem, "mathematics", value=2),
        "another problem": _put(*problem, "name", value="nao-ssp"),
        "code of the forger": _put(*problem, "name", value="forger.py:walk"),
        "the other sense": _put("definition", "objective", "sense", value="minimise"),
        "a schema of the future": _put("schema", value=9),
        "an unknown key": lambda raw: raw.update(verdikt=True),
    }


def _counts() -> dict[str, Callable[[Raw], None]]:
    return {
        "fewer evaluations": _put("evaluations", "f", value=lambda f: f - 1),
        "more failures than evaluations": _put("failed_evaluations", value=10**6),
        "a negative time": _put("time_s", "solve", value=-5.0),
    }


def _histories() -> dict[str, Callable[[Raw], None]]:
    objective, count = ("history", "objective"), ("history", "evaluations")
    return {
        "a history that ends better": _put(*objective, -1, value=BOUND),
        "a history that ends worse": _put(*objective, -1, value=0.1),
        "a history that worsens": _put(*objective, 1, value=0.92),
        "a history that loses its point": _put(*objective, 2, value=None),
        "a history without a point": _put(*objective, value=lambda v: [None] * len(v)),
        "an infinite history": _put(*objective, 0, value=1e999),
        "a history of fewer evaluations": _put(*count, -1, value=lambda v: v - 1),
        "a history of other length": _put(*count, value=lambda v: v[:-1]),
        "evaluations that descend": _put(*count, 1, value=1),
        "a history longer than its run": _put("time_s", "history", -1, value=1e6),
        "times that descend": _put("time_s", "history", 0, value=0.5),
        "a budget that was exceeded": _put("definition", "stop", "evaluations", value=100),
    }


def _claims() -> dict[str, Callable[[Raw], None]]:
    return {
        "a better claim": _put("claimed_objective", value=0.93),
        "a claim withdrawn": _put("claimed", value=False),
        "a claim with a violation": _put("claimed_violation", value=0.5),
        "more iterations than evaluations": _put("iterations", value=10**9),
        "other settings": _put("settings", "population", value=7),
    }


def _origins() -> dict[str, Callable[[Raw], None]]:
    return {
        "no origin": _put("origin", value=None),
        "other code": _put("origin", "code_sha256", value="f" * 64),
        "another CasADi and probe": _all(
            _put("origin", "casadi", value="1.0"),
            _put("definition", "problem", "probes", 0, "objective", value=lambda f: f * (1 + 1e-8)),
        ),
    }


def _copies() -> Iterator[tuple[str, Callable[[Records], None], str]]:
    def copied(records: Records, **changes: Any) -> None:
        raw = copy.deepcopy(records["pso-0001"])
        raw["run"] = 7
        for key, value in changes.items():
            raw[key] = value
        records["pso-0007"] = raw

    def renamed_seed(records: Records) -> None:
        copied(records, seed=7)
        records["pso-0007"]["definition"]["seed"] = 7

    def other_times(records: Records) -> None:
        renamed_seed(records)
        raw = records["pso-0007"]
        raw["time_s"]["solve"] += 0.01
        raw["time_s"]["history"][-1] += 0.005

    def other_solver(records: Records) -> None:
        renamed_seed(records)
        raw = records.pop("pso-0007")
        raw["solver"] = "mine"
        records["mine-0007"] = raw

    yield "a copy with its seed", copied, "pso-0007"
    yield "a copy with another seed", renamed_seed, "pso-0007"
    yield "a copy with another seed and times", other_times, "pso-0007"
    yield "a copy under another solver's name", other_solver, "mine-0007"
    yield "a copy under another file name", lambda r: r.update({"pso-0009": copy.deepcopy(r["pso-0001"])}), "pso-0009"
    yield "seed and definition disagree", lambda r: r["pso-0001"].update(seed=99), "pso-0001"


def forge_between_samples() -> Iterator[Forgery]:
    """Yield forgeries that only a complete verification notices: of what the judge finds between the samples."""
    for name, change in {
        "a dense grid that fails": _put("verdict", "dense_feasible", value=lambda v: not v),
        "no dense grid": _all(_put("verdict", "dense", value=None), _put("verdict", "dense_feasible", value=None)),
        "another index on the dense grid": _put("verdict", "dense", value=lambda v: {**v, next(iter(v)): 0.5}),
        "no guarantee": _put("verdict", "guaranteed", value=None),
        "a guarantee withdrawn": _put("verdict", "guaranteed", "satisfied", value=lambda v: not v),
    }.items():
        yield Forgery(name, _on("pso-0001", change), "pso-0001")
