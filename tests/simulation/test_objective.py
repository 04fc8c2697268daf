"""The engine as objective: scores are the numbers of a simulation, and searches run on it."""

import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from compare.questions.question import Work, find
from compare.questions.sweep import Axis
from compare.study.memo import Memo
from metaheuristics import RandomSearch, minimize
from nlp_gait.formulation import Result

pytest.importorskip("mujoco")
pytestmark = pytest.mark.slow  # each gait is simulated

from compare.questions.tune import CONTINUED, MODEL, TUNED, Tune  # noqa: E402
from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.measurements import measure_walk  # noqa: E402
from nlp_gait.simulation.objective import Arena, EngineObjective  # noqa: E402
from nlp_gait.simulation.plan import make_plan  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, Push, SimulationRun  # noqa: E402

STEPS = 2


@pytest.fixture(scope="module")
def arena(cycle: Result) -> Arena:
    return Arena(cycle.problem, steps=STEPS)


def test_a_score_is_the_energy_of_a_simulation(cycle: Result, arena: Arena) -> None:
    score, plan = arena.score(cycle.x), make_plan(cycle, STEPS)
    walk = measure_walk(plan, SimulationRun(plan, settle_s=0.3).finish(), Drive(), STEPS)
    assert score.J_per_m == walk.engine_J_per_m and score.slip_m == walk.measurements.slip_m
    assert (score.violation, score.fell_at_s) == (0.0, None) and walk.walked_m is not None
    assert score.off == pytest.approx(
        math.hypot(1.0 - walk.walked_m / walk.planned_m, (walk.drift_m or 0.0) / walk.planned_m)
    )
    off, slip = replace(score, off=0.116, slip_m=0.02).list_violations()
    assert off == "its end is 11.6 % of the distance away from the planned one" and slip == "a foot slips by 20.0 mm"
    assert not score.list_violations()


def test_a_fall_is_worse_than_anything_else_and_worst_if_early(cycle: Result) -> None:
    pushes = [Push(impulse_Ns=(0.0, 10.0), start_s=start) for start in (0.1, 0.8)]
    early, late = (Arena(cycle.problem, steps=STEPS, conditions=Conditions(push=p)).score(cycle.x) for p in pushes)
    assert early.fell_at_s is not None and late.fell_at_s is not None and early.fell_at_s < late.fell_at_s
    assert 2.0 > early.violation > late.violation > 1.0


def test_searches_run_on_it_with_any_number_of_threads(cycle: Result, arena: Arena) -> None:
    objective = EngineObjective([arena], threads=2)
    result = minimize(objective, RandomSearch(population=3), evaluations=3, seed=0, initial=[cycle.x])
    assert result.x == pytest.approx(cycle.x) and result.objective == arena.score(cycle.x).J_per_m
    X = np.array([cycle.x, cycle.problem.start_point(np.random.default_rng(1))])
    f, violation = objective(X)
    scores = [arena.score(x) for x in X]
    assert f.tolist() == [s.J_per_m for s in scores] and violation.tolist() == [s.violation for s in scores]


def test_rows_are_judged_on_other_floors_and_found_again(cycle: Result, tmp_path: Path) -> None:
    limits = [Axis(name="ssp_dbm_y_mean_limit_m", values=(0.01,))]
    effort = {"simulations": 4, "runs": 1, "algorithms": ("random",), "starts": 1, "steps": 1, "judged_steps": 1}
    question = Tune(problem=cycle.problem, limits=limits, **effort)
    rows = find(question, Work(memo=Memo(tmp_path)))
    assert [row.simulations for row in rows] == [1, 1, 4, 4]
    assert [row.solver for row in rows] == [MODEL, TUNED, CONTINUED, "RANDOM"]
    model, tuned, *_ = rows
    assert model.here.fell_at_s is None and len(model.elsewhere) == 3
    assert model.rows_violated == 0 < tuned.rows_violated  # a smaller margin than the problem's
    assert tuned.model_J_per_m < model.model_J_per_m
    answer = question.report(find(question, Work(memo=Memo(tmp_path))))  # from the memo
    assert answer.data["rows"] == [asdict(row) for row in rows]
    assert answer.headline[0].startswith("IPOPT's optimum of the model needs 1")
    assert {"tune.svg", "tune.json", "tune-rows.csv"} <= {path.name for path in answer.write(tmp_path)}
