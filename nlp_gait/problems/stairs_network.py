"""The paper's inverse kinematics: a small network trained online, pose after pose, on the ankle's own error."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import Array

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
        """Refuse what cannot train."""
        if self.rule not in get_args(Rule):
            raise InputError(f"rule must be one of {', '.join(get_args(Rule))}, got {self.rule!r}")
        if self.hidden < 1 or self.iterations < 1:
            raise InputError(f"hidden and iterations must be at least 1, got {self.hidden}, {self.iterations}")
        if not (self.rate > 0.0 and self.tolerance_m2 > 0.0):
            raise InputError(f"rate and tolerance_m2 must be > 0, got {self.rate}, {self.tolerance_m2}")


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
    rng = np.random.default_rng(settings.seed)
    weights = [rng.standard_normal((settings.hidden, 2)), rng.standard_normal((2, settings.hidden))]
    step = _Adam(settings.rate) if settings.rule == "adam" else _Gradient(settings.rate)
    rows = []
    for target in hip_to_ankle:
        started = time.perf_counter()
        for iteration in range(settings.iterations + 1):
            angles, error, gradients = _forward(weights, target, thigh, shank)
            if error <= settings.tolerance_m2 or iteration == settings.iterations:
                break
            weights = [w - change for w, change in zip(weights, step(gradients), strict=True)]  # (eq. 30)
        rows.append((angles, error, iteration, time.perf_counter() - started))
    return NetworkPath(*(np.array(column) for column in zip(*rows, strict=True)))


def _forward(weights: list[Array], target: Array, thigh: float, shank: float) -> tuple[Array, float, list[Array]]:
    """Absolute angles (2,), squared error (eq. 29), and its gradients by the weights."""
    inner, outer = weights
    hidden = 1.0 / (1.0 + np.exp(-(inner @ target)))
    hip, knee = outer @ hidden
    both = hip + knee
    x = thigh * np.cos(hip) + shank * np.cos(both)  # (eq. 27)
    z = -thigh * np.sin(hip) - shank * np.sin(both)  # (eq. 28)
    ex, ez = x - target[0], z - target[1]
    by_both = 2.0 * shank * (-ex * np.sin(both) - ez * np.cos(both))
    by_hip = by_both + 2.0 * thigh * (-ex * np.sin(hip) - ez * np.cos(hip))
    by_output = np.array([by_hip, by_both])
    by_hidden = (outer.T @ by_output) * hidden * (1.0 - hidden)
    gradients = [np.outer(by_hidden, target), np.outer(by_output, hidden)]
    return np.array([hip, both]), float(ex * ex + ez * ez), gradients


class _Gradient:
    """Plain gradient step."""

    def __init__(self, rate: float) -> None:
        self._rate = rate

    def __call__(self, gradients: list[Array]) -> list[Array]:
        return [self._rate * gradient for gradient in gradients]


class _Adam:
    """Step by moments of the gradient."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._steps = 0
        self._moments: list[tuple[Array, Array]] = []

    def __call__(self, gradients: list[Array]) -> list[Array]:
        self._steps += 1
        if not self._moments:
            self._moments = [(np.zeros_like(g), np.zeros_like(g)) for g in gradients]
        a, b = ADAM_DECAY
        self._moments = [
            (a * first + (1 - a) * g, b * second + (1 - b) * g * g)
            for (first, second), g in zip(self._moments, gradients, strict=True)
        ]
        unbiased_a, unbiased_b = 1 - a**self._steps, 1 - b**self._steps
        return [
            self._rate * (first / unbiased_a) / (np.sqrt(second / unbiased_b) + ADAM_GUARD)
            for first, second in self._moments
        ]
