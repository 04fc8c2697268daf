"""The question of what walking costs: gaits along an axis, their table and pictures, and the command."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.cli.simulation_options import DriveOptions
from compare.questions.sweep.study import SweepPoint, parse_axis
from compare.questions.walk.planners import PLANNERS, rivals
from compare.questions.walk.report import INDEXES, walk_answer
from compare.questions.walk.study import Gait, default_speeds, optimal_gaits
from compare.report.document import Figure
from compare.study.task import ProblemSpec
from nlp_gait.formulation import load_result
from nlp_gait.interrupts import Interrupted
from tests.robots.crooked import crooked

# Fewer samples than those of ten intervals: what is tested here is what is done with the gaits.
SPEC = ProblemSpec(name="nao-cycle", options={"objective": "power", "intervals": 2})
AXIS = parse_axis("speed_m_s=0.04,0.045")


@pytest.fixture(scope="module")
def gaits() -> list[Gait]:
    """Two gaits, and one that was not found."""
    found = optimal_gaits(SPEC, AXIS, starts=1, seed=0)
    lost = replace(found[1].found, at={"speed_m_s": 1.0}, feasible=False, status="in the way: step_length")
    return [*found, replace(found[1], found=lost)]


def test_gaits_hold_what_they_were_asked_for(gaits: list[Gait]) -> None:
    assert [gait.found.feasible for gait in gaits] == [True, True, False]
    for gait in gaits[:2]:
        assert gait.indexes["speed_m_s"] == pytest.approx(gait.at)
        assert gait.indexes["power_W"] == pytest.approx(gait.found.objective)
        assert gait.indexes["cost_of_transport"] == pytest.approx(gait.found.objective / (5.30535 * 9.8 * gait.at))


def test_the_table_and_the_results_can_be_read_back(gaits: list[Gait], tmp_path: Path) -> None:
    walk_answer(SPEC, gaits).write(tmp_path)
    rows = list(csv.DictReader((tmp_path / "nao-cycle-walk.csv").read_text().splitlines()))
    assert [float(row["at speed_m_s"]) for row in rows] == [0.04, 0.045, 1.0]
    assert rows[2]["feasible"] == "false" and rows[0]["engine_walked_m"] == ""
    assert not (tmp_path / "nao-cycle-speed_m_s-1.json").exists()
    for gait in gaits[:2]:
        result = load_result(tmp_path / f"nao-cycle-speed_m_s-{gait.at:g}.json")
        assert result.problem.value("speed_m_s") == gait.at
        assert result.problem.by_name(result.x) == gait.found.x


def test_pictures_are_drawn_with_and_without_a_gait(gaits: list[Gait]) -> None:
    def pictures(shown: list[Gait]) -> list[str]:
        parts = walk_answer(SPEC, shown).parts
        return [part.name for part in parts if isinstance(part, Figure)]

    assert pictures(gaits) == ["nao-cycle-cost", "nao-cycle"]
    assert pictures([replace(gait, found=replace(gait.found, feasible=False)) for gait in gaits]) == ["nao-cycle-cost"]


def test_other_planners_take_the_same_footsteps(gaits: list[Gait]) -> None:
    """Least power is the floor of all; the textbook breaks a limit it does not know, the optimum of torques none."""
    drive = DriveOptions().make()
    cart, torque = rivals(SPEC, gaits[1:], PLANNERS, starts=1, seed=0, steps=0, drive=drive)
    for rival in (cart, torque):
        assert rival.indexes["energy_J_per_m"] > gaits[1].indexes["energy_J_per_m"]
        assert rival.indexes["step_length_m"] == pytest.approx(gaits[1].indexes["step_length_m"], rel=1e-9)
    assert torque.broken == () and any(" Nm" in limit or " m" in limit for limit in cart.broken)
    parts = walk_answer(SPEC, gaits, [cart, torque]).parts
    said = [part for part in parts if isinstance(part, str)]
    saved = 100 * (1 - gaits[1].indexes["energy_J_per_m"] / cart.indexes["energy_J_per_m"])
    assert f"Less energy by least-power than by cart-table: {saved:.1f} to {saved:.1f} % in the model." in said
    assert any(sentence.startswith("Published: 9.16 to 13.35 %") for sentence in said)


@pytest.mark.slow
def test_a_humanoid_walks_by_the_textbook_on_its_own_legs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command with a gait that no solver found: footsteps are all that is taken of it."""
    pytest.importorskip("urdf_parser_py", reason="extra urdf is not installed")
    from compare.questions.walk import planners, study

    robot = crooked(tmp_path)
    spec = ProblemSpec(name="humanoid-cycle", options={"robot": robot, "objective": "power", "intervals": 2})
    problem = spec.load()
    assert default_speeds(problem) == "speed_m_s=0.0141:0.141:10"  # NAO's times the root of 0.40452 m / 0.2029 m
    x = (problem.lower + problem.upper) / 2
    x[[problem.variable_index(name) for name in problem.display.durations]] = 0.8, 0.6
    found = SweepPoint(
        at={"speed_m_s": 0.07},
        feasible=True,
        status="",
        objective=1.0,
        x=problem.by_name(x),
        violation=0.0,
        evaluations=1,
        time_s=0.0,
    )
    gait = Gait(found=found, indexes={**dict.fromkeys(INDEXES, 1.0), "step_length_m": 0.07 * 1.4})
    monkeypatch.setattr(study, "optimal_gaits", lambda *_, **__: [gait])
    monkeypatch.setattr(planners, "HEIGHT_STEP_M", 0.1)  # one height
    arguments = ["walk", "humanoid-cycle", "--robot", robot, "--intervals", "2", "--baseline", "cart-table"]
    arguments += ["--set", "hip_z_lift_off_m.upper=0.39"]
    done = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    (cart,) = json.loads((tmp_path / "humanoid-cycle-walk.json").read_text())["planners"]
    assert cart["indexes"]["step_length_m"] == pytest.approx(0.07 * 1.4) and cart["indexes"]["power_W"] > 0.0
    assert cart["note"] == "hip 390 mm high" and any(limit.startswith("dsp_dbm_y_mean by") for limit in cart["broken"])
    assert (tmp_path / "humanoid-cycle.png").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nao-ssp"], "walk takes a walking cycle, nao-cycle or humanoid-cycle; got 'nao-ssp'"),
        (
            ["--baseline", "cart-table", "--option", "torso_share=free"],
            "the cart-table walk is not judged with torso_share=free; leave that option out",
        ),
    ],
)
def test_what_has_no_textbook_walk_is_refused(arguments: list[str], sentence: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["walk", *arguments, "--out", str(tmp_path)])
    assert done.exit_code == 1 and sentence in done.stderr


