"""Who takes part, with which budget, and what is run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from compare.analysis.record_statistics import find_best_known
from compare.study.record import RunRecord
from compare.study.task import IPOPT, Handling, ProblemSpec, Stop, Task

TARGETS = (1e-2, 1e-3, 1e-4)  # above the best known objective, relative
LARGEST = 1_000_000
REFERENCE_STARTS = 20  # of IPOPT, whose best is what the targets are measured from


@dataclass(frozen=True, kw_only=True)
class Opponent:
    """A search as it takes part.

    Attributes:
        label: what it is called.
        algorithm: its name.
        evaluations: budget of a run.
        planned: whether it knows its budget, so that it is another one with each budget.
        handling: of constraints.
        runs: at most so many.
    """

    label: str
    algorithm: str
    evaluations: int = LARGEST
    planned: bool = False
    handling: str = "deb"
    runs: int = 100


def _lshade(exponent: int) -> Opponent:
    return Opponent(
        label=f"lshade 1e{exponent}",
        algorithm="lshade",
        evaluations=10**exponent,
        planned=True,
        handling="epsilon",
    )


# All with their defaults. L-SHADE has epsilon levels, and shrinks over its budget, so there is one for each; SciPy's solvers take
# 0.5 ms for each evaluation of their own, Bayesian optimisation seconds.
OPPONENTS = (
    Opponent(label="cma", algorithm="cma"),
    Opponent(label="cma-al", algorithm="cma-al"),
    *(_lshade(exponent) for exponent in (3, 4, 5, 6)),
    Opponent(label="SLSQP starts", algorithm="scipy:SLSQP", evaluations=100_000),
    Opponent(label="de", algorithm="de"),
    Opponent(label="pso", algorithm="pso"),
    Opponent(label="bayes", algorithm="bayes", evaluations=60, runs=3),
    Opponent(label="COBYQA starts", algorithm="scipy:COBYQA", evaluations=100_000),
    Opponent(label="aco", algorithm="aco"),
    Opponent(label="ga", algorithm="ga"),
    Opponent(label="aco-grid", algorithm="aco-grid"),
    Opponent(label="random", algorithm="random"),
    Opponent(label="sobol", algorithm="sobol"),
)


def reference_tasks(problem: ProblemSpec) -> tuple[Task, ...]:
    """Starts of IPOPT, which give the best known objective."""
    return tuple(Task(problem=problem, solver=IPOPT, run=run) for run in range(REFERENCE_STARTS))


def tasks_of(problem: ProblemSpec, opponent: Opponent, runs: int, reference: float) -> tuple[Task, ...]:
    """Runs of an opponent, each of which ends at the tightest target."""
    objective = problem.load().objective
    target = reference + objective.sign * TARGETS[-1] * abs(reference)
    return tuple(
        Task(
            problem=problem,
            solver=opponent.algorithm,
            label=opponent.label,
            handling=Handling(name=opponent.handling),
            stop=Stop(evaluations=opponent.evaluations, target=target),
            run=run,
        )
        for run in range(min(runs, opponent.runs))
    )


def reference_of(problem: ProblemSpec, records: Sequence[RunRecord]) -> float:
    """Best objective of some runs that the judge finds feasible."""
    return find_best_known(records, problem.load().objective)
