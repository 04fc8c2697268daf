"""Runs behind the reproduction: the true front of each phase, and four algorithms on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.questions.pareto.competing import MARGINS, competing_objective
from compare.questions.pareto.front import FrontPoint
from compare.questions.pareto.search import PowerAndCompeting, Scale
from compare.study.store import Computation
from compare.study.task import ProblemSpec
from metaheuristics.multi_objective import FRONT_ALGORITHMS, Snapshot, front_algorithm, minimize_many
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.kernel.compiled import compile_objective

ALGORITHMS = tuple(FRONT_ALGORITHMS)
PHASES = ("nao-ssp", "nao-dsp")
CRITERION = MARGINS[0]  # the mean lateral margin; the abstract does not say what measures stability
LOOKS_PER_DECADE = 6
FIRST_LOOK = 100  # evaluations, one generation


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much is computed.

    Attributes:
        runs: of each algorithm, as in the paper.
        budgets: evaluations, rising; each has runs of its own, for DCNSGA-III plans for its budget. The first is that of the same
            authors' paper of 2023; the abstract gives none.
        points: of the true front.
        starts: random starts at some of its points.
        intervals: between the samples of a phase, as in the paper of 2023.
    """

    runs: int = 11
    budgets: tuple[int, ...] = (10_000,)
    points: int = 40
    starts: int = 5
    intervals: int = 10


@dataclass(frozen=True, kw_only=True)
class FrontRun:
    """One run.

    Attributes:
        algorithm: its name.
        run: its number.
        budget: evaluations that it was given.
        looks: in the order of their evaluations; the last is the end, and only that one keeps its points.
    """

    algorithm: str
    run: int
    budget: int
    looks: tuple[Snapshot, ...]


def spec_of(phase: str, effort: Effort) -> ProblemSpec:
    """A phase as in the paper of 2023."""
    return ProblemSpec(name=phase, options={"intervals": effort.intervals})


def looks_of(budget: int) -> list[int]:
    """Evaluations after which a run is looked at: whole generations, evenly spread over their logarithm."""
    count = 1 + round(LOOKS_PER_DECADE * np.log10(budget / FIRST_LOOK))
    generations = np.rint(np.geomspace(1, budget // FIRST_LOOK, max(count, 1))).astype(int)
    return [int(g) * FIRST_LOOK for g in np.unique([*generations, budget // FIRST_LOOK])]


def searches(
    phase: str, front: Sequence[FrontPoint], effort: Effort
) -> list[tuple[Computation, Callable[[Any], FrontRun]]]:
    """Every run of a phase as a step, and what makes the run of its result."""
    spec = spec_of(phase, effort)
    problem = spec.load()
    free = competing_objective(CRITERION, problem).freed(problem)
    found: list[tuple[Computation, Callable[[Any], FrontRun]]] = []
    for budget in effort.budgets:
        for name in ALGORITHMS:
            for run in range(effort.runs):
                step = Computation(
                    name=f"{phase}-{name.lower()}-{budget}-{run:02d}",
                    inputs={
                        **fingerprint(free),
                        "criterion": CRITERION,
                        "front": [[p.value, p.power_W] for p in (front[0], front[-1])],
                        "algorithm": repr(front_algorithm(name)),
                        "looks": looks_of(budget),
                        "seed": run,
                    },
                    function=partial(search, spec, (front[0], front[-1]), name, looks_of(budget), run),
                )
                found.append((step, partial(run_of, name, run, budget)))
    return found


def search(spec: ProblemSpec, ends: Sequence[FrontPoint], name: str, looks: Sequence[int], seed: int) -> dict[str, Any]:
    """One run, as plain data; ``ends`` are those of the front, whose ranges count as 1."""
    problem = spec.load()
    criterion = competing_objective(CRITERION, problem)
    objectives = PowerAndCompeting(
        compile_objective(criterion.freed(problem), threads=1), criterion, Scale([ends[0], ends[-1]])
    )
    snapshots = minimize_many(objectives, front_algorithm(name), evaluations=looks, seed=seed)
    points = [[] for _ in snapshots[1:]] + [snapshots[-1].X.tolist()]
    return {
        "looks": [
            {**asdict(snapshot), "X": X, "F": snapshot.F.tolist()}
            for snapshot, X in zip(snapshots, points, strict=True)
        ]
    }


def run_of(name: str, run: int, budget: int, kept: dict[str, Any]) -> FrontRun:
    """The run of a step's result."""
    looks = tuple(
        Snapshot(**{**look, "X": np.array(look["X"]), "F": np.array(look["F"]).reshape(-1, 2)})
        for look in kept["looks"]
    )
    return FrontRun(algorithm=name, run=run, budget=budget, looks=looks)
