"""Runs of four searches on the true front of each phase."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from compare.papers.paper_runs import Effort, make_computation
from compare.questions.pareto.competing import MARGINS, make_competing_objective
from compare.questions.pareto.front import FrontPoint
from compare.questions.pareto.searches import PowerAndCompeting, Scale
from compare.study.store import Computation
from compare.study.task import ProblemSpec
from metaheuristics.multi_objective import FRONT_ALGORITHMS, Snapshot, make_front_algorithm, minimize_many
from nlp_gait.backends.kernel.compiled import compile_objective

ALGORITHMS = tuple(FRONT_ALGORITHMS)
PHASES = ("nao-ssp", "nao-dsp")
CRITERION = MARGINS[0]  # the mean lateral margin; the abstract does not say what measures stability
LOOKS_PER_DECADE = 6
FIRST_LOOK = 100  # evaluations, one generation


@dataclass(frozen=True, kw_only=True)
class ParetoEffort(Effort):
    """Effort of the reproduction of power against stability."""

    runs: int = 11  # of each search, as in the paper
    # Evaluations, rising; each has separate runs, since DCNSGA-III plans for its budget. The first is that of the same authors'
    # paper of 2023; the abstract gives none.
    budgets: tuple[int, ...] = (10_000,)
    points: int = 40  # of the true front
    starts: int = 5  # random starts at some of its points
    intervals: int = 10  # between the samples of a phase, as in the paper of 2023


def make_spec(phase: str, effort: ParetoEffort) -> ProblemSpec:
    """Return a phase as in the paper of 2023."""
    return ProblemSpec(name=phase, options={"intervals": effort.intervals})


def choose_looks(budget: int) -> list[int]:
    """Return the evaluations after which a run is looked at: whole generations, evenly spread over their logarithm."""
    count = 1 + round(LOOKS_PER_DECADE * np.log10(budget / FIRST_LOOK))
    generations = np.rint(np.geomspace(1, budget // FIRST_LOOK, max(count, 1))).astype(int)
    return [int(g) * FIRST_LOOK for g in np.unique([*generations, budget // FIRST_LOOK])]


def make_searches(phase: str, front: Sequence[FrontPoint], effort: ParetoEffort) -> dict[Any, list[Computation]]:
    """Return all runs by search and budget; ``make_run`` takes the result of one."""
    spec, found = make_spec(phase, effort), defaultdict(list)
    make = partial(make_computation, spec=spec, function=partial(run_search, spec))
    ends = [[end.value, end.power_W] for end in (front[0], front[-1])]
    for budget, name, run in product(effort.budgets, ALGORITHMS, range(effort.runs)):
        title = f"{phase}-{name.lower()}-{budget}-{run:02d}"
        found[name, budget].append(make(title, ends=ends, algorithm=name, budget=budget, seed=run))
    return found


def run_search(
    spec: ProblemSpec, ends: Sequence[Sequence[float]], algorithm: str, budget: int, seed: int
) -> list[dict[str, Any]]:
    """Return a run as plain data; ``ends`` are criterion and power at those of the front, whose ranges count as 1."""
    problem = spec.load()
    criterion = make_competing_objective(CRITERION, problem)
    scale = Scale([FrontPoint(demanded=value, value=value, power_W=W, violation=0.0, x=()) for value, W in ends])
    objectives = PowerAndCompeting(compile_objective(criterion.drop_demand(problem), threads=1), criterion, scale)
    snapshots = minimize_many(objectives, make_front_algorithm(algorithm), evaluations=choose_looks(budget), seed=seed)
    looks = [{**asdict(snapshot), "X": [], "F": snapshot.F.tolist()} for snapshot in snapshots]
    looks[-1]["X"] = snapshots[-1].X.tolist()
    return looks


def make_run(looks: Sequence[Mapping[str, Any]]) -> Sequence[Snapshot]:
    """Return the looks of a computation's result in the order of their evaluations; only the last one has points."""
    return [Snapshot(**{**look, "X": np.array(look["X"]), "F": np.array(look["F"]).reshape(-1, 2)}) for look in looks]
