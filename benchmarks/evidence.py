"""Time to check 10,000 records: ``python -m benchmarks.evidence [PROBLEM]``. Required: at most 2 s."""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from compare.study.evidence import check_records
from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

RECORDS, EVALUATIONS = 10_000, 100


def make_records(name: str) -> list[RunRecord]:
    """Return honest records at random points, a fifth of them at feasible ones near each other."""
    problem = ProblemSpec(name=name).load()
    rng = np.random.default_rng(0)
    points = problem.lower + (problem.upper - problem.lower) * rng.random((RECORDS, len(problem.names)))
    costs, violations = compile_objective(problem)(points)
    indexes = build_exact_model(problem).at(points[0], problem.p).indexes
    first = make_record(Task(problem=ProblemSpec(name=name), solver="pso", stop=Stop(evaluations=EVALUATIONS)))
    records = []
    for run, (x, cost, violation) in enumerate(zip(points, costs, violations, strict=True)):
        value, feasible = problem.objective.sign * float(cost), bool(violation <= FEASIBILITY_TOLERANCE)
        verdict = replace(Verdict.make_plain(value, float(violation), feasible), indexes=indexes)
        best = value if violation == 0.0 else None
        seconds = (1.0 + run,)
        records.append(
            replace(
                first,
                run=run,
                seed=run,
                definition={**first.definition, "seed": run},
                claimed=violation == 0.0,
                claimed_objective=value,
                claimed_violation=float(violation),
                x=problem.by_name(x),
                verdict=verdict,
                history=History(evaluations=(EVALUATIONS,), objective=(best,)),
                time_s=Times.make_unknown(1.0 + run, seconds),
            )
        )
    return records


def make_record(task: Task) -> RunRecord:
    """Return a record without a point."""
    return replace(
        RunRecord.make_failed(task, "not run"), evaluations={"f": EVALUATIONS}, status="evaluation budget used"
    )


def main() -> None:
    """Print the time of the first call, which may compile the problem, and of the second."""
    name = sys.argv[1] if len(sys.argv) > 1 else "nao-ssp"
    records = make_records(name)
    for what in ("first", "second"):
        began, used = time.perf_counter(), time.process_time()
        evidence = check_records(records, between_samples="none")
        took, used = time.perf_counter() - began, time.process_time() - used
        print(
            f"{name}, {what} call: {len(evidence.records)} of {len(records)} kept, {took:.2f} s, {used:.2f} s of processor time"
        )
        for exclusion in evidence.excluded[:3]:
            print(exclusion.sentence)


if __name__ == "__main__":
    main()
