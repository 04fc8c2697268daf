"""Instances with two objectives: a problem's own, and one of its performance figures or variables; their true fronts are shipped.

The front's points were found by IPOPT, each as the best value of the first objective for a demanded value of the second
(``python -m benchmarks.gaitbench.fronts``); an instance evaluates them again by its own functions when it is loaded.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from typing import Any, Literal

import numpy as np
from casadi import MX

from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.decoding import decode
from nlp_gait.errors import check_name, unknown
from nlp_gait.formulation import Array, Assembly, Constraint, GaitProblem, Parameter, Point, load
from nlp_gait.gaitbench.adapters import find_adapter
from nlp_gait.gaitbench.facts import read_data
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SECOND, LIMIT, UNLIMITED = "second_objective", "second_limit", 1e12
REFERENCE = 1.1  # point of the hypervolume, with both ranges of the true front as 1
FAILED = 1e30  # objectives where a value is missing


@dataclass(frozen=True, kw_only=True)
class FrontDefinition:
    """What an instance with two objectives is made from."""

    id: str  #: its name, which never changes
    what: str  #: one line
    problem: str  #: as in ``nlp-gait list``; its own objective is the first one
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)  #: of the problem
    values: Mapping[str, float] = field(default_factory=dict)  #: parameters that differ from their defaults
    second: str  #: performance figure or variable of the problem
    unit: str  #: of the second objective
    sense: Literal["minimise", "maximise"]  #: of the second objective
    source: str  #: paper that the problem comes from

    def make(self) -> GaitProblem:
        """Return the problem, whose second objective, to be minimised, is a row with the limit ``second_limit``."""
        sign = 1.0 if self.sense == "minimise" else -1.0

        def change(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
            value: MX = point[self.second] if self.second in base.names else assembly.indexes[self.second]
            row = Constraint(name=SECOND, unit=self.unit, scale=1.0, value=sign * value, upper=point[LIMIT])
            rows = (*assembly.constraints, row)
            return replace(assembly, objective=base.objective.sign * assembly.objective, constraints=rows)

        base = load(self.problem, **self.options).with_values(**self.values)
        limit = Parameter(
            name=LIMIT, unit=self.unit, default=UNLIMITED, description=f"largest {SECOND}", minimum=-UNLIMITED
        )
        objective = replace(base.objective, sense="minimise")
        return base.derive(name=f"gaitbench-{self.id}", objective=objective, parameters=(limit,), change=change)


@dataclass(frozen=True, kw_only=True)
class FrontQuality:
    """How near points come to a true front, with both of its ranges as 1."""

    #: share of that of the true front, whose points are joined by straight lines; reference (1.1, 1.1)
    hypervolume: float
    igd_plus: float  #: IGD+: mean over the true front of the distance by which the points are worse
    epsilon: float  #: least number that has to be subtracted from all objectives so that no point of the true front is better


class FrontInstance:
    """A problem with two objectives: minimise F(x) within bounds, where the violation is 0.

        F, violation = problem(X)

    F is 0 at the best and 1 at the worst value of each objective on the true front. ``minimize_many`` takes it.
    """

    count = 2  #: objectives

    def __init__(self, id: str) -> None:
        """Use ``gaitbench.load_front`` instead."""
        self.id = id  #: its name
        self.definition = get_front_definition(id)  #: what it is made from
        self.gait_problem: GaitProblem = self.definition.make()
        self._objective: CompiledObjective = compile_objective(self.gait_problem, threads=1)
        self.names, self.lower, self.upper = self._objective.names, self._objective.lower, self._objective.upper
        self.inequalities, self.groups = self._objective.inequalities, self._objective.groups
        self._row = list(self.groups).index(SECOND)
        self.front_x: Array = np.array(load_points()[id])  #: (k, n) points of the true front
        values, self.front_violation = self.evaluate(self.front_x)
        self.best, self.worst = values.min(axis=0), values.max(axis=0)  #: (2,) on the true front, both to be minimised
        order = np.argsort(values[:, 0], kind="stable")
        self.front_x, self.front_violation = self.front_x[order], self.front_violation[order]
        self.front: Array = (values[order] - self.best) / (self.worst - self.best)  #: (k, 2) by rising first objective

    def __reduce__(self) -> tuple[Any, ...]:
        return load_front, (self.id,)

    def __repr__(self) -> str:
        return f"<GaitBench {self.id}: {len(self.names)} variables, two objectives>"

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return objectives F (P, 2), scaled by the true front, and total violations (P,) of points X (P, n)."""
        values, violation = self.evaluate(X)
        return np.where(np.isfinite(values), (values - self.best) / (self.worst - self.best), FAILED), violation

    def evaluate(self, X: Array) -> tuple[Array, Array]:
        """Return both objectives (P, 2), to be minimised, in their units, and total violations (P,); NaN where one is missing."""
        cost, violation = self._objective(X)
        return np.column_stack([cost, self._objective.constraints(X)[:, self._row]]), violation

    def measure(self, F: Array) -> FrontQuality:
        """Return how near feasible points with objectives F (k, 2) come to the true front; 0 and infinities without any.

        Source:
            Zitzler, Thiele (1998), hypervolume; Ishibuchi, Masuda, Tanigaki, Nojima (2015), IGD+; Zitzler, Thiele, Laumanns,
            Fonseca, Grunert da Fonseca (2003), additive epsilon.
        """
        if not len(F):
            return FrontQuality(hypervolume=0.0, igd_plus=math.inf, epsilon=math.inf)
        first, second = self.front.T
        whole = float(np.trapezoid(REFERENCE - second, first)) + (REFERENCE - first[-1]) * (REFERENCE - second[-1])
        worse = F[None] - self.front[:, None]  # (k of the front, points, 2)
        return FrontQuality(
            hypervolume=compute_hypervolume(F, REFERENCE) / whole,
            igd_plus=float(np.linalg.norm(np.maximum(worse, 0.0), axis=2).min(axis=1).mean()),
            epsilon=float(worse.max(axis=2).min(axis=1).max()),
        )

    def to(self, adapter: str) -> Any:
        """Return the instance as a problem of ``pymoo`` or ``pygmo``; raises UnknownNameError and MissingExtraError."""
        check_name("adapter", adapter)
        return find_adapter(f"{adapter}-front")(self)


def compute_hypervolume(F: Array, reference: float) -> float:
    """Return the area that points F (k, 2) dominate, up to the same reference in both objectives."""
    area, edge = 0.0, reference
    for first, second in sorted(map(tuple, np.asarray(F, dtype=float).tolist())):
        if first < reference and second < edge:
            area += (reference - first) * (edge - second)
            edge = second
    return area


@cache
def _load_definitions() -> Mapping[str, FrontDefinition]:
    return {entry["id"]: decode(FrontDefinition, entry, entry["id"]) for entry in read_data("fronts.json")}


@cache
def load_points() -> Mapping[str, list[list[float]]]:
    """Return the points (k, n) of the true fronts by id."""
    points: Mapping[str, list[list[float]]] = read_data("front_points.json")
    return points


def list_fronts() -> tuple[str, ...]:
    """Return the ids of the instances with two objectives."""
    return tuple(_load_definitions())


def get_front_definition(id: str) -> FrontDefinition:
    """Return what an instance with two objectives is made from; raises UnknownNameError."""
    if id not in _load_definitions():
        raise unknown("instance with two objectives", id, list_fronts())
    return _load_definitions()[id]


@lru_cache(maxsize=32)
def load_front(id: str) -> FrontInstance:
    """Load an instance with two objectives by its id; raises UnknownNameError."""
    check_name("instance", id)
    return FrontInstance(id)
