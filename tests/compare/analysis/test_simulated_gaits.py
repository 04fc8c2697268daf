"""Does the engine rank gaits as the model does: ranks, errors and correlation of numbers that are known."""

from __future__ import annotations

import pytest

from compare.analysis.simulated_gaits import (
    GAIT_HEADER,
    compute_agreement,
    describe_drive,
    group_by_problem,
    make_engine_rows,
    measure_agreement,
)
from compare.study.simulations import SimulatedGait
from nlp_gait.simulation.drive import DRIVES


def played(
    solver: str, model: float, engine: float | None, *, walked_share: float | None = None, problem: str = "nao-dsp"
) -> SimulatedGait:
    return SimulatedGait(
        problem=problem,
        solver=solver,
        run=0,
        drive=DRIVES["feed-forward"],
        steps=None if walked_share is None else 10,
        unit="W" if walked_share is None else "J/m",
        model=model,
        engine=engine,
        fell_at_s=1.25 if engine is None else None,
        walked_share=walked_share,
    )


def test_errors_and_correlation_leave_out_what_fell() -> None:
    model, engine = [1.0, 2.0, 4.0, 3.0, 9.0], [1.1, 2.0, 3.0, 3.3, None]
    found = compute_agreement(model, engine)
    assert (found.gaits, found.fallen) == (5, 1)
    assert found.mean_error == pytest.approx((0.1 + 0.0 + 0.25 + 0.1) / 4)
    assert found.largest_error == pytest.approx(0.25)
    # Without ties: 1 - 6 sum d^2 / (n (n^2 - 1)), with the ranks 1 2 4 3 and 1 2 3 4.
    assert found.spearman == pytest.approx(1.0 - 6.0 * 2.0 / (4.0 * 15.0))
    assert "1 fell and has no rank" in found.describe() and "0.800 over 4 gaits" in found.describe()
    assert found.spread == pytest.approx(3.0) and found.error_spread == pytest.approx(0.35)
    assert (
        "energies spread by 300.00 % in the model, errors by 35.00 %" in found.describe()
        and "not sure" not in found.describe()
    )


def test_gaits_nearer_to_each_other_than_the_model_is_right_have_no_sure_order() -> None:
    found = compute_agreement([1.0, 1.001, 1.002], [1.01, 1.005, 1.0])
    assert found.spearman == pytest.approx(-1.0) and found.describe().endswith("their order is not certain.")


@pytest.mark.parametrize(
    ("model", "engine", "why"),
    [
        ([1.0, 2.0], [1.0, 2.0], "fewer than 3"),
        ([1.0, 1.000001, 1.000002], [1.0, 2.0, 3.0], "all gaits are equal"),  # one number, as it is printed
        ([1.0, 2.0, 3.0], [None, None, None], "3 fell and have no rank"),
    ],
)
def test_no_correlation_is_made_up(model: list[float], engine: list[float | None], why: str) -> None:
    found = compute_agreement(model, engine)
    assert found.spearman is None and why in found.describe()


def test_ranks_are_those_of_the_printed_numbers() -> None:
    plays = [played("pso", 0.53151, 0.52), played("ipopt", 0.529301, 0.5179), played("aco", 0.529304, 0.51795)]
    plays.append(played("ga", 0.6, None))
    rows = make_engine_rows(plays)
    assert [row[0] for row in rows] == ["ipopt", "aco", "pso", "ga"]
    assert [row[4] for row in rows] == ["1", "1", "3", "4"]
    assert [row[5] for row in rows] == ["1", "2", "3", "-"]
    assert rows[0][1:4] == ("0.5293 W", "0.5179 W", "-2.15 %")
    assert rows[3][2:] == ("-", "-", "4", "-", "falls at 1.25 s")


def test_a_table_fits_a_terminal() -> None:
    rows = [*make_engine_rows([played("pso+ipopt", 19.15, 19.61, walked_share=0.997)]), GAIT_HEADER]
    widths = [max(len(row[i]) for row in rows) for i in range(len(GAIT_HEADER))]
    assert sum(widths) + 3 * len(widths) + 1 <= 80
    assert rows[0][-1] == "walks 99.7 %"


def test_problems_are_distinguished() -> None:
    plays = [played("a", 1.0, 1.0), played("a", 2.0, 2.2, problem="nao-ssp"), played("b", 2.0, 2.0)]
    assert {name: len(own) for name, own in group_by_problem(plays).items()} == {"nao-dsp": 2, "nao-ssp": 1}
    assert measure_agreement(group_by_problem(plays)["nao-ssp"]).largest_error == pytest.approx(0.1)


def test_a_drive_has_words() -> None:
    assert describe_drive(DRIVES["held"]) == "held set-points every 40 ms, nothing fed forward"
    assert describe_drive(DRIVES["feed-forward"]) == "linear set-points every 10 ms, velocity and torque fed forward"
