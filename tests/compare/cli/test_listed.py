"""The file that `nlp-gait list` prints has the names of today."""

import json
from importlib.resources import files
from typing import Any

from compare.report.provenance import list_described_names
from nlp_gait import formulation
from nlp_gait.limits import LIMITS
from nlp_gait.robots import list_robots
from tests.compare.cli.calls import as_json, nlp_gait


def collect_names() -> dict[str, Any]:
    """Return what `listed.json` has: problems with title and numbers of variables and parameters, and robots."""
    problems = {name: formulation.load(name) for name in formulation.list_problems()}
    return {
        "problems": {name: [p.title, len(p.names), len(p.own_parameters)] for name, p in problems.items()},
        "robots": list(list_robots()),
    }


def test_the_shipped_list_is_that_of_the_code() -> None:
    shipped = json.loads(files("compare.cli").joinpath("listed.json").read_text(encoding="utf-8"))
    assert shipped == collect_names(), "python -m tests.compare.cli.test_listed > compare/cli/listed.json"


def test_the_lists_name_problems_algorithms_robots_and_limits() -> None:
    text = nlp_gait("list").stdout
    assert "NAO on one leg: mean motor power" in text and "nao-v5" in text
    assert as_json("list")["problems"]["nao-ssp"]["variables"] == 9
    assert [found["name"] for found in as_json("list", "algorithms")["algorithms"]] == list(list_described_names())
    assert " pymoo:GA " in nlp_gait("list", "algorithms").stdout
    limits = {found["name"]: found["parameters"] for found in as_json("list", "limits")["limits"]}
    assert limits.keys() == LIMITS.keys() and limits["FrictionCone"] == "friction_coefficient=0.6"


if __name__ == "__main__":
    print(json.dumps(collect_names(), indent=1))
