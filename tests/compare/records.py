"""Records made by hand, whose statistics are known."""

import math
from collections.abc import Mapping, Sequence

from compare.judge import evaluate
from compare.study.perform import make_record
from compare.study.record import History, RunRecord, Times, describe_evaluation
from compare.study.run import Inputs, ProblemSpec, Run, make_inputs
from compare.study.study import Study, run_study
from nlp_gait.formulation import Objective
from nlp_gait.formulation.solution import ActiveConstraint

# A point of nao-dsp that can be played.
DSP_X = {
    "hip_height_m": 0.31,
    "hip_vz_start_m_s": -0.0008,
    "hip_vz_end_m_s": -0.0055,
    "hip_vx_start_m_s": 0.052,
    "hip_vx_end_m_s": 0.001,
    "hip_vy_start_m_s": -0.0367,
    "hip_vy_end_m_s": -0.0424,
    "double_support_time_s": 0.4,
}

POWER = Objective(name="power", unit="W", sense="minimise")


def record(
    solver: str,
    run: int,
    history: Sequence[tuple[int, float | None]],
    *,
    problem: str = "walk",
    feasible: bool = True,
    reported: bool = True,
    status: str = "evaluation budget used",
    claim: float | None = None,
    seconds_per_evaluation: float = 0.01,
    evaluations: dict[str, int] | None = None,
    search: bool = True,
    objective: Objective = POWER,
    active: tuple[ActiveConstraint, ...] = (),
    violated: tuple[str, ...] = (),
    dense_feasible: bool | None = True,
) -> RunRecord:
    """A run of two variables with a history of (evaluations, best objective so far)."""
    value = next((v for _, v in reversed(history) if v is not None), None)
    inputs = Inputs(
        problem={"name": problem, "options": {}, "parameters": {}},
        objective=objective,
        solver=solver,
        seed=run,
        handling="deb" if search else "",
    )
    seconds = tuple(count * seconds_per_evaluation for count, _ in history)
    return RunRecord(
        problem=problem,
        solver=solver,
        run=run,
        inputs=inputs,
        settings={"kind": solver},
        status=status,
        reported_feasible=reported,
        x={"a": 0.0, "b": 1.0},
        reported_objective=value if claim is None else claim,
        objective=math.nan if value is None else value,
        violation=0.0 if feasible else 1.0,
        feasible=feasible,
        metrics={"power_W": math.nan if value is None else value},
        feasible_between_samples=dense_feasible,
        violated=violated,
        counts=evaluations or {"f": history[-1][0]},
        failed_evaluations=0,
        iterations=len(history),
        active_constraints=active,
        history=History(evaluations=tuple(c for c, _ in history), objective=tuple(v for _, v in history)),
        time_s=Times(build=0.5, compile=1.5, solve=seconds[-1], objective=seconds[-1] / 2, history=seconds),
    )


def judged(
    solver: str,
    x: Mapping[str, float],
    *,
    problem: str = "nao-dsp",
    run: int = 0,
    evaluations: int = 10,
    solve_s: float = 0.5,
) -> RunRecord:
    """A run of a search that ends at a point, as the judge finds it."""
    planned = Run(problem=ProblemSpec(name=problem), solver=solver, number=run, evaluations=evaluations)
    found = describe_evaluation(evaluate(planned.problem.load(), x))
    best = found["objective"] if found["feasible"] else None
    return make_record(
        planned,
        make_inputs([planned])[0],
        Times(build=0.1, compile=0.1, solve=solve_s + 0.1 * run, objective=0.3, history=(solve_s + 0.1 * run,)),
        settings={"kind": solver},
        status="evaluation budget used",
        reported_feasible=found["feasible"],
        x=dict(x),
        reported_objective=best,
        **found,
        counts={"f": evaluations},
        iterations=1,
        history=History(evaluations=(evaluations,), objective=(best,)),
    )


def run_once(run: Run) -> RunRecord:
    """The record of one run."""
    (made,) = run_study(Study(runs=(run,)))
    return made


PRICE = ActiveConstraint(
    name="knee <b>torque</b>", side="upper", bound=2.5, unit="Nm", price=-0.125, price_unit="W per Nm"
)


def study() -> list[RunRecord]:
    """Three solvers on one problem; best known 10 W, found by the gradient method.

    swarm: four runs end at 10.05, 10.1, 11, 12; they reach 1 % (10.1) after 300 and 400 evaluations, of 500 each.
    colony: four runs end at 10.005, 10.5, infeasible, 13; one reaches 1 % after 100 and 0.1 % (10.01) after 200.
    newton: two starts end at 10 after 5 f, 5 g, 4 gradients, 4 Jacobians, 3 Hessians; one fails after as many.
    """
    calls = {"f": 5, "g": 5, "gradient": 4, "jacobian": 4, "hessian": 3}
    return [
        record("swarm", 0, [(100, None), (300, 10.1), (500, 10.05)]),
        record("swarm", 1, [(100, 20.0), (400, 10.1), (500, 10.1)]),
        record("swarm", 2, [(100, 15.0), (500, 11.0)]),
        record("swarm", 3, [(100, 15.0), (500, 12.0)]),
        record("colony", 0, [(100, 10.1), (200, 10.005), (500, 10.005)]),
        record("colony", 1, [(100, 12.0), (500, 10.5)]),
        record(
            "colony",
            2,
            [(100, None), (500, None)],
            feasible=False,
            reported=False,
            claim=9.0,
            status="<script>alert(1)</script> | failed",
            violated=("reach[<i>left</i>, 3] by 0.5",),
        ),
        record("colony", 3, [(100, 13.5), (500, 13.0)]),
        record("newton", 0, [(5, 10.0)], evaluations=calls, search=False, active=(PRICE,), seconds_per_evaluation=0.1),
        record("newton", 1, [(5, 10.0)], evaluations=calls, search=False, seconds_per_evaluation=0.1),
        record(
            "newton",
            2,
            [(5, None)],
            evaluations=calls,
            search=False,
            feasible=False,
            reported=True,
            claim=9.5,
            seconds_per_evaluation=0.1,
            status="restoration failed",
            violated=("balance by 0.1 m",),
        ),
    ]
