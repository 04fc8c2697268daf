"""Runs of four searches on the true front of each phase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.papers.paper_runs import Effort
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
class ParetoEffort(Effort):
    """Effort of the reproduction of power against stability.

    Attributes:
        runs: of each search, as in the paper.
        budgets: evaluations, rising; each has separate runs, since DCNSGA-III plans for its budget. The first is that of the
            same authors' paper of 2023; the abstract gives none.
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
    """Run of a search.

    Attributes:
        algorithm: name of the search.
        run: number of the run.
        budget: allowed evaluations.
        looks: in the order of their evaluations; only the last one, the end, has points.
    """

    algorithm: str
    run: int
    budget: int
    looks: tuple[Snapshot, ...]


def make_spec(phase: str, effort: ParetoEffort) -> ProblemSpec:
    """Return a phase as in the paper of 2023."""
    return ProblemSpec(name=phase, options={"intervals": effort.intervals})


def choose_looks(budget: int) -> list[int]:
    """Return the evaluations after which a run is looked at: whole generations, evenly spread over their logarithm."""
    count = 1 + round(LOOKS_PER_DECADE * np.log10(budget / FIRST_LOOK))
    generations = np.rint(np.geomspace(1, budget // FIRST_LOOK, max(count, 1))).astype(int)
    return [int(g) * FIRST_LOOK for g in np.unique([*generations, budget // FIRST_LOOK])]


def make_searches(phase: str, front: Sequence[FrontPoint], effort: ParetoEffort) -> list[Computation]:
    """Return every run of a phase as a computation; ``make_run`` takes its result."""
    spec, ends = make_spec(phase, effort), (front[0], front[-1])
    problem = spec.load()
    free = competing_objective(CRITERION, problem).freed(problem)
    return [
        Computation(
            name=f"{phase}-{name.lower()}-{budget}-{run:02d}",
            inputs={
                **fingerprint(free),
                "criterion": CRITERION,
                "front": [[end.value, end.power_W] for end in ends],
                "algorithm": repr(front_algorithm(name)),
                "looks": choose_looks(budget),
                "seed": run,
            },
            function=partial(run_search, spec, ends, name, budget, run),
        )
        for budget in effort.budgets
        for name in ALGORITHMS
        for run in range(effort.runs)
    ]


def run_search(spec: ProblemSpec, ends: Sequence[FrontPoint], name: str, budget: int, run: int) -> dict[str, Any]:
    """Return a run as plain data; ``ends`` are those of the front, whose ranges count as 1."""
    problem = spec.load()
    criterion = competing_objective(CRITERION, problem)
    objectives = PowerAndCompeting(
        compile_objective(criterion.freed(problem), threads=1), criterion, Scale([ends[0], ends[-1]])
    )
    snapshots = minimize_many(objectives, front_algorithm(name), evaluations=choose_looks(budget), seed=run)
    points = [[] for _ in snapshots[1:]] + [snapshots[-1].X.tolist()]
    looks = [
        {**asdict(snapshot), "X": X, "F": snapshot.F.tolist()} for snapshot, X in zip(snapshots, points, strict=True)
    ]
    return {"algorithm": name, "run": run, "budget": budget, "looks": looks}


def make_run(result: Mapping[str, Any]) -> FrontRun:
    """Return the run of a computation's result."""
    looks = tuple(
        Snapshot(**{**look, "X": np.array(look["X"]), "F": np.array(look["F"]).reshape(-1, 2)})
        for look in result["looks"]
    )
    return FrontRun(**{**result, "looks": looks})
