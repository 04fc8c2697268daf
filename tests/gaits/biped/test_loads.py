"""Loads at one instant: centre of pressure and shares of the torso by hand."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.gaits.biped.loads import make_divided_loads, make_single_support_loads, share_torso
from nlp_gait.gaits.biped.samples import Instant
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.symbolic.trajectories import Motion

BODY = replace(make_nao("nao-v5"), upright=frozenset())
HIP, YAW = np.array([0.02, 0.01, 0.28]), 0.6
ANKLES = {"L": np.array([0.01, 0.05, 0.045]), "R": np.array([0.05, -0.07, 0.045])}


def numbers(value: Any) -> np.ndarray:
    return np.array(ca.evalf(ca.MX(DM(value)))).ravel()


def make_instant(rates: float, **more: Any) -> Instant:
    """Return joints with random angles, and with random rates and accelerations of a size."""
    rng = np.random.default_rng(0)
    states = rng.uniform(-0.3, 0.3, (len(BODY.joints), 3)) * (1.0, rates, rates)
    joints = {name: Motion(*map(SX, state)) for name, state in zip(BODY.joints, states.tolist(), strict=True)}
    ankles = {side: SX(DM(place)) for side, place in ANKLES.items()}
    return Instant(joints=joints, hip=SX(DM(HIP)), ankles=ankles, **more)


def test_the_centre_of_pressure_of_a_sole_is_the_zmp() -> None:
    now = make_single_support_loads(BODY)(make_instant(rates=3.0))
    _, _, load, roll, pitch, _ = numbers(now.wrenches["L"])
    assert load > 0.0 and abs(roll) > 0.1 and abs(pitch) > 0.1
    assert numbers(now.zmp) == pytest.approx(ANKLES["L"][:2] + (-pitch / load, roll / load), abs=1e-12)
    assert not numbers(now.wrenches["R"]).any()


@pytest.mark.parametrize("rule", ["printed", "lever"])
def test_shares_in_a_turn_are_measured_across_the_mean_of_both_feet(rule: str) -> None:
    """At rest each foot carries its leg's and its arm's weight, and its share of the torso's."""
    now = make_divided_loads(BODY, rule)(make_instant(rates=0.0, yaw=SX(YAW)))
    across = np.array([-np.sin(YAW / 2), np.cos(YAW / 2)])  # to the left of the mean direction
    hip, left, right = (place[:2] @ across for place in (HIP, ANKLES["L"], ANKLES["R"]))
    far = {"L": (left - hip) / (left - right), "R": (hip - right) / (left - right)}  # from the own foot
    shares = far if rule == "printed" else {"L": far["R"], "R": far["L"]}
    torso = BODY.robot.links[BODY.robot.root].mass_kg * BODY.gravity
    at_half = make_divided_loads(BODY, rule)(replace_hip_by_middle(make_instant(rates=0.0)))
    for side in "LR":
        half = numbers(at_half.wrenches[side])[2]
        assert numbers(now.wrenches[side])[2] == pytest.approx(half + (shares[side] - 0.5) * torso, rel=1e-9)
    assert abs(shares["L"] - float(share_torso(SX(HIP[1]), rule, tuple(BODY.feet_y))["L"])) > 0.01  # the turn matters


def replace_hip_by_middle(now: Instant) -> Instant:
    """Return the instant with the hip in the middle between both feet, where each leg carries half of the torso."""
    return now._replace(hip=SX(DM([0.0, sum(BODY.feet_y) / 2, 0.28])))
