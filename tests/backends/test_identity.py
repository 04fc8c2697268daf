"""What a problem is made of: its name, options, values, the number of its formulas and the user's files, wherever they lie."""

import json
from pathlib import Path
from typing import Any

import pytest

from nlp_gait.backends.exact import describe_difference, hash_formulas, hash_json, identify_problem, make_key
from nlp_gait.formulation import load
from tests.backends.toys import corner, toy

OWN = "from nlp_gait.formulation import load\ndef leg(*, steps: int = 2):\n    return load('walk12'){more}\n"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mathematics": 2}, "its version of the formulas is 2, not 1"),
        ({"name": "nao-dsp"}, "its name is nao-dsp, not walk12"),
        ({"parameters": {"lambda": 0.6}}, "parameter lambda is 0.6, not its default"),
        ({"files": {"code": "0"}}, "the user's files that it is made of have changed (code)"),
    ],
)
def test_what_differs_is_named(change: dict[str, object], message: str) -> None:
    known = identify_problem(load("walk12"))
    assert describe_difference(known, known) == "" and describe_difference(known, {**known, **change}) == message
    assert describe_difference({**known, **change}, known)


def test_options_with_their_defaults_do_not_count_so_that_a_new_one_changes_no_key() -> None:
    known = identify_problem(load("walk12"))
    older = {**known, "options": {key: known["options"][key] for key in list(known["options"])[1:]}}
    assert hash_json(make_key(older)) == hash_json(make_key(known)) and not describe_difference(older, known)
    other = identify_problem(load("walk12", intervals=10))
    assert describe_difference(known, other) == "option intervals is 10, not its default"
    assert hash_json(make_key(other)) != hash_json(make_key(known))


def test_user_code_is_its_files_by_content_and_not_by_folder(tmp_path: Path) -> None:
    found: list[dict[str, Any]] = []
    for folder, more in (("a", ""), ("b", ""), ("c", "  # edited")):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "own.py"
        path.write_text(OWN.format(more=more))
        found.append(identify_problem(load(f"{path}:leg")))
    first, copied, edited = found
    assert not describe_difference(first, copied) and hash_json(make_key(first)) == hash_json(make_key(copied))
    assert describe_difference(first, edited) == "the user's files that it is made of have changed (code)"
    assert make_key(first)["name"] == "leg" and str(tmp_path) not in json.dumps(make_key(first))


def test_a_problem_that_no_name_loads_is_its_formulas() -> None:
    """Also the names of its rows and the defaults of its parameters."""
    first, again = toy(corner), toy(corner)
    assert identify_problem(first)["files"] == {"formulas": hash_formulas(again)}
    other = toy(lambda x, y, limit, ops: (2 * corner(x, y, limit, ops)[0], corner(x, y, limit, ops)[1]))
    assert describe_difference(identify_problem(first), identify_problem(other))
    assert describe_difference(identify_problem(first), identify_problem(toy(corner, limit=0.7)))
