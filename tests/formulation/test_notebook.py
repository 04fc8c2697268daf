"""Display of results in a terminal, a notebook and data frames; time histories describe all their columns."""

from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from compare.study.record import COLUMNS, RunRecord, make_frame
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import Columns, Signals, make_vector_columns
from nlp_gait.formulation.display import Skeleton, Sole, make_rectangle
from tests.backends.toys import corner, toy
from tests.compare.records import record

T = np.array([0.0, 0.5, 1.0])


@pytest.fixture(scope="module")
def solution() -> nlp_gait.Solution:
    return nlp_gait.solve("nao-dsp", starts=1)


@pytest.fixture
def signals() -> Signals:
    return Signals(
        joints=("hip", "<knee>"),
        arrays={"tau": np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]), "zmp": np.zeros((3, 2)), "share": T, "t": T},
        columns={"zmp": make_vector_columns("m", "xy"), "share": Columns(unit="1")},
    )


def test_time_histories_by_name_and_as_a_data_frame(signals: Signals) -> None:
    pandas = pytest.importorskip("pandas")
    np.testing.assert_array_equal(signals["tau <knee>"], [1.0, 3.0, 5.0])
    assert signals["tau"] is signals.arrays["tau"]
    with pytest.raises(UnknownNameError, match="time history 'torque'"):
        signals["torque"]
    frame = signals.to_frame()
    assert isinstance(frame, pandas.DataFrame) and frame.index.name == "t [s]"
    units = {"tau hip": "Nm", "tau <knee>": "Nm", "zmp x": "m", "zmp y": "m", "share": "1"}
    assert list(frame.columns) == list(units) and frame.attrs["units"].items() >= units.items()
    assert frame["tau hip"][0.5] == 2.0
    assert repr(signals) == "<Signals over 1 s in 3 samples: tau, zmp, share, t>"


def test_a_solution_has_its_signals_and_its_gait(solution: nlp_gait.Solution) -> None:
    problem = nlp_gait.load("nao-dsp")
    np.testing.assert_array_equal(solution.signals()["tau"], problem.signals(solution.x)["tau"])
    figure = solution.plot()
    assert figure._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"
    assert "mechanical power [W]" in {text.get_text() for axes in figure.axes for text in axes.texts}


def test_records_and_studies_are_one_line_and_a_frame(tmp_path: Path) -> None:
    run: RunRecord = record("swarm", 0, [(100, None), (500, 10.05)])
    assert repr(run) == "<RunRecord of swarm on walk, run 0: power 10.05 W>"
    pytest.importorskip("pandas")
    frame = make_frame([run, record("colony", 0, [(500, None)], feasible=False)])
    assert tuple(frame.columns) == (*COLUMNS, "x.a", "x.b") and list(frame["feasible"]) == [True, False]
    tasks = tuple(Run(problem=ProblemSpec(name="nao-dsp"), solver="pso", number=k) for k in range(2))
    study = Study(runs=tasks, folder=tmp_path)
    assert repr(study) == f"<Study of nao-dsp by pso: 2 runs, in {str(tmp_path)!r}>"


def walker(zmp: list[tuple[float, float]], half_width: float = 0.05) -> Skeleton:
    """Two soles of 0.2 m length at x = 0 and x = 1; the first bears load at all times, the second at the first instant only."""
    corners = np.stack([make_rectangle(-0.1, 0.1, -half_width, half_width)] * len(zmp))
    always, first = np.ones(len(zmp), bool), np.arange(len(zmp)) == 0
    soles = (
        Sole(side="left", corners=corners, supports=always),
        Sole(side="right", corners=corners + [1.0, 0.0, 0.0], supports=first),
    )
    points = np.array([(x, y, 0.0) for x, y in zmp])
    return Skeleton(t=np.arange(len(zmp)), limbs=(), soles=soles, ground=np.zeros((2, 2)), com=None, zmp=points)


def test_balance_margin_by_hand() -> None:
    """Inside: to the nearest edge; outside: to the edge or the corner, negative; a foot that only touches does not count."""
    margin = walker([(0.5, 0.0), (0.0, 0.0), (0.08, 0.01), (0.3, 0.0), (0.13, 0.09)]).margin()
    np.testing.assert_allclose(margin, [-0.4, 0.05, 0.02, -0.2, -0.05], atol=1e-12)


def test_balance_margin_of_a_planar_model_is_along_its_soles() -> None:
    margin = walker([(0.0, 0.0), (0.09, 0.0), (0.15, 0.0)], half_width=0.0).margin()
    np.testing.assert_allclose(margin, [0.1, 0.01, -0.05])


@pytest.mark.parametrize(
    ("name", "columns", "message"),
    [
        ("mood", {}, "time history 'mood' has no unit"),
        ("zmp", {"zmp": make_vector_columns("m")}, "'zmp' has 2 columns, but 3 are described"),
        ("q", {}, "'q' has 2 columns, but 1 are described"),
    ],
)
def test_what_is_not_described_as_it_is_is_refused(name: str, columns: dict[str, Columns], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Signals(joints=("hip",), arrays={"t": T, name: np.zeros((3, 2))}, columns=columns)


def test_a_problem_without_time_histories_says_so() -> None:
    with pytest.raises(InputError, match="problem 'toy' has no time histories"):
        toy(corner).signals([0.0, 0.0])
