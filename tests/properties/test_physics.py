"""Invariances that any correct model of a walking robot has, whatever its numbers."""

import math
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.formulation import Array, GaitProblem, Signals, load
from tests.evaluation import evaluated
from tests.robots.custom import Record, nao, written

NAMES = ("nao-ssp", "nao-dsp")
of_both_phases = pytest.mark.parametrize("name", NAMES)
# Sums of some hundred products in another order, relative to the largest.
ROUNDING = 1e-10
# With a phase of 1e5 s accelerations are 1e-10 of those of a second.
SLOW_S, AT_REST_M = 1e5, 1e-9
SEEDS = range(2)


def candidates(problem: GaitProblem) -> list[Array]:
    return [np.random.default_rng(seed).uniform(problem.lower, problem.upper) for seed in SEEDS]


def signals_of(problem: GaitProblem, x: Array) -> dict[str, Array]:
    signals: Signals = problem.signals(x)
    return dict(signals.arrays)


def heavier(factor: float) -> Record:
    """NAO with all masses and moments of inertia times a factor."""
    raw = nao()
    for link in raw["links"].values():
        link["mass_kg"] *= factor
        link["inertia_com_kgm2"] = [factor * moment for moment in link["inertia_com_kgm2"]]
    return raw


def larger(factor: float) -> Record:
    """NAO with all lengths times a factor and the same masses."""
    raw = nao()
    for link in raw["links"].values():
        link["com_m"] = [factor * c for c in link["com_m"]]
        link["inertia_com_kgm2"] = [factor**2 * moment for moment in link["inertia_com_kgm2"]]
    for joint in raw["joints"].values():
        joint["origin_m"] = [factor * c for c in joint["origin_m"]]
    for foot in raw["feet"].values():
        foot |= {key: factor * value for key, value in foot.items() if key.endswith("_m")}
    return raw


@of_both_phases
def test_masses_scale_torques_and_leave_the_balance(tmp_path: Path, name: str) -> None:
    """Mechanical power grows like the masses, heat like their square: with K / factor all power grows alike."""
    factor = 3.0
    plain, heavy = load(name), load(name, robot=written(tmp_path, heavier(factor)))
    cooler = heavy.with_values(heat_loss_W_per_Nm2=plain.value("heat_loss_W_per_Nm2") / factor)
    for x in candidates(plain):
        one, other = signals_of(plain, x), signals_of(heavy, x)
        np.testing.assert_allclose(other["tau"], factor * one["tau"], rtol=0, atol=ROUNDING * np.abs(one["tau"]).max())
        np.testing.assert_allclose(other["zmp"], one["zmp"], rtol=0, atol=ROUNDING * np.abs(one["zmp"]).max())
        before, after = evaluated(plain, x).indexes, evaluated(cooler, x).indexes
        for index in ("power_W", "torque_change_Nm"):
            assert after[index] == pytest.approx(factor * before[index], rel=ROUNDING)
        for index in ("dbm_x_min_m", "dbm_y_mean_m"):
            assert after[index] == pytest.approx(before[index], rel=ROUNDING, abs=ROUNDING)


@of_both_phases
def test_lengths_scale_like_the_square_of_times(tmp_path: Path, name: str) -> None:
    """Froude's similarity with a robot twice as large: equal angles, lengths times 2, times and speeds times sqrt(2)."""
    size, root = 2.0, math.sqrt(2.0)
    plain = load(name)
    large = load(name, robot=written(tmp_path, larger(size)), step_length_m=size * 0.06)
    large = large.with_values(heat_loss_W_per_Nm2=plain.value("heat_loss_W_per_Nm2") / size / root)
    factors = np.array([{"m": size, "m/s": root, "s": root}[variable.unit] for variable in plain.variables])
    for x in candidates(plain):
        one, other = signals_of(plain, x), signals_of(large, factors * x)
        np.testing.assert_allclose(other["q"], one["q"], rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(other["qd"], one["qd"] / root, rtol=0, atol=ROUNDING * np.abs(one["qd"]).max())
        np.testing.assert_allclose(other["tau"], size * one["tau"], rtol=0, atol=ROUNDING * np.abs(one["tau"]).max())
        np.testing.assert_allclose(other["zmp"], size * one["zmp"], rtol=0, atol=ROUNDING * np.abs(one["zmp"]).max())
        np.testing.assert_allclose(other["com"], size * one["com"], rtol=0, atol=ROUNDING)
        before, after = evaluated(plain, x).indexes, evaluated(large, factors * x).indexes
        assert after["power_W"] == pytest.approx(size / root * before["power_W"], rel=ROUNDING)
        assert after["dbm_y_min_m"] == pytest.approx(size * before["dbm_y_min_m"], rel=ROUNDING, abs=ROUNDING)


@pytest.mark.parametrize(("name", "options"), [("nao-ssp", {}), ("nao-dsp", {}), ("nao-dsp", {"torso_share": "lever"})])
def test_at_rest_the_zmp_lies_under_the_centre_of_mass(name: str, options: dict[str, str]) -> None:
    problem = load(name, **options)
    for x in candidates(problem):
        slow = x.copy()
        slow[1:7], slow[-1] = 0.0, SLOW_S
        arrays = signals_of(problem, slow)
        np.testing.assert_allclose(arrays["zmp"], arrays["com"][:, :2], rtol=0, atol=AT_REST_M)
        fast = signals_of(problem, x)
        assert np.abs(fast["zmp"] - fast["com"][:, :2]).max() > 1e-3  # what is equal above differs in motion
