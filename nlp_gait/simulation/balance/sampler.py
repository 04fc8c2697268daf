"""Measurements of a feedback: at even times, noisy, and known after a delay."""

import copy
from collections import deque
from collections.abc import Callable
from typing import Generic, Self, TypeVar

import numpy as np

V = TypeVar("V")


class Sampler(Generic[V]):
    """Measurements of one simulation; their noise is drawn from ``random``."""

    def __init__(self, period_s: float, delay_s: float, seed: int, step_s: float) -> None:
        """Start with the simulation, whose time step is ``step_s`` [s]."""
        self.random = np.random.default_rng(seed)
        self._every, self._late = max(1, round(period_s / step_s)), round(delay_s / step_s)
        self._waiting: deque[tuple[int, V]] = deque()

    def sample(self, step: int, measure: Callable[[], V]) -> V | None:
        """Return the measurement that arrives at a step of the engine, if any; call it once in each that ``wait`` names."""
        if step % self._every == 0:
            self._waiting.append((step + self._late, measure()))
        arrived = bool(self._waiting) and self._waiting[0][0] <= step
        return self._waiting.popleft()[1] if arrived else None

    def wait(self, step: int) -> int:
        """Return the number of steps until the next measurement or arrival after a step."""
        arrival = self._waiting[0][0] if self._waiting else step + self._every
        return min(arrival - step, self._every - step % self._every)

    def fork(self) -> Self:
        """Return a copy for a simulation that begins in the middle of this one."""
        other = copy.copy(self)
        other.random, other._waiting = copy.deepcopy(self.random), self._waiting.copy()
        return other
