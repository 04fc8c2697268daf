"""Printed points: every point of the box agrees with what is said about the box."""

import numpy as np
import pytest

import compare.rounding as rounding
from compare.rounding import evaluate_rounded
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import load
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from tests.compare.cli.calls import as_json, nlp_gait, one_sentence

WALK = load("walk12")
CASES = {
    "0.1300,0.1135,0.0010,0.0105": ("everywhere", "enclosed"),
    "0.1000,0.0010,0.0200,0.0010": ("somewhere", "evaluated"),
    "0.1200,0.0010,0.0200,0.0010": ("nowhere", "enclosed"),
    "0.01,0.05,0.02,0.03": ("nowhere", "enclosed"),
}


@pytest.mark.slow
@pytest.mark.parametrize("printed", CASES)
def test_random_points_of_the_box_agree(printed: str) -> None:
    found = evaluate_rounded(WALK, printed.split(","))
    assert (found.feasible, found.how) == CASES[printed]
    box, model = np.array(list(found.box.values())), build_exact_model(WALK)
    assert found.enclosure is not None
    values = [model.at(x, WALK.p) for x in np.random.default_rng(0).uniform(*box.T, (200, 4))]
    costs = WALK.objective.sign * np.array([value.cost for value in values])
    low, high = sorted((found.best, found.worst))
    assert found.enclosure[0] <= min(low, costs.min()) and max(high, costs.max()) <= found.enclosure[1]
    kink = 0.01 * (high - low)  # the search may end at one
    assert low <= costs.min() + kink and high >= costs.max() - kink
    feasible = [value.violation <= FEASIBILITY_TOLERANCE for value in values]
    assert {"everywhere": all(feasible), "nowhere": not any(feasible), "somewhere": True}[found.feasible]
    assert found.at_best.violation <= found.at_worst.violation
    if found.feasible == "somewhere":
        assert found.at_best.violation < 0.0 < found.at_worst.violation
        assert any(feasible) and not all(feasible)


@pytest.mark.slow
def test_digits_make_the_box_within_the_bounds() -> None:
    found = evaluate_rounded(WALK, ["0.130", " 1.13e-1", "0.0010", "1e-2"])
    box = np.array(list(found.box.values()))
    np.testing.assert_allclose(box[:3], [[0.1295, 0.13], [0.1125, 0.1135], [0.001, 0.00105]], rtol=1e-12)
    np.testing.assert_allclose(box[3], [0.005, 0.015], rtol=1e-12)
    assert found.x["frontal_shift_m"] == " 1.13e-1"
    outside = evaluate_rounded(WALK, ["0.01", "0.05", "0.02", "0.03"])
    assert str(outside.at_best) == "bounds[step_length_m] is violated by 0.035 m"


@pytest.mark.slow
def test_what_cannot_be_enclosed_is_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise InputError("an operation that cannot be enclosed")

    monkeypatch.setattr(rounding, "_build_enclosure", refuse)
    for printed, (where, how) in CASES.items():
        found = evaluate_rounded(WALK, printed.split(","))
        expected = "evaluated" if how == "evaluated" else "sampled"
        assert (found.feasible, found.how, found.enclosure) == (where, expected, None)


@pytest.mark.slow
def test_values_without_an_enclosure_prove_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    enclose = WALK.build_once(rounding._build_enclosure)

    def lose(*given: object) -> object:
        forms = enclose(*given)
        forms.upper[:, 5] = np.nan
        return forms._replace(lower=np.full_like(forms.lower, np.nan))

    monkeypatch.setattr(rounding, "_build_enclosure", lambda _: lose)
    found = evaluate_rounded(WALK, "0.1300,0.1135,0.0010,0.0105".split(","))
    assert (found.feasible, found.how, found.enclosure) == ("everywhere", "sampled", None)


@pytest.mark.parametrize(
    ("printed", "message"),
    [("0.1,0.1,0.1", "walk12 has 4 variables"), ("0.1,0.1,0.1,nan", "as it was printed, got 'nan'")],
)
def test_what_is_no_printed_point_is_refused(printed: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        evaluate_rounded(WALK, printed.split(","))


@pytest.mark.slow
def test_the_command() -> None:
    call = ("evaluate", "walk12", "--x", "0.1000,0.0010,0.0200,0.0010", "--rounded")
    text = nlp_gait(*call, "--claimed", "0.7370").stdout
    assert "from 0.737548 (best) to 0.736874 (worst) at evaluated points; enclosed: 0.736840 to 0.737578" in text
    assert "feasible somewhere, evaluated" in text
    assert "at the worst point that was found reach[stance leg, 0 T] is violated by 0.000313" in text
    assert "the claimed 0.7370: reached" in text
    assert as_json(*call, "--claimed", "0.7410")["claim"] == "impossible"
    data = as_json(*call)
    assert data["claim"] is None
    assert (data["feasible"], data["how"], data["at_best"]["violation"] < 0.0) == ("somewhere", "evaluated", True)
    assert "add --rounded" in one_sentence("evaluate", "walk12", "--x", "0.1,0.1,0.1,0.1", "--claimed", "1")
    assert "--rounded takes one candidate" in one_sentence("evaluate", "walk12", "--x", "points.csv", "--rounded")
