"""The only loop: ask, evaluate, record, tell."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from metaheuristics.array import Array
from metaheuristics.constraint_handling import ConstraintHandling, Deb, Rule
from metaheuristics.errors import SearchError
from metaheuristics.evaluation import Callback, Evaluator
from metaheuristics.interface import Algorithm, BatchObjective, CallingSearch, Ended
from metaheuristics.preparation import (
    check_helpers,
    check_limits,
    check_points,
    check_reasons,
    check_search,
    plain_entropy,
    prepare_start,
    seed_sequence,
)
from metaheuristics.result import Interrupted, Result
from metaheuristics.threads import limit_blas_threads

_DEB = Deb()


def minimize(
    objective: BatchObjective,
    algorithm: Algorithm,
    *,
    evaluations: int = 10_000,
    seed: int | np.random.SeedSequence = 0,
    handling: ConstraintHandling = _DEB,
    target: float | None = None,
    stagnation: int | None = None,
    time_limit_s: float | None = None,
    initial: ArrayLike | None = None,
    callback: Callback | None = None,
) -> Result:
    """Minimise an objective within bounds and constraints.

    The starting points are uniform within the bounds and depend on the seed alone: runs of different algorithms with
    equal seed are paired, and with different populations the first rows agree. Equal arguments give a bit-identical
    result, unless time_limit_s ends the run.

    Args:
        objective: What to minimise; it must not depend on the order of calls.
        algorithm: Settings of the search.
        evaluations: Budget. It is never exceeded: of the last generation only the first rows that fit are evaluated.
        seed: A whole number >= 0, or a SeedSequence, which is not consumed.
        handling: How constraints enter the comparisons within the search. The best point is reported by Deb's rules
            in any case.
        target: Stop once a feasible point has an objective <= target.
        stagnation: Stop after so many generations without a better best.
        time_limit_s: Stop after the first generation that ends beyond this time [s].
        initial: (R, n) points within the bounds that replace the first R starting points, R <= population.
        callback: Called after each generation with X, f and violation, which it may keep but must not change; f and
            violation are infinite where the evaluation failed.

    Returns:
        The result: there is always a best point, and the reasons for ending.

    Raises:
        SearchError: An argument is not allowed, or the objective answers with wrong shapes.
        Interrupted: Ctrl-C after at least one generation; carries the partial result.
    """
    check_limits(algorithm, evaluations, target, stagnation, time_limit_s)
    check_helpers(handling, callback)
    sequence = seed_sequence(seed)
    start = prepare_start(objective, algorithm.population, evaluations, sequence, initial)
    search = algorithm.start(start)
    if not isinstance(search, CallingSearch):
        check_search(search, algorithm)
    evaluate = Evaluator(
        objective, callback, thinned=isinstance(search, CallingSearch)
    )  # which evaluates point by point
    initial_violation: Array | None = None

    def generation(X: Array) -> tuple[Array, Array, Array, Rule]:
        """Evaluate the part of a generation that fits the budget; return points, objectives, violations and the rule."""
        nonlocal initial_violation
        X = X[: evaluations - evaluate.evaluations]
        f, violation = evaluate(X)
        initial_violation = violation if initial_violation is None else initial_violation
        return X, f, violation, handling.rule(evaluate.evaluations / evaluations, initial_violation)

    def limits_reached() -> list[str]:
        violation, f = evaluate.best
        reached = {
            "evaluation budget used": evaluate.evaluations >= evaluations,
            "target reached": target is not None and violation == 0.0 and f <= target,
            f"no better point in {stagnation} generations": evaluate.stagnation >= (stagnation or np.inf),
            "time limit reached": evaluate.elapsed_s >= (time_limit_s or np.inf),
        }
        return [reason for reason, is_reached in reached.items() if is_reached]

    def result(reasons: list[str]) -> Result:
        all_failed = evaluate.failed == evaluate.evaluations
        evaluate.best_x.setflags(write=False)
        return Result(
            x=evaluate.best_x,
            objective=evaluate.best[1],
            violation=evaluate.best[0],
            evaluations=evaluate.evaluations,
            failed_evaluations=evaluate.failed,
            generations=evaluate.generations,
            history=evaluate.history(),
            reasons=tuple(reasons + ["every evaluation failed"] * all_failed),
            time_s=evaluate.elapsed_s,
            objective_time_s=evaluate.objective_time_s,
            algorithm=algorithm,
            handling=handling,
            seed_entropy=plain_entropy(sequence),
            seed_spawn_key=tuple(sequence.spawn_key),
        )

    try:
        with limit_blas_threads():
            if isinstance(search, CallingSearch):
                return result(_run_calling(search, generation, limits_reached))
            while True:
                X, f, violation, rule = generation(check_points(search.ask(), start.lower, start.upper))
                reasons = limits_reached()
                if not reasons:
                    search.tell(X, f, violation, rule)
                    reasons = check_reasons(search.stop())
                if reasons:
                    return result(reasons)
    except KeyboardInterrupt as interrupt:
        if not evaluate.generations:
            raise
        raise Interrupted(result(["interrupted"])) from interrupt


def _run_calling(
    search: CallingSearch,
    generation: Callable[[Array], tuple[Array, Array, Array, Rule]],
    limits_reached: Callable[[], list[str]],
) -> list[str]:
    """Let a function call the objective until it returns or a limit is reached; return the reasons for ending.

    Raises:
        SearchError: it returned without any evaluation.
    """
    reasons: list[str] = []
    called = False

    def evaluate(points: Array) -> tuple[Array, Array, Rule]:
        nonlocal called
        if reasons:  # the function ignored the first `Ended`
            raise Ended
        X, f, violation, rule = generation(points)
        called = True
        reasons.extend(limits_reached())
        if reasons:
            raise Ended
        return f, violation, rule

    try:
        ended = search.run(evaluate)
    except Ended:
        return reasons
    if not called:
        raise SearchError("the function returned without any call of f")
    return reasons or [ended]