def test_an_unknown_planner_is_named(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["walk", "--baseline", "zmp", "--out", str(tmp_path)])
    assert done.exit_code == 1 and "a baseline is one of cart-table, least-torque, got 'zmp'" in done.stderr


def test_the_command_walks(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    arguments = ["walk", "--over", "speed_m_s=0.08", "--starts", "1", "--intervals", "2", "--steps", "2"]
    done = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    (gait,) = json.loads(done.stdout)["gaits"]
    assert gait["walk"]["steps_done"] == 2 and not gait["walk"]["measurements"]["fallen"]
    assert gait["walk"]["walked_m"] == pytest.approx(gait["walk"]["planned_m"], rel=0.3)
    assert (tmp_path / "nao-cycle-cost.png").exists() and (tmp_path / "nao-cycle.svg").exists()
    page = (tmp_path / "nao-cycle-walk.md").read_text()
    assert "Energy of 2 steps in the physics engine" in page and "1 gait was simulated, none fell" in page
    error = gait["walk"]["engine_J_per_planned_m"] / gait["walk"]["model_J_per_m"] - 1.0
    assert f"{100 * error:+.2f} %" in page


def test_the_engine_plays_ten_steps_unless_it_is_told_otherwise(
    gaits: list[Gait], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    from compare.questions.walk import study as question

    played: list[int] = []

    def fake(spec: ProblemSpec, gait: Gait, steps: int, *_: object) -> Gait:
        played.append(steps)
        return gait

    monkeypatch.setattr(question, "optimal_gaits", lambda *_, **__: list(gaits[:1]))
    monkeypatch.setattr(question, "played", fake)
    for options in (["--engine"], ["--engine", "--steps", "3"]):
        assert CliRunner().invoke(app, ["walk", "--intervals", "2", "--out", str(tmp_path), *options]).exit_code == 0
    assert played == [10, 3]


def test_an_interrupted_walk_keeps_what_was_found(
    gaits: list[Gait], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from compare.questions.walk import study as question

    def interrupted(*_: object, **__: object) -> list[Gait]:
        raise Interrupted("interrupted after 1 of 2 points", gaits[:1])

    monkeypatch.setattr(question, "optimal_gaits", interrupted)
    done = CliRunner().invoke(app, ["walk", "--intervals", "2", "--out", str(tmp_path)])
    assert done.exit_code == 130 and "interrupted after 1 of 2 points; what was found is in" in done.stderr
    assert len((tmp_path / "nao-cycle-walk.csv").read_text().splitlines()) == 2
