"""Protocols of objectives and algorithms for the loop in `minimize.py`, constraint handling, and the result of a run.

The loop owns everything that must be equal for all algorithms: the starting points, the count of evaluations, the
marking of failed evaluations, the constraint handling and the record. An algorithm only proposes points (`ask`) and
learns from them (`tell`), so an adapter to another package is a small class with these two methods.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.errors import check_number

Array: TypeAlias = NDArray[np.float64]
Settings = TypeVar("Settings")


def to_real_array(values: object) -> Array:
    """Return values as doubles, copied only if they are not that already.

    Raises:
        TypeError: They are complex, masked, truth values, texts or dates, of which NumPy would make doubles in silence.
        ValueError: They have no one shape.
    """
    array = np.asarray(values)
    if np.ma.is_masked(values) or array.dtype.kind not in "iufO":
        raise TypeError(f"they must be real numbers, got {type(values).__name__} of {array.dtype}")
    return array.astype(np.float64, copy=False)


class Bounded(Protocol):
    """Variables with bounds, which are read once, before the first call."""

    @property
    def names(self) -> tuple[str, ...]:
        """The n names of the variables."""

    @property
    def lower(self) -> Array:
        """(n,) lower bounds, finite."""

    @property
    def upper(self) -> Array:
        """(n,) upper bounds, finite and >= lower; equal bounds fix a variable."""


class BatchObjective(Bounded, Protocol):
    """An objective to be minimised within bounds, called on many points at once."""

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Return objective values (P,) and total violations (P,) of points (P, n) within the bounds; P varies.

        A violation is >= 0, and zero if and only if the point is feasible. NaN or infinity in either value marks the
        evaluation as failed. X is read-only.
        """


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Start:
    """Inputs of an algorithm at the start of a run."""

    lower: Array  #: (n,) lower bounds, read-only
    upper: Array  #: (n,) upper bounds, read-only
    #: (P, n) starting points, read-only; P is the population of the algorithm. The first `ask` returns them
    initial: Array
    evaluations: int  #: budget of the run, a hint for algorithms that plan ahead
    rng: np.random.Generator  #: the only source of randomness of the search
    time_limit_s: float | None = None  #: limit of the run [s]; None for none
    names: tuple[str, ...] = ()  #: the n names of the variables


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Rule:
    """A total preorder of points; smaller keys are better, the first key decides before the second.

    The keys are the violation and the objective as the rule sees them. So pairwise comparison and sorting have one definition,
    and packages that put feasible points first by themselves can follow any rule. A failed evaluation, both values of which are
    infinite, comes last under every rule.
    """

    #: Maps f and violation, of equal shape, free of NaN, to two keys of that shape: effective violation, >= 0, and objective
    keys: Callable[[Array, Array], tuple[Array, Array]]

    def better(self, f1: Array, violation1: Array, f2: Array, violation2: Array) -> NDArray[np.bool_]:
        """Compare pairs by objectives and violations (P,) each; return (P,) True where the first is strictly better."""
        major1, minor1 = self.keys(f1, violation1)
        major2, minor2 = self.keys(f2, violation2)
        better: NDArray[np.bool_] = (major1 < major2) | ((major1 == major2) & (minor1 < minor2))
        return better

    def order(self, f: Array, violation: Array) -> NDArray[np.intp]:
        """Return the (P,) indices that sort points, best first; equals keep their order."""
        major, minor = self.keys(f, violation)
        return np.lexsort((minor, major))

    def best(self, f: Array, violation: Array) -> int:
        """Return the index of the best point, the first of equals."""
        return int(self.order(f, violation)[0])


FEASIBILITY = Rule(keys=lambda f, violation: (violation, f))
"""Feasible points by objective, before infeasible ones by violation: also how every run picks its reported best."""


class Points(NamedTuple):
    """Points with what is known about them; operations return new ones."""

    X: Array  #: (P, n) points
    f: Array  #: (P,) objectives; infinity where failed
    violation: Array  #: (P,) violations; infinity where failed

    @classmethod
    def none(cls, n: int) -> "Points":
        """Give zero points of n variables."""
        return cls(np.empty((0, n)), np.empty(0), np.empty(0))

    def take(self, rows: NDArray[np.intp] | slice) -> "Points":
        """Pick rows, in the order given."""
        return Points(self.X[rows], self.f[rows], self.violation[rows])

    def join(self, other: "Points") -> "Points":
        """Append the rows of others."""
        return Points(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def replace_rows(self, rows: NDArray[np.bool_], by: "Points") -> "Points":
        """Put the same rows of others, of equal number, in place of those that are True."""
        return Points(
            np.where(rows[:, None], by.X, self.X),
            np.where(rows, by.f, self.f),
            np.where(rows, by.violation, self.violation),
        )

    def best(self, count: int, rule: Rule) -> "Points":
        """Keep the best, best first; equals keep their order."""
        return self.take(rule.order(self.f, self.violation)[:count])

    def best_distinct(self, count: int, rule: Rule) -> "Points":
        """Keep the best, best first, with copies of a point only where there is nothing else to keep.

        Copies are recognised among neighbours in the order: points of equal f and violation may hide one another.
        """
        ranked = self.best(len(self.f), rule)
        copy = np.zeros(len(ranked.f), dtype=bool)
        copy[1:] = (ranked.X[1:] == ranked.X[:-1]).all(axis=1)
        return ranked.take(np.argsort(copy, kind="stable")[:count])


class ConstraintHandling(Protocol):
    """Settings of a constraint handling, immutable, SearchError where not allowed."""

    @property
    def name(self) -> str:
        """Name in reports."""

    def rule(self) -> Rule:
        """Return how points compare."""


class Search(Protocol):
    """A run in progress: `ask`, evaluate, `tell`, `stop`, and again."""

    def ask(self) -> Array:
        """Return points (P, n) within the bounds; P may vary. The search must not change the array afterwards."""

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule, /) -> None:
        """Learn from the points of the last `ask`.

        Called with whole generations only: when the budget cuts one short, or a stopping criterion is met, the run
        ends without this call.

        Args:
            X: (P, n) points of the last `ask`.
            f: (P,) objective values; infinity where the evaluation failed, never NaN.
            violation: (P,) total constraint violations; infinity where the evaluation failed, never NaN.
            rule: The only way to compare points, valid for this generation: a rule may tighten as the run proceeds.
        """

    def stop(self) -> tuple[str, ...]:
        """Return reasons in words why the search cannot usefully continue; empty to continue."""


