"""The NAO problems against numbers computed elsewhere, and what their options change."""

import json
from pathlib import Path
from typing import Any

import pytest

from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solve import solve
from nlp_gait.formulation import load
from tests.evaluation import evaluated

GOLDEN: dict[str, Any] = json.loads((Path(__file__).parents[2] / "golden" / "nao.json").read_text(encoding="utf-8"))
LABELS = [row["label"] for row in GOLDEN["rows"]]
# The golden numbers are printed with six digits after the point: half a unit of the last one, twice for safety.
GOLDEN_TOLERANCE = 2e-6

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
def test_only_single_support_smooths_its_jump(name: str) -> None:
    assert build_nlp(load(name)).smoothed == (name == "nao-ssp")
