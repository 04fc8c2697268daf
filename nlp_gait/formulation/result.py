"""Results: a point of a problem, read from the file of `solve --out` or a few lines by hand; its signals."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError, check_count
from nlp_gait.files import read_json
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.formulation.registry import load, resolve_stored
from nlp_gait.formulation.signals import Array, Signals

SCHEMA = 1  # of a result, and the default
SHORTEST_S, LONGEST_S = 0.001, 300.0  # of a gait; a step takes a second
AT_REST = 1e-6  # largest rate of a joint that stands still [rad/s]
ROUNDING = 1e-6  # of the number of periods: rounding must not add a row
FINE_INTERVALS = 500  # of a grid that splines are fitted to: angles are exact to 2e-5 rad, next to a switch of phases


@dataclass(frozen=True, kw_only=True)
class StoredProblem:
    """A problem in a certificate or another stored result."""

    name: str  # argument of ``load``
    options: Mapping[str, str | int | float | bool]  # of its maker
    parameters: Mapping[str, float]  # that differ from the defaults
    mathematics: int = 1  # version of the formulas
    files: Mapping[str, str] = field(default_factory=dict)  # hashes of the user's files that it was made of


@dataclass(frozen=True, kw_only=True)
class _ResultFile:
    """Keys of a result that are read; only two are required."""

    schema: Literal[1] = 1
    problem: str
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    robot: str | None = None
    x: Mapping[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Result:
    """A point of a problem."""

    problem: GaitProblem  #: with the options and parameter values that it was solved with
    x: Array  #: (n,) decision variables


def load_result(path: Path) -> Result:
    """Return the result in a JSON object with ``problem``, ``x`` by variable name and optional ``options``, ``parameters``.

    Raises InputError for a file that cannot be read or is damaged, and for values that the problem does not allow.
    """
    raw = read_json(path, "result")
    owner = f"result {str(path)!r}"
    try:
        file = decode(_ResultFile, raw, ignore_unknown=True)
        name, options = resolve_stored(file.problem, file.options, "it")
        problem = load(name, **options).with_values(**file.parameters)
        result = Result(problem=problem, x=problem.check_x(file.x))
        if file.robot not in (None, result.problem.options.get("robot")):
            raise InputError(f"'robot' is {file.robot!r}, but the option of that name decides: write it into 'options'")
    except ValueError as error:
        raise InputError(f"{owner}: {error}; `nlp-gait solve ... --out FILE` writes a valid one") from error
    except GaitError as error:
        raise InputError(f"{owner}: {error}") from error
    return result


def sample_signals(result: Result, period_s: float) -> Signals:
    """Return signals on the problem's grid, whose intervals are halved until neighbouring samples are at most a period apart.

    Raises InputError if there are no signals, the period is not positive, or time runs backwards or lasts too long.
    """
    if not period_s > 0.0:  # NaN fails too
        raise InputError(f"the time between samples must be > 0 s, got {period_s!r}")
    return _refine(result, _compute_signals(result), period_s)


def _compute_signals(result: Result) -> Signals:
    """Return signals on the problem's grid; raises as ``sample_signals``."""
    signals = result.problem.signals(result.x)
    times = signals.arrays["t"]
    with np.errstate(over="ignore", invalid="ignore"):
        duration_s = float(times[-1] - times[0])
        forward = bool((times[1:] >= times[:-1]).all())  # NaN fails too
    if not (forward and SHORTEST_S <= duration_s <= LONGEST_S):
        reason = f"it lasts {duration_s:g} s" if forward or duration_s < 0.0 else "time runs backwards in one phase"
        limits = f"{SHORTEST_S:g} to {LONGEST_S:g} s"
        raise InputError(f"a gait that is drawn, simulated or exported must last {limits}, but {reason}")
    return signals


def _refine(result: Result, signals: Signals, period_s: float) -> Signals:
    longest = float(np.diff(signals.arrays["t"]).max())
    factor = 1
    while longest > factor * period_s * (1.0 + 1e-9):  # rounding must not halve a step that equals the period
        factor *= 2  # few different grids, each of which is built once
    dense = result.problem.dense(factor) if factor > 1 else None
    return signals if dense is None else dense.signals(result.x)


def sample_finely(result: Result) -> Signals:
    """Return signals with ``FINE_INTERVALS`` intervals a step if the problem can be refined; raises as ``sample_signals``."""
    signals = _compute_signals(result)
    steps = max(1, len(result.problem.display.durations) // 2)
    return _refine(result, signals, float(signals.arrays["t"][-1]) / FINE_INTERVALS / steps)


def sample_at_period(result: Result, period_ms: int) -> Signals:
    """Return signals exactly a period apart, of all whole periods; of a motion that ends at rest, of the begun one, too.

    Values are interpolated linearly between fine samples, so that torques do not overshoot where a foot lands. Raises as
    ``sample_signals``, and InputError for a period that is not a whole number of milliseconds >= 1.
    """
    check_count("period_ms", period_ms)
    signals = _compute_signals(result)
    fine = _refine(result, signals, min(period_ms / 1000.0, float(signals.arrays["t"][-1]) / FINE_INTERVALS))
    count = 1000.0 * float(fine.arrays["t"][-1]) / period_ms
    rests = "qd" in fine.arrays and bool(np.abs(fine.arrays["qd"][-1]).max() < AT_REST)
    periods = max(1, math.ceil(count - ROUNDING) if rests else math.floor(count + ROUNDING))
    t = np.arange(periods + 1) * period_ms / 1000.0
    arrays = {"t": t}
    for name, values in fine.arrays.items():
        if name != "t":
            columns = values.reshape(len(values), -1).T
            interpolated = np.stack([np.interp(t, fine.arrays["t"], column) for column in columns], axis=1)
            arrays[name] = np.round(interpolated) if np.isin(values, (0.0, 1.0)).all() else interpolated
    return replace(fine, arrays=arrays)
