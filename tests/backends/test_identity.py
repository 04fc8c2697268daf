"""A problem is what it evaluates to: other formulas for the same functions keep what was stored, a wrong sign does not."""

import json
from pathlib import Path

import pytest
from casadi import MX, SX, Function, vertcat

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import SUM, describe_difference, hash_json, identify_problem, make_key
from nlp_gait.formulation import GaitProblem, load
from nlp_gait.formulation.assembly import Constraint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.user_code import hash_source
from tests.backends.toys import toy

OWN = '''"""{text}."""
from tests.backends import test_identity
def leg():
    """{text}."""
    return test_identity.make_polynomial({inner!r}, {order}, {sign})  # {text}
'''


def make_polynomial(inner: str = "inner", order: int = 1, sign: float = 1.0) -> GaitProblem:
    """Make a problem with 40 rows, whose terms are summed forwards or backwards."""
    t = SX.sym("t", 2)
    terms = [t[0], 0.3 * t[1] ** 2, 0.7 * t[0] * t[1]]
    total = sum(terms[1:], terms[0]) if order == 1 else terms[2] + (terms[1] + terms[0])
    function = Function(inner, [t], [total])

    def mathematics(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        found = function(vertcat(x, y))
        rows = [found + k for k in range(40)]
        rows[17] = sign * rows[17]
        labels = tuple(str(k) for k in range(40))
        stack = Constraint(name="row", unit="m", scale=0.1, labels=labels, value=vertcat(*rows), upper=limit + 60)
        return found**2, (stack,)

    return toy(mathematics)


def test_other_formulas_for_the_same_functions_are_the_same_problem() -> None:
    problem, other = make_polynomial(), make_polynomial("renamed", order=-1)
    texts = [build_exact_model(of).function.serialize() for of in (problem, other)]
    assert texts[0] != texts[1]
    before, after = identify_problem(problem), identify_problem(other)
    assert describe_difference(before, after) == "" and make_key(before) == make_key(after)


def test_a_wrong_sign_in_one_row_is_noticed() -> None:
    before, after = identify_problem(make_polynomial()), identify_problem(make_polynomial(sign=-1.0))
    assert not any("17" in name for probe in after["probes"] for name in probe["rows"])  # it is not one of the dozen
    assert describe_difference(before, after).startswith(SUM)
    assert describe_difference(after, before).endswith("of its scale")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mathematics": 2}, "its formulas are of version 2, not 1"),
        ({"parameters": {"limit": 0.6}}, "parameter limit is 0.6, not its default"),
        ({"probes": []}, "its probes are incomplete"),
    ],
)
def test_what_differs_is_named(change: dict[str, object], message: str) -> None:
    known = identify_problem(make_polynomial())
    assert describe_difference(known, {**known, **change}) == message


def test_numbers_agree_to_rounding_only() -> None:
    known = identify_problem(load("walk12"))
    for key in ("objective", "violation"):
        for share, differs in ((1e-12, False), (1e-8, True)):
            changed = json.loads(json.dumps(known))
            changed["probes"][2][key] = changed["probes"][2][key] * (1.0 + share) + (
                share if key == "violation" else 0.0
            )
            assert bool(describe_difference(known, changed)) == differs


def test_user_code_keeps_its_identity_when_a_comment_or_a_name_inside_changes(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    found = []
    for text, inner, order, sign in (("a", "f", 1, 1.0), ("b", "f", 1, 1.0), ("c", "g", -1, 1.0), ("d", "f", 1, -1.0)):
        path.write_text(OWN.format(text=text, inner=inner, order=order, sign=sign))
        found.append((identify_problem(load(f"{path}:leg")), hash_source(f"{path}:leg", "problem")))
    (first, source), (commented, same), (renamed, other), (wrong, _) = found
    assert source == same != other
    assert not describe_difference(first, commented) and not describe_difference(first, renamed)
    assert describe_difference(first, wrong)
    assert make_key(first)["name"] == "leg" and str(tmp_path) not in json.dumps(make_key(first))
    assert hash_json(make_key(first)) == hash_json(make_key(renamed))
