"""The paper's inverse kinematics: a small network trained online, pose after pose, on the ankle's own error."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple, get_args

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.formulas.leg_network import leg_rates, leg_vector, network_error, trained_path
from nlp_gait.gaits.stairs.formulas.planar_biped import LINKS
from nlp_gait.gaits.stairs.robot import toe_foot_biped

Rule = Literal["gradient", "adam"]
# Decay rates of Adam's two moments and its guard against division by zero (Kingma, Ba 2015).
ADAM_DECAY, ADAM_GUARD = (0.9, 0.999), 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkSettings:
    """Hyperparameters of the network (Table II, but for the learning rule).

    With the printed rule, plain gradient steps of 1e-4, a pose in twenty converges within the printed 5,000 iterations.

    Attributes:
        hidden: nodes of the hidden layer.
        rule: plain gradient steps as in (30), or Adam.
        rate: learning rate.
        iterations: most steps for one pose.
        tolerance_m2: squared distance of the ankle that ends the training of a pose [m^2].
        seed: of the first weights.
    """

    hidden: int = 10
    rule: Rule = "adam"
    rate: float = 0.01
    iterations: int = 5000
    tolerance_m2: float = 1e-6
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse settings with which nothing can be trained."""
        if self.rule not in get_args(Rule):
            raise InputError(f"rule must be one of {', '.join(get_args(Rule))}, got {self.rule!r}")
        if self.hidden < 1 or self.iterations < 1:
            raise InputError(f"hidden and iterations must be at least 1, got {self.hidden}, {self.iterations}")
        if not (self.rate > 0.0 and self.tolerance_m2 > 0.0):
            raise InputError(f"rate and tolerance_m2 must be > 0, got {self.rate}, {self.tolerance_m2}")

    @property
    def first_weights(self) -> Array:
        """(4 h,) as ``leg_network.network_error`` takes them: normally distributed."""
        rng = np.random.default_rng(self.seed)
        inner, outer = rng.standard_normal((self.hidden, 2)), rng.standard_normal((2, self.hidden))
        return np.concatenate([inner.ravel(order="F"), outer.ravel(order="F")])


# Gradient steps, as printed, at a rate with which every pose of the three planned steps converges within 40 of them; the
# printed 5,000 would take a minute for each rollout, as all of them are counted.
ONLINE = NetworkSettings(rule="gradient", rate=0.3, iterations=100)
LEGS = (("HK", "KA"), ("HK'", "K'A'"))


class NetworkPath(NamedTuple):
    """Result for m poses.

    Attributes:
        angles: (m, 2) absolute angles of thigh and shank, clockwise from the forward axis [rad].
        error_m2: (m,) squared distance of the ankle from its target [m^2].
        iterations: (m,) steps taken.
        time_s: (m,) wall time.
    """

    angles: Array
    error_m2: Array
    iterations: Array
    time_s: Array


def network_angles(
    hip_to_ankle: Array, thigh: float, shank: float, settings: NetworkSettings | None = None
) -> NetworkPath:
    """Leg angles along a path, each pose starting from the weights of the last.

    Args:
        hip_to_ankle: (m, 2) vectors, forward and up [m].
        thigh: length [m].
        shank: length [m].
        settings: hyperparameters.

    Source:
        Bhardwaj et al., Algorithm 1 and eqs. (27)-(30).
    """
    settings = settings or NetworkSettings()
    training = _training(settings.hidden, thigh, shank)
    weights = settings.first_weights
    step = _Adam(settings.rate) if settings.rule == "adam" else lambda gradient: settings.rate * gradient
    rows = []
    for target in hip_to_ankle:
        started = time.perf_counter()
        for iteration in range(settings.iterations + 1):
            angles, error, gradient = training(weights, target)
            if float(error) <= settings.tolerance_m2 or iteration == settings.iterations:
                break
            weights = weights - step(np.array(gradient).ravel())  # (eq. 30)
        rows.append((np.array(angles).ravel(), float(error), iteration, time.perf_counter() - started))
    return NetworkPath(*(np.array(column) for column in zip(*rows, strict=True)))


def learned(desired: MX) -> MX:
    """Desired angles and rates (18, m) of all links along a path, those of thighs and shanks by the network.

    The network learns where the ankle is from the hip; rates follow by differentiating its forward kinematics. It is trained
    anew, pose after pose, in every evaluation: the paper trains online.
    """
    columns = desired.shape[1]
    rows = ca.vertsplit(desired)
    for thigh, shank in LEGS:
        lengths = toe_foot_biped().link(thigh).length_m, toe_foot_biped().link(shank).length_m
        at = [LINKS.index(thigh), LINKS.index(shank)]
        at += [len(LINKS) + i for i in at]
        q, v, velocity = SX.sym("q", 2), SX.sym("v", 2), SX.sym("velocity", 2)
        reached = leg_vector(q, *lengths)
        follow = ca.Function("follow", [q, v], [reached, ca.jtimes(reached, q, v)]).map(columns)
        rates = ca.Function("rates", [q, velocity], [leg_rates(q, velocity, *lengths)]).map(columns)
        train = trained_path(ONLINE.hidden, *lengths, columns, ONLINE.rate, ONLINE.iterations, ONLINE.tolerance_m2)
        targets, velocities = follow(ca.vertcat(*(rows[i] for i in at[:2])), ca.vertcat(*(rows[i] for i in at[2:])))
        angles = train(DM(ONLINE.first_weights), targets)
        for i, row in zip(at, ca.vertsplit(ca.vertcat(angles, rates(angles, velocities))), strict=True):
            rows[i] = row
    return ca.vertcat(*rows)


@cache
def _training(nodes: int, thigh: float, shank: float) -> ca.Function:
    """(weights, target) to the angles, the error and its gradient by the weights."""
    weights, target = SX.sym("weights", 4 * nodes), SX.sym("target", 2)
    angles, error = network_error(weights, target, thigh, shank)
    return ca.Function("training", [weights, target], ca.cse([angles, error, ca.gradient(error, weights)]))


class _Adam:
    """Step by moments of the gradient."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._steps = 0
        self._first: Array | float = 0.0
        self._second: Array | float = 0.0

    def __call__(self, gradient: Array) -> Array:
        self._steps += 1
        a, b = ADAM_DECAY
        self._first = a * self._first + (1 - a) * gradient
        self._second = b * self._second + (1 - b) * gradient**2
        first, second = self._first / (1 - a**self._steps), self._second / (1 - b**self._steps)
        return self._rate * first / (np.sqrt(second) + ADAM_GUARD)