class PopulationSearch(Generic[Settings]):
    """Base of searches that store the points of the next `ask`, the starting points first; subclasses add `tell`."""

    def __init__(self, settings: Settings, start: Start) -> None:
        """Store the starting points."""
        self._settings = settings
        self._start = start
        self._X = start.initial

    def ask(self) -> Array:
        """Return the stored points (P, n)."""
        return self._X

    def stop(self) -> tuple[str, ...]:
        """Return no reason: the search continues until the budget ends."""
        return ()


class Algorithm(Protocol):
    """Settings of a search algorithm, immutable; each `start` begins an independent run.

    Settings that are not allowed raise SearchError, as does a package that is not installed.
    """

    @property
    def name(self) -> str:
        """Short name, as in the registry."""

    @property
    def population(self) -> int:
        """Number of starting points."""

    def start(self, start: Start, /) -> "Search | CallingSearch":
        """Begin a run with bounds, starting points, budget and generator."""


class Ended(SystemExit):
    """End of a run; not an `Exception`, so that no optimiser treats it as a failed evaluation, and silent in a thread."""


class Evaluate(Protocol):
    """Evaluates points for a search that calls the objective, from any thread; raises `Ended` once the run is over."""

    #: Of one point (n,) to its objective and violation, faster; None if the run's rule or objective does not allow it
    point: Callable[[Array], tuple[float, float]] | None

    def __call__(self, X: Array, /) -> tuple[Array, Array, Rule]:
        """Evaluate points (P, n) as a generation."""


class CallingSearch(ABC):
    """Base of searches that call the objective instead of being asked; see `minimize`."""

    @abstractmethod
    def run(self, evaluate: Evaluate) -> str:
        """Call `evaluate` until it raises `Ended`; return the reason if the search ends by itself."""


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class History:
    """Best so far after each of the G generations, by the feasibility rules whatever the constraint handling."""

    evaluations: NDArray[np.int64]  #: (G,) evaluations used, failed ones included
    objective: Array  #: (G,) objective of the best; it may rise where the violation falls
    violation: Array  #: (G,) violation of the best; never rises
    elapsed_s: Array  #: (G,) wall-clock time since the run began [s]


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Result:
    """Outcome of a run: plain data, read-only, safe to pickle.

    There is always a best point: the best feasible one, or else the one of least violation.
    """

    x: Array  #: (n,) best point
    objective: float  #: its objective; infinity if every evaluation failed
    violation: float  #: its total constraint violation; infinity if every evaluation failed
    evaluations: int  #: evaluations used, failed ones included
    failed_evaluations: int  #: evaluations that gave NaN or infinity
    generations: int  #: batches evaluated, the starting points being the first
    history: History = field(repr=False)  #: best so far after each generation
    reasons: tuple[str, ...]  #: reasons for ending, in words; also "every evaluation failed" where that is so
    time_s: float  #: wall-clock time of the run [s]
    objective_time_s: float  #: part of it spent in the objective [s]
    algorithm: Algorithm  #: settings used
    handling: ConstraintHandling  #: constraint handling used
    seed: int  #: of starting points and search

    @property
    def feasible(self) -> bool:
        """Whether the best point satisfies all constraints."""
        return self.violation == 0.0


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a run, with the partial result.

    It propagates as any KeyboardInterrupt does, so that it ends a whole study and not only the run in progress. To get
    the partial result, catch it and read `result`.
    """

    def __init__(self, result: Result) -> None:
        """Store the result of all complete generations; its reasons are ("interrupted",)."""
        super().__init__(result)
        self.result = result

    def __str__(self) -> str:
        return f"interrupted after {self.result.evaluations} evaluations; the attribute 'result' has the partial result"


@dataclass(frozen=True, kw_only=True, slots=True)
class Deb:
    """Deb's feasibility rules: no parameter, the default.

    A feasible point beats an infeasible one, two feasible ones compare by objective, two infeasible ones by violation.
    Infeasible points of equal violation, on which the paper is silent, compare by objective.

    Source:
        Deb (2000), An efficient constraint handling method for genetic algorithms, section 3.
    """

    name: ClassVar[str] = "Deb's feasibility rules"

    def rule(self) -> Rule:
        return FEASIBILITY


@dataclass(frozen=True, kw_only=True, slots=True)
class StaticPenalty:
    """Compare f + weight * violation, as many papers do; the result depends on the weight."""

    weight: float  #: objective units per unit of violation, > 0; there is no default, as none suits every problem
    name: ClassVar[str] = "static penalty"

    def __post_init__(self) -> None:
        check_number(self, "weight", above=0.0)

    def rule(self) -> Rule:
        return Rule(keys=lambda f, violation: (np.zeros_like(f), f + self.weight * violation))
