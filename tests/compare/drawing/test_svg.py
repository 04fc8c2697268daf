"""Charts as SVG: well-formed, every point drawn, one look per solver over a study; stick figures of all problems."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

import nlp_gait
from compare.drawing.charts import Chart, Series, draw_chart
from compare.drawing.figures import assign_looks, share_looks
from nlp_gait.formulation import Result, sample_signals

NS = "{http://www.w3.org/2000/svg}"
PLACES = {"points": r"M([\d.]+) ([\d.]+)"} | dict.fromkeys(("line", "step"), r"[ML]([\d.]+) ([\d.]+)")
X = np.array([1.0, 10.0, 1000.0, np.inf])


@pytest.mark.parametrize("shape", ["line", "step", "points"])
@pytest.mark.parametrize("log", [(True, True), (True, False), (False, False)])
def test_every_known_point_is_drawn_inside_the_picture(shape: str, log: tuple[bool, bool]) -> None:
    series = [Series(name=name, x=X, y=np.array([1e-4, 0.1, 2.0, 3.0]), shape=shape) for name in ("a <b>", "c")]  # type: ignore[arg-type]
    root = ElementTree.fromstring(draw_chart(Chart(x="cost", y="gap & more", series=series, log=log)).to_svg())
    _, _, width, height = map(float, root.attrib["viewBox"].split())
    texts = [text.text for text in root.iter(f"{NS}text")]
    assert {"a <b>", "c", "cost", "gap & more"} <= set(texts)  # escaped, with a legend
    _, *drawn, _, _ = [path.attrib["d"] for path in root.iter(f"{NS}path")]  # after the grid, before the legend
    paths = ["".join(drawn[:3]), "".join(drawn[3:])] if shape == "points" else drawn  # a marker has its own note
    assert len(paths) == 2
    for path in paths:
        points = [(float(a), float(b)) for a, b in re.findall(PLACES[shape], path)]
        assert len(points) == (5 if shape == "step" else 3)
        assert all(0.0 < x <= width and 0.0 <= y < height for x, y in points)
        assert points[0][0] < points[-1][0] and points[0][1] > points[-1][1]  # up is up


def test_a_chart_without_any_point_has_axes_alone() -> None:
    empty = np.array([])
    ElementTree.fromstring(
        draw_chart(Chart(x="x", y="y", series=[Series(name="a", x=empty, y=empty)], log=(True, True))).to_svg()
    )


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [(3e-5, 20.0, "10⁻⁴ 10⁻² 1"), (0.02, 300.0, "10⁻¹ 10"), (1.1, 6.0, "2 5"), (0.5, 0.6, "0.5 0.55 0.6")],
)
def test_ticks_of_an_axis_are_of_one_kind(low: float, high: float, words: str) -> None:
    series = [Series(name="a", x=np.array([low, high]), y=np.array([0.0, 1.0]))]
    root = ElementTree.fromstring(draw_chart(Chart(x="x", y="", series=series, log=(True, False)), 300.0).to_svg())
    texts = [text.text for text in root.iter(f"{NS}text")]
    assert " ".join(texts[: len(words.split())]) == words


def test_a_named_row_has_its_note_and_a_point_its_own() -> None:
    series = [Series(name="PSO", x=np.array([1.0]), y=np.array([1.0]), shape="points", notes=["run 0: 1 %"])]
    root = ElementTree.fromstring(draw_chart(Chart(x="gap", y="", series=series, rows=[("PSO", "1 %")])).to_svg())
    assert {"PSO", "1 %"} <= {text.text for text in root.iter(f"{NS}text")}
    assert [title.text for title in root.iter(f"{NS}title")] == ["run 0: 1 %"]


def test_a_solver_has_one_look_in_all_figures_of_a_study() -> None:
    alone = assign_looks(["mine", "yours"])["yours"]
    with share_looks(["a", "ipopt", "mine", "other", "yours"]):
        looks = [assign_looks(names)["yours"] for names in (["yours"], ["yours", "mine"], ["ipopt", "a", "yours"])]
    assert looks[0] == looks[1] == looks[2] != alone
    assert assign_looks(["mine", "yours"])["yours"] == alone


SSP = (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)


def drawn(name, x=None, frames_per_s=2.5, **options):
    problem = nlp_gait.load(name, **options)
    point = problem.start_point(np.random.default_rng(0)) if x is None else problem.check_x(x)
    assert problem.display.skeleton is not None
    return problem.display.skeleton(
        sample_signals(Result(problem=problem, x=point), 1.0 / frames_per_s), problem.parameter_values
    )


@pytest.fixture(scope="module")
def nao():
    return drawn("nao-ssp", SSP)


def test_nao_has_its_lengths_and_stands_on_its_soles(nao):
    left = next(limb for limb in nao.limbs if limb.side == "left").points
    lengths = np.linalg.norm(np.diff(left, axis=1), axis=2)
    np.testing.assert_allclose(lengths[:, 1:], [[0.1, 0.1029, 0.04519]] * len(nao.t), atol=1e-9)
    np.testing.assert_allclose(left[:, -1], [[0.06, 0.05, 0.0]] * len(nao.t), atol=1e-9)
    assert [sole.supports.tolist() for sole in nao.soles] == [[True] * 11, [True] + [False] * 9 + [True]]


def test_the_drawn_stair_climber_is_where_its_planner_puts_it():
    problem = nlp_gait.load("stairs-plan")
    x = problem.start_point(np.random.default_rng(0))
    arrays = problem.signals(x).arrays
    swing = next(limb for limb in drawn("stairs-plan", frames_per_s=0.01).limbs if limb.side == "right").points
    np.testing.assert_allclose(swing[:, 0][:, [0, 2]], arrays["hip"], atol=1e-9)
    in_reach = np.abs(arrays["reach"]).max(axis=1) < 0.99  # beyond it the planner's leg does not meet its ankle
    assert in_reach.sum() > 30
    np.testing.assert_allclose(swing[in_reach, 2][:, [0, 2]], arrays["ankle"][in_reach], atol=1e-9)


def test_stairs_are_drawn_under_the_feet():
    stairs = drawn("stairs-plan")
    assert stairs.planar
    rises = np.unique(stairs.ground[:, 1])
    assert len(rises) == 3 and rises[1] == 0.0 and rises[2] == pytest.approx(-rises[0])
    stance = next(limb for limb in stairs.limbs if limb.side == "left").points
    np.testing.assert_allclose(stance[:, 2:, 2], 0.0, atol=1e-12)
