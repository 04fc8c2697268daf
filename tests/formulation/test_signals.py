"""Time histories describe all their columns, or they are refused."""

import numpy as np
import pytest

from nlp_gait.errors import InputError
from nlp_gait.formulation import Columns, Signals, make_vector_columns
from tests.backends.toys import corner, toy

T = np.array([0.0, 0.5, 1.0])


def test_every_column_has_its_name_and_unit() -> None:
    """Joints' units are known; a single column needs no label; time stands first, wherever it is given."""
    signals = Signals(
        joints=("hip", "knee"),
        arrays={"tau": np.ones((3, 2)), "zmp": np.zeros((3, 2)), "share": T, "t": T},
        columns={"zmp": make_vector_columns("m", "xy"), "share": Columns(unit="1")},
    )
    units = {"t": "s", "tau hip": "Nm", "tau knee": "Nm", "zmp x": "m", "zmp y": "m", "share": "1"}
    assert [(name, unit) for name, unit, _ in signals.named_columns()] == list(units.items())
    np.testing.assert_array_equal(list(signals.named_columns())[-1][2], T)


@pytest.mark.parametrize(
    ("name", "columns", "message"),
    [
        ("mood", {}, "time history 'mood' has no unit"),
        ("zmp", {"zmp": make_vector_columns("m")}, "'zmp' has 2 columns, but 3 are described"),
        ("zmp", {"zmp": Columns(unit="m")}, "'zmp' has 2 columns, but 1 are described"),
        ("q", {}, "'q' has 2 columns, but 1 are described"),
    ],
)
def test_what_is_not_described_as_it_is_is_refused(name: str, columns: dict[str, Columns], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Signals(joints=("hip",), arrays={"t": T, name: np.zeros((3, 2))}, columns=columns)


def test_a_problem_without_time_histories_says_so() -> None:
    with pytest.raises(InputError, match="problem 'toy' has no time histories"):
        toy(corner).signals([0.0, 0.0])
