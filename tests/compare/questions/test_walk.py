"""What walking costs: gaits along an axis, their table and figures, and the command."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.cli.questions.output import Output
from compare.cli.simulate import DriveOptions
from compare.drawing.figures import make_figure
from compare.questions.question import Work, find
from compare.questions.sweep import Sweep, SweepPoint, parse_axis
from compare.questions.walk import planners
from compare.questions.walk import walk as module
from compare.questions.walk.cheapest_cycle import Gait
from compare.questions.walk.planners import PLANNERS
from compare.questions.walk.walk import INDEXES, CheapestWalk, FoundGaits, choose_speeds
from compare.report.document import Figure
from compare.study.store import Store
from nlp_gait import load
from nlp_gait.formulation import GaitProblem, Result, load_result
from nlp_gait.interrupts import Interrupted
from tests.robots.crooked import crooked

pytestmark = pytest.mark.usefixtures("coarse_pictures")

# Fewer samples than those of ten intervals: the tests are about what is done with the gaits.
OVER = "speed_m_s=0.04,0.045"
COMMAND = ["walk", "--over", OVER, "--starts", "1", "--intervals", "2"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with stored solves of the gaits."""
    return tmp_path_factory.mktemp("walk")


@pytest.fixture(scope="module")
def question() -> CheapestWalk:
    problem = load("nao-cycle", objective="power", intervals=2)
    return CheapestWalk(problem=problem, axis=parse_axis(OVER), starts=1)


@pytest.fixture
def no_cycle_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw an empty figure instead of the cycle, for tests that look at no figure."""
    monkeypatch.setattr(module, "plot_cycle", lambda _: make_figure())


@pytest.fixture(scope="module")
def gaits(question: CheapestWalk, folder: Path) -> tuple[Gait, ...]:
    """Two gaits, and a point without one."""
    found = find(question, Work(store=Store(folder))).gaits
    lost = replace(found[1].point, at={"speed_m_s": 1.0}, feasible=False, status="in the way: step_length")
    return (*found, replace(found[1], point=lost))


def test_gaits_satisfy_the_axis(gaits: tuple[Gait, ...]) -> None:
    assert [gait.point.feasible for gait in gaits] == [True, True, False]
    for gait in gaits[:2]:
        assert gait.indexes["speed_m_s"] == pytest.approx(gait.at)
        assert gait.indexes["power_W"] == pytest.approx(gait.point.objective)
        assert gait.indexes["cost_of_transport"] == pytest.approx(gait.point.objective / (5.30535 * 9.8 * gait.at))


@pytest.mark.usefixtures("no_cycle_figure")
def test_the_table_and_the_results_can_be_read_back(
    question: CheapestWalk, gaits: tuple[Gait, ...], tmp_path: Path
) -> None:
    question.report(FoundGaits(gaits)).write(tmp_path)
    rows = list(csv.DictReader((tmp_path / "nao-cycle-walk.csv").read_text().splitlines()))
    assert [float(row["at speed_m_s"]) for row in rows] == [0.04, 0.045, 1.0]
    assert rows[2]["feasible"] == "false" and rows[0]["engine_walked_m"] == ""
    assert not (tmp_path / "nao-cycle-speed_m_s-1.json").exists()
    for gait in gaits[:2]:
        result = load_result(tmp_path / f"nao-cycle-speed_m_s-{gait.at:g}.json")
        assert result.problem.value("speed_m_s") == gait.at
        assert result.problem.by_name(result.x) == gait.point.x


def test_figures_are_drawn_with_and_without_a_gait(question: CheapestWalk, gaits: tuple[Gait, ...]) -> None:
    def figures(shown: tuple[Gait, ...]) -> list[str]:
        return [part.name for part in question.report(FoundGaits(shown)).parts if isinstance(part, Figure)]

    assert figures(gaits) == ["nao-cycle-cost", "nao-cycle"]
    infeasible = tuple(replace(gait, point=replace(gait.point, feasible=False)) for gait in gaits)
    assert figures(infeasible) == ["nao-cycle-cost"]


@pytest.mark.usefixtures("no_cycle_figure")
def test_other_planners_take_the_same_footsteps(
    question: CheapestWalk, gaits: tuple[Gait, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Least power is the floor of all; the textbook violates a limit that it does not know, the optimum of torques none."""
    monkeypatch.setattr(planners, "HEIGHT_STEP_M", 0.02)
    options = {"starts": 1, "seed": 0, "steps": 0, "drive": DriveOptions().make(), "work": Work()}
    cart, torque = planners.plan_gaits(question.problem, gaits[1:], PLANNERS, **options)  # type: ignore[arg-type]
    for other in (cart, torque):
        assert other.indexes["energy_J_per_m"] > gaits[1].indexes["energy_J_per_m"]
        assert other.indexes["step_length_m"] == pytest.approx(gaits[1].indexes["step_length_m"], rel=1e-9)
    assert torque.broken == () and any(" Nm" in limit or " m" in limit for limit in cart.broken)
    parts = question.report(FoundGaits(gaits, (cart, torque))).parts
    sentences = [part for part in parts if isinstance(part, str)]
    saved = 100 * (1 - gaits[1].indexes["energy_J_per_m"] / cart.indexes["energy_J_per_m"])
    assert f"Less energy by least-power than by cart-table: {saved:.1f} to {saved:.1f} % in the model." in sentences
    assert any(sentence.startswith("Published: 9.16 to 13.35 %") for sentence in sentences)


