"""Power against a balance margin or speed: the true front, its knees, and how near evolutionary searches come to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from compare.questions.pareto import front as front_module
from compare.questions.pareto.compare import Challenge, Quality, challenge, quality
from compare.questions.pareto.competing import CompetingObjective, competing_objective
from compare.questions.pareto.front import FrontPoint, pareto_front
from compare.questions.pareto.knees import Bends, bends
from compare.questions.pareto.search import Scale, SearchFront, best_of_all, search_fronts
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import describe_problem
from metaheuristics.multi_objective import check_budgets, front_algorithm
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.progress import Progress, ignore_progress


@dataclass(frozen=True, kw_only=True, eq=False)
class ParetoStudy:
    """Result of a study.

    Attributes:
        problem: with its demand on the criterion dropped.
        criterion: beside power.
        front: the true one, with the points that were solved to answer the searches.
        bends: its knees.
        searches: fronts of all runs.
        qualities: one row for each algorithm and budget.
        challenge: None without searches.
    """

    problem: GaitProblem
    criterion: CompetingObjective
    front: tuple[FrontPoint, ...]
    bends: Bends
    searches: tuple[SearchFront, ...]
    qualities: tuple[Quality, ...]
    challenge: Challenge | None

    def to_json(self) -> dict[str, Any]:
        """Plain data; the points that searches found stay in their files."""
        answers = {} if self.challenge is None else asdict(self.challenge)
        return {
            **describe_problem(self.problem),
            "criterion": {"name": self.criterion.name, "unit": self.criterion.unit},
            "front": [asdict(point) for point in self.front],
            "knees": asdict(self.bends),
            "searches": [asdict(row) for row in self.qualities],
            "challenge": {key: value for key, value in answers.items() if key != "front"} or None,
        }


def pareto_study(
    problem: GaitProblem,
    name: str,
    *,
    points: int,
    starts: int,
    searches: Mapping[str, Sequence[int]],
    runs: int,
    seed: int,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> ParetoStudy:
    """The front, and the searches beside it; stored results are loaded.

    Args:
        problem: of the front.
        name: of the criterion beside power.
        points: of the front.
        starts: random starts at some of its points.
        searches: budgets by algorithm; none for the front alone.
        runs: of each algorithm.
        seed: of starts and of the first run.
        store: of finished results; None stores nothing.
        progress: told what is done.

    Raises:
        UnknownNameError: an unknown criterion.
        InputError: the problem trades nothing, or its front cannot be found.
        SearchError: an unknown algorithm, a budget that is not allowed, or pymoo is not installed.
    """
    beside = competing_objective(name, problem)
    for algorithm, budgets in searches.items():
        check_budgets(front_algorithm(algorithm), budgets)  # before the front, which takes long
    free = beside.freed(problem)
    store = store or Store()
    asked = {"searches": {a: list(b) for a, b in searches.items()}, "runs": runs}
    store.report_changes("pareto", free, objectives=[name], points=points, starts=starts, seed=seed, **asked)
    solver = store_runs(store)
    compute = partial(store.compute, code=[front_module], progress=progress)
    identity = {**fingerprint(free), "criterion": name}

    inputs = {**identity, "points": points, "starts": starts, "seed": seed}
    solved = partial(
        pareto_front, problem, beside, points=points, starts=starts, seed=seed, solver=solver, progress=progress
    )
    stored = compute(f"front-{name}", inputs, lambda: [asdict(point) for point in solved()])
    front = [decode(FrontPoint, point) for point in stored]
    found: list[SearchFront] = []
    outcome = None
    if searches:
        found = search_fronts(
            free, beside, Scale(front), store, searches=searches, runs=runs, seed=seed, progress=progress
        )
        best = best_of_all(found)
        answered = partial(challenge, free, beside, front, best, solver, progress)
        outcome = decode(Challenge, compute(f"challenge-{name}", {**inputs, **asked}, lambda: asdict(answered())))
        front = list(outcome.front)
    return ParetoStudy(
        problem=free,
        criterion=beside,
        front=tuple(front),
        bends=bends(front),
        searches=tuple(found),
        qualities=tuple(quality(front, found)),
        challenge=outcome,
    )


def parse_searches(texts: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Budgets by algorithm from ``NSGA2=10000,100000``; the text ``none`` alone for no search.

    Raises:
        InputError: anything else.
    """
    if list(texts) == ["none"]:
        return {}
    searches: dict[str, tuple[int, ...]] = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            searches[name.strip()] = tuple(int(number) for number in numbers.split(","))
        except ValueError:
            raise InputError(f"--search takes NAME=BUDGET,BUDGET or none, got {text!r}") from None
    return searches
