"""Optimal gaits at the points of a grid with their derivatives, and gaits between these points, judged by the exact functions."""

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import read_json
from nlp_gait.formulation import Array, GaitProblem, Result, load
from nlp_gait.formulation.result import explain_errors
from nlp_gait.formulation.solution import ConstraintValue
from nlp_gait.user_code import resolve_code


@dataclass(frozen=True, kw_only=True, eq=False)
class LibraryGait:
    """A gait between the points of a library."""

    result: Result  #: problem at these values, and x
    objective: float  #: exact, in the problem's sense
    feasible: bool  #: whether all constraints are satisfied
    violated: tuple[ConstraintValue, ...]  #: violated constraints and by how much, worst first


@dataclass(frozen=True, kw_only=True, eq=False)
class GaitLibrary:
    """Optimal gaits over a grid of values."""

    problem: GaitProblem
    axes: Mapping[str, tuple[float, ...]]  #: increasing values by name, in the order of the grid's axes
    x: Array  #: (m1, m2, ..., n) optima; NaN without one
    slopes: Array  #: (m1, m2, ..., n, k) their change per unit of each axis; 0 where there is no derivative

    def interpolate(self, **at: float) -> LibraryGait:
        """Return the gait at a value of every axis.

        It is the mean of the optima at the corners of the cell, with the weights of multilinear interpolation, each moved by half
        of its derivatives: exact for quadratic functions of one axis.

        Source:
            Guessab, Nouisser, Schmeisser (2006), "Multivariate approximation by a combination of modified Taylor polynomials".

        Raises UnknownNameError or InputError for another axis, a value beyond the grid, or a corner without an optimum.
        """
        x = self._average(at)
        if not np.isfinite(x).all():
            values = ", ".join(f"{name} = {value:g}" for name, value in at.items())
            raise InputError(f"the library has no optimum next to {values}; choose other values, or a finer grid")
        problem = self.problem.place(at)
        x = np.clip(x, problem.lower, problem.upper)
        model = build_exact_model(problem)
        found, result = model.at(x, problem.p), Result(problem=problem, x=x)
        objective = problem.objective.sign * found.cost
        violated = model.find_violated(found)
        return LibraryGait(result=result, objective=objective, feasible=found.feasible, violated=violated)

    def covers(self, **at: float) -> bool:
        """Return whether there is an optimum at all corners around a value of every axis; raises as ``interpolate``."""
        return bool(np.isfinite(self._average(at)).all())

    def _average(self, at: Mapping[str, float]) -> Array:
        """Return x (n,) at a value of every axis; NaN next to a corner without an optimum."""
        for name in at:
            if name not in self.axes:
                raise unknown("axis", name, self.axes)
        if missing := [name for name in self.axes if name not in at]:
            raise InputError(f"a value of every axis is needed; {', '.join(missing)} is missing")
        x = np.zeros(len(self.problem.names))
        for corner in itertools.product(*(self._find_cell(name, at[name]) for name in self.axes)):
            weight = math.prod(share for _, share, _ in corner)
            index, way = tuple(i for i, _, _ in corner), np.array([distance for *_, distance in corner])
            x += weight * (self.x[index] + self.slopes[index] @ way / 2)
        return x

    def _find_cell(self, name: str, value: float) -> list[tuple[int, float, float]]:
        """Return the neighbours of a value on an axis: number, weight and distance from it to the value."""
        values = np.array(self.axes[name])
        if not values[0] <= value <= values[-1]:
            raise InputError(f"{name} must be within the library's {values[0]:g} to {values[-1]:g}, got {value!r}")
        k = min(int(np.searchsorted(values, value, side="right")) - 1, len(values) - 1)
        if values[k] == value:
            return [(k, 1.0, 0.0)]
        share = float((value - values[k]) / (values[k + 1] - values[k]))
        return [(k, 1.0 - share, float(value - values[k])), (k + 1, share, float(value - values[k + 1]))]


@dataclass(frozen=True, kw_only=True)
class LibraryPoint:
    """The optimum at a point of the grid."""

    at: Mapping[str, float]  #: value of each axis
    feasible: bool  #: whether an optimum was found
    objective: float  #: exact, in the problem's sense
    x: Mapping[str, float]  #: by variable
    #: Change of each variable per unit of an axis, by axis; None if undefined
    slopes: Mapping[str, Mapping[str, float | None]]


@dataclass(frozen=True, kw_only=True)
class _LibraryFile:
    problem: str
    options: Mapping[str, str | int | float | bool]
    parameters: Mapping[str, float]
    axes: Mapping[str, tuple[float, ...]]
    points: tuple[LibraryPoint, ...]


def load_library(path: str | Path) -> GaitLibrary:
    """Return the library of a file that ``nlp-gait walk --library`` wrote; raises InputError if it is not one."""
    with explain_errors(f"library {str(path)!r}", "`nlp-gait walk --library` writes a valid one"):
        file = decode(_LibraryFile, read_json(Path(path), "library"), ignore_unknown=True)
        problem = load(resolve_code(file.problem, "problem", "it"), **file.options).with_values(**file.parameters)
        return make_library(problem, file.axes, file.points)


def make_library(
    problem: GaitProblem, axes: Mapping[str, tuple[float, ...]], points: Iterable[LibraryPoint]
) -> GaitLibrary:
    """Return the library of optima at all points of a grid; raises InputError for values that are not on its axes."""
    if not axes:
        raise InputError("a library has at least one axis")
    for name, values in axes.items():
        if not values or any(a >= b for a, b in pairwise(values)):
            raise InputError(f"axis {name} of a library must have increasing values, got {list(values)}")
    x = np.full((*map(len, axes.values()), len(problem.names)), np.nan)
    slopes = np.zeros((*x.shape, len(axes)))
    for point in points:
        if point.feasible:
            index = tuple(values.index(point.at[name]) for name, values in axes.items())
            x[index] = problem.check_x(point.x)
            slopes[index] = [[point.slopes[axis][name] or 0.0 for axis in axes] for name in problem.names]
    return GaitLibrary(problem=problem, axes=axes, x=x, slopes=slopes)
