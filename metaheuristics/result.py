"""Result of a run."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from metaheuristics.array import Array
from metaheuristics.constraint_handling import ConstraintHandling
from metaheuristics.interface import Algorithm


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class History:
    """Best so far after each of the G generations, by the feasibility rules whatever the constraint handling.

    Attributes:
        evaluations: (G,) evaluations used, failed ones included.
        objective: (G,) objective of the best; it may rise where the violation falls.
        violation: (G,) violation of the best; never rises.
        elapsed_s: (G,) wall-clock time since the run began [s].
    """

    evaluations: NDArray[np.int64]
    objective: Array
    violation: Array
    elapsed_s: Array


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Result:
    """Outcome of a run: plain data, read-only, safe to pickle.

    There is always a best point: the best feasible one, or else the one of least violation.

    Attributes:
        x: (n,) best point.
        objective: Its objective; infinity if every evaluation failed.
        violation: Its total constraint violation; infinity if every evaluation failed.
        evaluations: Evaluations used, failed ones included.
        failed_evaluations: Evaluations that gave NaN or infinity.
        generations: Batches evaluated, the starting points being the first.
        history: Best so far after each generation.
        reasons: Reasons for ending, in words; also "every evaluation failed" where that is so.
        time_s: Wall-clock time of the run [s].
        objective_time_s: Part of it spent in the objective [s].
        algorithm: Settings used.
        handling: Constraint handling used.
        seed_entropy: With the spawn key, all that is needed to repeat the run:
            `numpy.random.SeedSequence(seed_entropy, spawn_key=seed_spawn_key)`.
        seed_spawn_key: See seed_entropy.
    """

    x: Array
    objective: float
    violation: float
    evaluations: int
    failed_evaluations: int
    generations: int
    history: History = field(repr=False)
    reasons: tuple[str, ...]
    time_s: float
    objective_time_s: float
    algorithm: Algorithm
    handling: ConstraintHandling
    seed_entropy: int | tuple[int, ...]
    seed_spawn_key: tuple[int, ...]

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
