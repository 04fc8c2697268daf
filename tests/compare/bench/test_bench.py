"""The leaderboard: places follow from expected running times, and a new algorithm gets its own."""

import math
from dataclasses import replace
from itertools import product

import pytest

from compare.analysis.comparison import count_wins
from compare.bench.leaderboard import (
    BASELINE,
    RUNS,
    TABLE,
    list_baselines,
    load_baseline,
    rank_solvers,
)
from nlp_gait import gaitbench


def test_everything_of_the_small_suite_is_shipped() -> None:
    """Twelve solvers, fifteen runs each with the seeds of the rules, the same budget; the table is below 300 kB."""
    assert set(gaitbench.list_instances("small")) <= set(list_baselines())
    assert TABLE.stat().st_size <= 300e3
    for id in list_baselines():
        records = load_baseline(id)
        assert sorted((r.solver, r.run) for r in records) == sorted(product(BASELINE, range(RUNS)))
        assert all(r.seed == r.run and r.problem == id for r in records)
        assert {r.counts["f"] for r in records if r.inputs.handling} <= {*range(9_900, 10_001)}


def test_no_shipped_run_is_better_than_the_best_known() -> None:
    """By more than a judge's tolerance of 1e-6 can buy."""
    for id in list_baselines():
        instance, records = gaitbench.load(id), load_baseline(id)
        sign = instance.gait_problem.objective.sign
        best = min((sign * r.objective for r in records if r.feasible), default=math.inf)
        assert best >= instance.best_known - 1e-5 * abs(instance.best_known), id


def test_places_follow_from_expected_running_times() -> None:
    """A solver that has the best one's runs at half of the cost takes the first place; its twin shares all ranks."""
    ids = ("walk12-w015", "ssp-v5")
    board = rank_solvers(ids)
    assert {standing.solver for standing in board.standings} == set(BASELINE)
    ranks = [standing.mean_rank for standing in board.standings]
    assert ranks == sorted(ranks) and sum(ranks) == pytest.approx(len(ranks) * (len(ranks) + 1) / 2)
    first = board.standings[0].solver
    records = [record for id in ids for record in load_baseline(id) if record.solver == first]
    faster = [
        replace(
            record,
            solver="faster",
            counts={kind: count // 2 for kind, count in record.counts.items()},
            history=replace(record.history, evaluations=tuple(e // 2 for e in record.history.evaluations)),
        )
        for record in records
    ]
    twin = [replace(record, solver="twin") for record in records]
    assert rank_solvers(ids, faster).place("faster") == 1
    with_twin = {s.solver: s for s in rank_solvers(ids, twin).standings}
    assert with_twin["twin"].mean_rank == with_twin[first].mean_rank
    assert with_twin["twin"].solved == with_twin[first].solved
    duel = next(d for d in count_wins(rank_solvers(ids, twin).comparisons, "twin") if d.other == first)
    assert (duel.wins, duel.losses, duel.ties) == (0, 0, len(ids))


def test_a_solver_that_finds_nothing_is_last() -> None:
    """Runs without a feasible point: no target reached, and beaten by everybody on every instance."""
    ids = ("walk12-w015",)
    failed = [
        replace(
            record,
            solver="nothing",
            objective=math.nan,
            violation=1.0,
            feasible=False,
        )
        for id in ids
        for record in load_baseline(id)
        if record.solver == "random"
    ]
    board = rank_solvers(ids, failed)
    last = board.standings[-1]
    assert (last.solver, last.solved, last.feasible, set(last.reached)) == ("nothing", 0.0, 0.0, {0})
    assert all(duel.wins == 0 for duel in count_wins(board.comparisons, "nothing"))


def test_drawn_instances_have_a_baseline() -> None:
    drawn = list_baselines(drawn=True)
    assert len(drawn) >= 54 and len({id.split(":")[1] for id in drawn}) >= 9
    chosen = [id for id in drawn if id.startswith(("gb2:walk12", "gb2:dsp-timed"))]
    board = rank_solvers(chosen)
    assert all({len(solver.records) for solver in c.solvers} == {3} for c in board.comparisons)
    assert all(c.best is not None and c.better is None for c in board.comparisons)
