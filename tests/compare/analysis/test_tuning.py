"""Tuning of searches, without Optuna's part of it, which tests/test_other_packages.py runs."""

import numpy as np
import pytest

from compare.analysis.record_statistics import Curve
from compare.analysis.tuning import choose_training, compute_area, tune_solvers
from compare.study.run_study import Study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec
from metaheuristics import SearchError, make_algorithm
from metaheuristics.settings import list_ranges
from nlp_gait.errors import InputError
from tests.backends.toys import corner, toy


def test_training_instances_are_of_the_same_family_with_other_seeds() -> None:
    names = ["gb2:ssp:0", "ssp-v5-time10", "walk12"]
    training = choose_training([ProblemSpec(name=name) for name in names])
    assert [spec.title for spec in training] == [
        *(f"gb2:{family}:9000000" for family in ("ssp", "ssp-timed", "walk12-long")),
        "gb2:ssp:9000001",
    ]


def test_without_ranges_there_is_nothing_to_tune() -> None:
    alone = StudySettings(problems=(ProblemSpec(name=toy(corner)),), solvers=(SolverSpec(name="random"),))
    with pytest.raises(InputError, match="no solver of this study has settings with ranges"):
        tune_solvers(Study(tasks=alone.tasks()), alone, 3, lambda text: None)


@pytest.mark.parametrize("within", [(1.0,), (2.0, 1.0), (0.0, 1.0, "log"), (1.0, 2.0, "linear"), (np.nan, 1.0)])
def test_a_wrong_range_is_one_sentence(within: tuple[float, ...]) -> None:
    def minimise() -> None: ...

    minimise.ranges = {"step": within}  # type: ignore[attr-defined]
    with pytest.raises(SearchError, match="the range of 'step'"):
        list_ranges(minimise)


def test_ranges_contain_the_defaults_and_their_ends_are_allowed() -> None:
    for name in ("pso", "ga", "aco", "aco-grid", "de", "lshade"):
        for setting, (low, high, *_) in list_ranges(make_algorithm(name)).items():
            default = getattr(make_algorithm(name), setting)
            assert default in (low, high) or isinstance(low, str) or low < default < high
            for end in (low, high):
                make_algorithm(name, **{setting: end})


def test_the_area_is_that_under_the_steps_of_the_logarithm() -> None:
    """Nothing, then half of six decades, then beyond the last target."""
    evaluations, gaps = np.array([10.0, 20.0, 60.0]), np.array([np.nan, 1e-3, 1e-9])
    curve = Curve(evaluations=evaluations, seconds=evaluations, gap=gaps)
    assert compute_area(curve, 100.0) == pytest.approx((0.0 * 10 + 0.5 * 40 + 1.0 * 40) / 100)
    bad = Curve(evaluations=np.array([5.0]), seconds=np.array([5.0]), gap=np.array([2.0]))
    assert compute_area(bad, 100.0) == 0.0
