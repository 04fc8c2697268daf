"""Sizes that are allowed one by one but whose product is too large: refused by name before memory or time is spent."""

import pytest

from nlp_gait import load
from nlp_gait.errors import InputError
from nlp_gait.formulation import Result
from nlp_gait.formulation.registry import LARGEST_COUNT
from nlp_gait.simulation.plan import LONGEST_S as LONGEST_PLAYED_S
from nlp_gait.simulation.plan import MOST_STEPS, make_plan


@pytest.mark.parametrize("name", ["nao-ssp", "nao-cycle"])
def test_a_grid_is_as_large_as_its_samples(name: str) -> None:
    with pytest.raises(InputError, match=f"at most {LARGEST_COUNT} intervals in all, got intervals "):
        load(name, intervals=LARGEST_COUNT // 10, samples_per_interval=12)
    with pytest.raises(InputError, match="samples_per_interval"):
        load(name, samples_per_interval=LARGEST_COUNT)  # with the intervals that it has by itself


def test_the_length_of_a_simulated_walk_is_limited() -> None:
    walk = load("nao-cycle", intervals=2)
    result, longest = Result(problem=walk, x=walk.upper), f"at most {LONGEST_PLAYED_S:g} s are simulated"
    for steps, words in (
        (60, rf"60 steps of this gait last 360 s, and {longest}"),
        (10**9, f"at most {MOST_STEPS} steps"),
    ):
        with pytest.raises(InputError, match=words):
            make_plan(result, steps)
