"""Any value as an argument or a plug-in's answer is refused in one sentence or taken."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from tests.fuzz.arguments import argument_ended, plugin_ended

CALLS = 300


@pytest.mark.slow
@pytest.mark.parametrize("ended", [argument_ended, plugin_ended])
def test_any_value_is_taken_or_refused_in_one_sentence(ended: Callable[[random.Random], tuple[str, str]]) -> None:
    rng = random.Random(0)
    ends = [ended(rng) for _ in range(CALLS)]
    assert [(what, end) for what, end in ends if end not in ("accepted", "refused")] == []
    assert {end for _, end in ends} == {"accepted", "refused"}
