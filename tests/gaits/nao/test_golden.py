"""The NAO problems against numbers computed elsewhere, and what their options change."""

import json
from pathlib import Path
from typing import Any

import pytest

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solve import solve
from nlp_gait.formulation import load
from tests.evaluation import evaluated

GOLDEN: dict[str, Any] = json.loads((Path(__file__).parents[2] / "golden" / "nao.json").read_text(encoding="utf-8"))
LABELS = [row["label"] for row in GOLDEN["rows"]]
# The golden numbers are printed with six digits after the point: half a unit of the last one, twice for safety.
GOLDEN_TOLERANCE = 2e-6
# The size up to which IPOPT's callbacks stay fast without compiling.
MOST_INSTRUCTIONS = 5000

NAMES = ("nao-ssp", "nao-dsp")


@pytest.mark.parametrize("row", GOLDEN["rows"], ids=LABELS)
def test_every_index_of_a_verified_gait(row: dict[str, Any]) -> None:
    got = evaluated(load(row["problem"]), row["x"]).indexes
    assert list(got) == GOLDEN["indexes"]
    assert list(got.values()) == pytest.approx(row["values"], rel=0, abs=GOLDEN_TOLERANCE)


@pytest.mark.parametrize("optimum", GOLDEN["optima"], ids=[row["label"] for row in GOLDEN["optima"]])
def test_ipopt_finds_the_optimum_from_a_random_start(optimum: dict[str, Any]) -> None:
    solution = solve(load(optimum["problem"], **optimum["options"]), starts=1, seed=1)
    assert solution.converged and solution.objective == pytest.approx(optimum["power_W"], rel=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_the_function_of_one_sample_stays_small(name: str) -> None:
    functions = {f.name(): f for f in build_exact_model(load(name)).function.find_functions()}
    assert functions["sample"].n_instructions() < MOST_INSTRUCTIONS


@pytest.mark.parametrize("name", NAMES)
def test_only_single_support_smooths_its_jump(name: str) -> None:
    assert build_nlp(load(name)).smoothed == (name == "nao-ssp")


@pytest.mark.parametrize("name", NAMES)
def test_a_denser_grid_shows_the_same_gait(name: str) -> None:
    x = next(row["x"] for row in GOLDEN["rows"] if row["problem"] == name)
    coarse = load(name).with_values(torque_change_limit_Nm=0.9)
    dense = coarse.dense(100)
    assert dense is not None
    assert dense.value("torque_change_limit_Nm") == 0.9
    few, many = evaluated(coarse, x).indexes, evaluated(dense, x).indexes
    assert many["power_W"] == pytest.approx(few["power_W"], rel=0.02)
    assert many["dbm_y_min_m"] <= few["dbm_y_min_m"] + 1e-12  # the dense grid contains the coarse one
    assert many["torque_change_Nm"] >= few["torque_change_Nm"] - 1e-12  # still over a tenth of the phase
