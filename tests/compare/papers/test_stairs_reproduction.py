"""The reproduction on stairs from end to end: one case, few samples, starts and evaluations."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from compare.papers.stairs import stairs_reproduction as stairs
from compare.papers.stairs.stairs_runs import ALGORITHMS, Effort
from compare.study.record import read_record
from nlp_gait.errors import OutputError

# The paper draws case 2 where it draws one only.
SMALL = Effort(
    cases=(2,),
    plan_starts=1,
    jerk_starts=1,
    hip_starts=1,
    ideal_starts=1,
    runs=2,
    plan_evaluations=200,
    track_evaluations=60,
    track_settings={"iterations": 1, "hessian": "limited-memory"},
    other_stairs=((0.30, 0.10),),
    other_starts=1,
    poses=3,
    plan_intervals=16,
    ideal_intervals=14,
)


def rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text().splitlines()))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """Folder and notes of a finished reproduction."""
    out = tmp_path_factory.mktemp("stairs")
    told: list[str] = []
    stairs.reproduce(out, progress=told.append, effort=SMALL)
    return out, told


def test_progress_is_told_as_often_as_promised(done: tuple[Path, list[str]]) -> None:
    assert len(done[1]) == len(set(done[1])) == SMALL.steps
    assert stairs.STEPS == 3 * (20 + 5 + 6 + 3 + 1 + 2 * 4 * 3 + 5) + 4 * 9 + 4 + 2


def test_the_report_holds_every_table_and_figure(done: tuple[Path, list[str]]) -> None:
    out, _ = done
    report = (out / "report.md").read_text()
    assert "{" not in report and "| nan |" not in report
    figures = re.findall(r"\((\S+)\.png\)", report)
    assert figures == "fig03 fig06-07 fig08-09 fig10-11 fig12 fig13 fig14-20 fig21-27 fig28 fig29".split()
    assert all((out / f"{name}.{kind}").stat().st_size > 1000 for name in figures for kind in ("png", "svg"))
    assert (out / "report.html").read_text().count("<svg") == len(figures)
    assert {path.stem for path in out.glob("*.csv")} == {
        *("table3", "table4", "plans", "fixed-hip", "tracks", "printed-scheme", "ideal", "replay", "jerk"),
        *("other-stairs", "network", "learned", "differences"),
    }
    assert all(rows(path) for path in out.glob("*.csv"))


def test_tables_tell_what_the_records_hold(done: tuple[Path, list[str]]) -> None:
    out, _ = done
    plan = read_record(out / "records" / "plan-2" / "ipopt-0000.json")
    assert plan.claimed and plan.verdict.feasible
    (ipopt,) = [row for row in rows(out / "plans.csv") if row["solver"] == "ipopt"]
    assert float(ipopt["best [J]"]) == plan.verdict.objective
    assert ipopt["all runs [J]"] == "1 of 1 starts, 1 converged" and ipopt["feasible"] == "true"
    parameters = {row["parameter"]: row["case 2"] for row in rows(out / "table3.csv")}
    assert float(parameters["hip_height_m"]) == plan.x["hip_height_m"]

    tracks = {row["solver"]: row for row in rows(out / "tracks.csv")}
    assert list(tracks) == [*ALGORITHMS, "ipopt"]
    for solver, row in tracks.items():
        found = [read_record(path) for path in sorted((out / "records" / "track-2").glob(f"{solver}-0*.json"))]
        assert len(found) == (1 if solver == "ipopt" else 2)
        assert float(row["cost"]) in [record.verdict.objective for record in found]
    gains = {row["quantity"]: float(row["ours 2"]) for row in rows(out / "table4.csv")}
    assert gains["K_p"] in [float(row["K_p [N m/rad]"]) for row in tracks.values()]


def test_other_steps_say_what_the_paper_leaves_out(done: tuple[Path, list[str]]) -> None:
    out, _ = done
    (printed,) = rows(out / "printed-scheme.csv")
    quanta = printed["explicit: quanta of 0.01 s before divergence"]
    assert 0.0 < float(quanta) < 350.0  # the paper's gains diverge within the step of 3.5 s in its own scheme
    (learned,) = rows(out / "learned.csv")
    assert float(learned["cost, network"]) == pytest.approx(float(learned["cost, closed form"]), rel=0.1)
    network = {row["rule and rate"]: row for row in rows(out / "network.csv")}
    assert network["adam"]["poses to 1e-06 m^2"] == "3 of 3"
    (replay,) = rows(out / "replay.csv")
    assert float(replay["with feedback: error at the end [rad]"]) < float(replay["at the end [rad]"])


def test_a_folder_that_cannot_be_written_to_fails_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        stairs.reproduce(tmp_path / "file", progress=print)
