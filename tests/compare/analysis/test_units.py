"""Numbers as tables show them."""

import math

import pytest

from compare.analysis.units import (
    BY_UNIT,
    choose_natural_step,
    format_millimetres,
    format_number,
    format_percent,
    with_unit,
)


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (-0.0, ".3f", "0.000"),
        (-4e-4, ".3f", "0.000"),
        (-6e-4, ".3f", "-0.001"),
        (-4e-6, "+.2%", "+0.00%"),
        (-0.0, "", "0.0"),
        (-0.4, ",.0f", "0"),
        (1234567.0, ",.0f", "1,234,567"),
        (7, "d", "7"),
        (math.nan, ".3f", "nan"),
    ],
)
def test_what_is_rounded_to_zero_has_no_sign(value: float, digits: str, shown: str) -> None:
    assert format_number(value, digits) == shown


def test_units_follow_numbers_whose_digits_mean_something() -> None:
    shown = {0.0: "0.000000 W", 1e-16: "1e-16 W", -2e-9: "-2e-09 W", 1e267: "1e+267 W", 0.8458681: "0.845868 W"}
    assert {value: with_unit(value, "W") for value in shown} == shown
    assert (with_unit(-1e-9, "W", ".3f"), with_unit(-1e-9, "1", "g")) == ("0.000 W", "-1e-09")
    assert format_millimetres(-1e-6) == "0.0 mm" and format_millimetres(None) == "-"
    assert format_percent(None) == format_percent(math.inf) == "-"


@pytest.mark.parametrize("unit", BY_UNIT)
def test_a_natural_step_is_what_its_words_say(unit: str) -> None:
    step = choose_natural_step(unit, 1.0)
    number, _, shown = step.words.partition(" ")
    scale = {"mm": 1e-3, "mm/s": 1e-3, "degree": math.pi / 180}.get(shown, 1.0)
    assert step.size == pytest.approx(float(number) * scale)
    assert shown in (unit, f"m{unit}", "degree") or not shown
