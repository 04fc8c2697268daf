"""The quick reproduction on stairs: one case, few samples, starts and evaluations."""

from __future__ import annotations

import pytest

from compare.papers.stairs.stairs_reproduction import REPRODUCTION
from compare.papers.stairs.stairs_runs import ALGORITHMS
from compare.study.record import read_record
from tests.compare.papers.finished import Finished, check_report, reproduce

# One choice of each kind, and those that claims name; the others are more of the same.
LESS = {
    "plan_choices": ("ratio", "times"),
    "choices": ("ours", "jerk", "printed"),
    "instants": ("ours",),
    "runs": 1,
    "plan_starts": 1,
    "jerk_starts": 1,
    "plan_evaluations": 50,
    "track_evaluations": 50,
    "poses": 3,
    "printed_poses": 2,
    "plan_intervals": 12,
    "plan_settings": {"iterations": 5, "compiled": False},
}

DRAWN = ("fig06-07", "fig13", "fig28")  # sticks, the network, the rollout


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    return reproduce("stairs", tmp_path_factory.mktemp("stairs"), coarse=True, drawn=DRAWN, compiled=False, **LESS)


def test_the_report_contains_every_table_and_figure(finished: Finished) -> None:
    assert len(set(finished.progress)) == len(finished.progress)
    check_report(
        finished,
        "fig03 fig06-07 fig08-09 fig10-11 fig12 fig13 fig14-20 fig21-27 fig28 fig29",
        "table3 table4 plans plan-choices steps tracks printed-gains ideal other-stairs network "
        "learned claims differences choices instants",
    )


def test_the_full_effort_counts_all_its_steps() -> None:
    plans = 3 * 8 + 3 * (2 + 5 + 1 + 3)
    assert REPRODUCTION.full.steps == 3 * (20 + 20 + 6 + 3 + 1 + (3 * 5 + 12) * 3 + 4 + 3 + 6) + 4 * 8 + 3 + 2 + plans


def test_tables_agree_with_the_records(finished: Finished) -> None:
    records, rows = finished.folder / "records", finished.rows
    plan = read_record(records / "plan-2" / "ipopt-0000.json")
    jerk, energy = [row for row in rows("plans") if row["solver"] == "ipopt"]
    assert jerk["minimised"] == "jerk [rad/s^3]" and float(energy["best"]) == plan.verdict.objective
    converged = int(plan.claimed)
    assert energy["all runs"] == f"{converged} of 1 starts, {converged} converged"
    assert energy["feasible"] == str(plan.verdict.feasible).lower()
    parameters = {row["parameter"]: row["least energy 2"] for row in rows("table3")}
    assert float(parameters["hip_height_m"]) == plan.x["hip_height_m"]

    tracks = {row["solver"]: row for row in rows("tracks")}
    assert list(tracks) == [*ALGORITHMS]
    for solver, row in tracks.items():
        found = [read_record(path) for path in sorted((records / "track-2").glob(f"{solver}-0*.json"))]
        assert len(found) == 1
        assert float(row["objective"]) in [record.verdict.objective for record in found]
    gains = {row["quantity"]: float(row["least energy 2"]) for row in rows("table4")}
    assert gains["K_p"] in [float(row["K_p [N m/rad]"]) for row in tracks.values()]


def test_other_results_show_what_the_paper_leaves_out(finished: Finished) -> None:
    rows = finished.rows
    (printed,) = rows("printed-gains")
    assert float(printed["the same, gravity compensated"]) < float(printed["plan of least energy"])
    (learned,) = rows("learned")
    assert float(learned["cost, network"]) == pytest.approx(float(learned["cost, closed form"]), rel=0.1)
    network = {row["rule and rate"]: row for row in rows("network")}
    assert network["adam"]["poses to 1e-06 m^2"] == "3 of 3"
