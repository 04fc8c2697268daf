"""Preparation of a run: checks of arguments, seeds, starting points."""

from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from metaheuristics.errors import SearchError, abbreviate, is_number
from metaheuristics.interface import Algorithm, Array, Bounded, Start, to_real_array

LARGEST = 1e100  # of a bound; algorithms multiply distances


def prepare_start(
    objective: Bounded,
    population: int,
    evaluations: int,
    seed: int,
    initial: ArrayLike | None = None,
    time_limit_s: float | None = None,
) -> Start:
    """Return the inputs of an algorithm; raises SearchError for a seed, bounds or starting points (R, n) that are not allowed."""
    if not is_number(seed, Integral) or seed < 0:
        raise SearchError(f"seed must be a whole number >= 0, got {abbreviate(seed)}")
    lower, upper = read_bounds(objective)
    first, second = np.random.SeedSequence(int(seed)).spawn(2)
    return Start(
        lower=lower,
        upper=upper,
        initial=draw_starting_points(lower, upper, population, initial, first),
        evaluations=evaluations,
        rng=np.random.default_rng(second),
        time_limit_s=time_limit_s,
        names=tuple(objective.names),
    )


def read_bounds(objective: Bounded) -> tuple[Array, Array]:
    """Return read-only copies of the lower and upper bounds (n,); SearchError unless they are finite and not inverted."""
    if not callable(objective) or not all(hasattr(objective, name) for name in ("names", "lower", "upper")):
        raise SearchError(f"objective must be a function of X with names, lower and upper, got {abbreviate(objective)}")
    try:
        names = tuple(objective.names)
        lower, upper = np.array(to_real_array(objective.lower)), np.array(to_real_array(objective.upper))
    except (TypeError, ValueError) as error:
        raise SearchError(f"names must be one for each variable, and bounds must be numbers: {error}") from error
    if not names or lower.shape != (len(names),) or upper.shape != (len(names),):
        raise SearchError(
            f"bounds must have shape (n,) with one name per variable and n >= 1; got {len(names)} names, "
            f"lower of shape {lower.shape}, upper of shape {upper.shape}"
        )
    for name, low, high in zip(names, lower.tolist(), upper.tolist(), strict=True):
        if not -LARGEST <= low <= high <= LARGEST:  # NaN fails too
            raise SearchError(
                f"variable {name!r}: bounds must be finite, within +-{LARGEST:g}, with lower <= upper, got {low} and {high}; "
                "equal bounds fix a variable"
            )
    lower.setflags(write=False)
    upper.setflags(write=False)
    return lower, upper


class UnitCube:
    """Free variables scaled to the unit cube, for searches that work there."""

    def __init__(self, start: Start) -> None:
        self._start = start
        self._free = np.flatnonzero(start.upper > start.lower)
        self._lower = start.lower[self._free]
        self._range = start.upper[self._free] - self._lower
        self.size = int(self._free.size)  #: k, number of free variables

    def shares(self, X: Array) -> Array:
        """Return the positions (..., k) in the cube of points (..., n)."""
        return np.asarray((X[..., self._free] - self._lower) / self._range)

    def points(self, Z: Array) -> Array:
        """Return the points (P, n) within the bounds at positions (P, k)."""
        return fill_fixed(self._lower + Z * self._range, self._start.lower, self._start.upper)


def fill_fixed(free: Array, lower: Array, upper: Array) -> Array:
    """Return points (P, n) within the bounds (n,) from values (P, k) of the free variables, whose bounds differ."""
    points = np.tile(lower, (len(free), 1))
    points[:, upper > lower] = free
    return np.clip(points, lower, upper)


def check_budget(algorithm: Algorithm, evaluations: int) -> None:
    """Raise SearchError unless the budget of an algorithm holds its starting points."""
    if isinstance(algorithm, type) or not (
        hasattr(algorithm, "population") and callable(getattr(algorithm, "start", None))
    ):
        raise SearchError(
            f"algorithm must be made by make_algorithm('pso') or ParticleSwarm(), got {abbreviate(algorithm)}"
        )
    check_population(algorithm)
    if not is_number(evaluations, Integral) or evaluations < algorithm.population:
        raise SearchError(
            f"evaluations must be a whole number >= the population of {name_of(algorithm)!r}, {algorithm.population}, got "
            f"{abbreviate(evaluations)}: raise the budget or take a smaller population"
        )


def check_population(algorithm: Algorithm, name: str = "") -> None:
    """Raise SearchError unless an algorithm has at least one point."""
    population: Any = getattr(algorithm, "population", None)
    if not is_number(population, Integral) or population < 1:
        raise SearchError(
            f"algorithm {name or name_of(algorithm)!r}: population must be a whole number >= 1, got {abbreviate(population)}"
        )


def check_helpers(handling: object, callback: object) -> None:
    """Raise SearchError unless these are a constraint handling and a function or None."""
    if isinstance(handling, type) or not callable(getattr(handling, "rule", None)):
        raise SearchError(f"handling must be made by make_handling('deb') or Deb(), got {abbreviate(handling)}")
    if callback is not None and not callable(callback):
        raise SearchError(f"callback must be a function of X, f and violation, got {abbreviate(callback)}")


def name_of(algorithm: Algorithm) -> str:
    """Return the name of an algorithm; a user's class may have none."""
    return str(getattr(algorithm, "name", type(algorithm).__name__))


def check_points(given: object, lower: Array, upper: Array, source: str = "ask") -> Array:
    """Return the points (P, n) of a source; SearchError for another shape, no point, NaN, or a point outside the bounds."""
    wanted = f"{source}: points must have shape (P, {len(lower)}) with P >= 1"
    try:
        points = to_real_array(given)
    except (TypeError, ValueError, OverflowError) as error:
        raise SearchError(f"{wanted}; got something other than numbers: {error}") from error
    if points.ndim != 2 or points.shape[1] != len(lower) or not len(points):
        raise SearchError(f"{wanted}; got shape {points.shape}")
    outside = np.argwhere(~((points >= lower) & (points <= upper)))  # NaN is outside too
    if len(outside):
        row, column = outside[0]
        raise SearchError(
            f"{source}: {points[row, column]} for variable {column} of point {row}, outside the bounds "
            f"{lower[column]}..{upper[column]}: clip the points"
        )
    return points


def draw_starting_points(
    lower: Array, upper: Array, population: int, given: ArrayLike | None, seed: np.random.SeedSequence
) -> Array:
    """Return uniform points (P, n), read-only, of which given ones (R, n) replace the first R.

    Draws fill row by row, so that the first rows do not depend on P.

    Raises:
        SearchError: The given points have another shape or lie outside the bounds.
    """
    draws = np.random.default_rng(seed).random((population, len(lower)))
    points = np.clip(lower + draws * (upper - lower), lower, upper)
    if given is not None:
        rows = check_points(given, lower, upper, "initial")
        if len(rows) > population:
            raise SearchError(f"initial: at most {population} points, the population of the algorithm, got {len(rows)}")
        points[: len(rows)] = rows
    points.setflags(write=False)
    return points
