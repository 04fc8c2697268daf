"""Variants of a problem: what is solved, from where, and what the command writes of it."""

from pathlib import Path

import pytest

from compare.questions.question import find
from compare.questions.variants import (
    SolvedVariant,
    Variant,
    Variants,
    convert_motion,
    list_trajectories,
    load_variant,
)
from nlp_gait import load
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem
from tests.compare.cli.calls import as_json

pytestmark = pytest.mark.usefixtures("coarse_pictures")


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return load("nao-dsp", intervals=2)


@pytest.fixture(scope="module")
def found(problem: GaitProblem) -> tuple[SolvedVariant, ...]:
    names = ("cubic", "quintic", "spline-8, few samples")
    some = [variant for variant in list_trajectories(problem) if variant.name in names]
    some[-1] = Variant(name="few samples", options={**some[-1].options, "trajectory": "quintic"}, alone=True)
    return find(Variants(problem=problem, variants=some, starts=1))


def test_a_quintic_needs_less_and_hides_power_between_few_samples(found: tuple[SolvedVariant, ...]) -> None:
    cubic, quintic, coarse = found
    assert all(variant.feasible for variant in found)
    assert [variant.start for variant in found] == ["", "cubic", "quintic"]
    assert quintic.objective < 0.9 * cubic.objective
    assert quintic.dense is not None and coarse.dense is not None
    assert quintic.objective == pytest.approx(quintic.dense["power_W"], rel=0.15)
    assert coarse.objective < 0.1 * coarse.dense["power_W"] and coarse.worst.startswith("torque_change")
    assert quintic.variables == cubic.variables + 14 and quintic.moved is None


def test_a_richer_motion_contains_a_simpler_one(problem: GaitProblem, found: tuple[SolvedVariant, ...]) -> None:
    quintic = found[1]
    planned = load_variant(problem, Variant(name="quintic", options=quintic.options))
    value = build_exact_model(planned).at(planned.check_x(quintic.x), planned.p).cost
    for name, options in (
        ("nao-dsp", {"trajectory": "spline-4"}),
        ("nao-dsp-free", {"trajectory": "quintic"}),
    ):
        richer = (
            load(name, **problem.options | options | {"samples_per_interval": 4})
            if name == "nao-dsp"
            else load(name, intervals=2, samples_per_interval=4, **options)
        )
        x = convert_motion(quintic.x, richer)
        assert x is not None
        assert build_exact_model(richer).at(x, richer.p).cost == pytest.approx(value, rel=1e-9)
        assert convert_motion(richer.by_name(x), planned) is None or name == "nao-dsp"
    assert convert_motion(quintic.x, problem) is None


def test_free_joints_of_single_support_do_not_contain_a_plan() -> None:
    phase = load("nao-ssp", intervals=2)
    cubic, *_, free = (v for v in list_trajectories(phase) if v.options["trajectory"] in ("cubic", "spline-2"))
    question = Variants(problem=phase, variants=[cubic, free])
    assert not question._has_curves(load_variant(phase, free), cubic)
    assert question._has_curves(load_variant(phase, free), free)


def test_the_command_reports_what_each_feature_of_the_motors_changes(tmp_path: Path) -> None:
    named = ["--variant", "limits:motors=limits", "--variant", "K:motors=limits,ankle,heat"]
    answer = as_json("variants", "nao-dsp", *named, "--starts", "1", "--out", tmp_path)
    published, limited, heated = answer["variants"]
    assert [v["options"] for v in answer["variants"]] == [{}, {"motors": "limits"}, {"motors": "limits,ankle,heat"}]
    assert published["objective"] == pytest.approx(0.531886, abs=1e-6)
    assert limited["objective"] == pytest.approx(published["objective"], rel=1e-6)
    assert limited["unchanged_violation"] == 0.0
    assert heated["objective"] < heated["unchanged"] and heated["as_first"] > published["objective"]
    assert [v["name"] for v in answer["variants"]] == ["as given", "limits", "K"]