def test_a_humanoid_walks_by_the_textbook_on_its_own_legs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command with a made-up gait: the planner uses only its footsteps."""
    pytest.importorskip("urdf_parser_py")
    robot = crooked(tmp_path)
    problem = load("humanoid-cycle", robot=robot, objective="power", intervals=2)
    assert choose_speeds(problem) == "speed_m_s=0.0141:0.141:10"  # NAO's times the root of 0.40452 m / 0.2029 m
    x = (problem.lower + problem.upper) / 2
    x[[problem.variable_index(name) for name in problem.display.durations]] = 0.8, 0.6
    point = SweepPoint(
        at={"speed_m_s": 0.07},
        feasible=True,
        status="",
        objective=1.0,
        x=problem.by_name(x),
        violation=0.0,
        evaluations=1,
        time_s=0.0,
    )
    indexes = {**dict.fromkeys(INDEXES, 1.0), "step_length_m": 0.07 * 1.4}

    def make_gait(cycle: GaitProblem, _: SweepPoint) -> Gait:
        return Gait(point=point, result=Result(problem=cycle.with_values(speed_m_s=0.07), x=x), indexes=indexes)

    monkeypatch.setattr(Sweep, "find", lambda *_: iter([[point]]))
    monkeypatch.setattr(module, "make_gait", make_gait)
    monkeypatch.setattr(module, "sample_finely", lambda result: result.problem.signals(result.x))
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
            "the cart-table walk does not support torso_share=free; leave that option out",
        ),
    ],
)
def test_problems_and_options_without_a_textbook_walk_are_rejected(
    arguments: list[str], sentence: str, tmp_path: Path
) -> None:
    done = CliRunner().invoke(app, ["walk", *arguments, "--out", str(tmp_path)])
    assert done.exit_code == 1 and sentence in done.stderr


def test_an_unknown_planner_is_named(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["walk", "--baseline", "zmp", "--out", str(tmp_path)])
    assert done.exit_code == 1 and "a baseline is one of cart-table, least-torque, got 'zmp'" in done.stderr


def test_the_command_simulates_stored_gaits(gaits: tuple[Gait, ...], folder: Path) -> None:
    pytest.importorskip("mujoco")
    done = CliRunner().invoke(app, [*COMMAND, "--steps", "2", "--out", str(folder), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)["gaits"]
    assert [gait["x"] for gait in found] == [gait.point.x for gait in gaits[:2]]
    for gait in found:
        assert gait["walk"]["steps_done"] == 2 and not gait["walk"]["measurements"]["fallen"]
        assert gait["walk"]["walked_m"] == pytest.approx(gait["walk"]["planned_m"], rel=0.3)
    assert (folder / "nao-cycle-cost.png").exists() and (folder / "nao-cycle.svg").exists()
    page = (folder / "nao-cycle-walk.md").read_text()
    assert "Energy of 2 steps in the engine" in page and "2 gaits were simulated, none fell" in page
    error = found[0]["walk"]["engine_J_per_planned_m"] / found[0]["walk"]["model_J_per_m"] - 1.0
    assert f"{100 * error:+.2f} %" in page


def test_the_engine_simulates_ten_steps_by_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    steps: list[int] = []
    monkeypatch.setattr(Output, "answer", lambda _, question: steps.append(question.steps))
    for options in ([], ["--engine"], ["--engine", "--steps", "3"]):
        assert CliRunner().invoke(app, [*COMMAND, "--out", str(tmp_path), *options]).exit_code == 0
    assert steps == [0, 10, 3]


@pytest.mark.usefixtures("no_cycle_figure")
def test_an_interrupted_walk_keeps_the_gaits(
    gaits: tuple[Gait, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> Iterator[list[SweepPoint]]:
        yield [gaits[0].point]
        raise Interrupted("interrupted after 1 of 2 points", None)

    monkeypatch.setattr(Sweep, "find", interrupted)
    done = CliRunner().invoke(app, [*COMMAND, "--out", str(tmp_path)])
    assert done.exit_code == 130 and "interrupted after 1 of 2 points; the results are in" in done.stderr
    assert len((tmp_path / "nao-cycle-walk.csv").read_text().splitlines()) == 2
