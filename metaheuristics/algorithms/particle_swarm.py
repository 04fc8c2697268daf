"""Particle swarm optimisation."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.errors import check_count, check_number
from metaheuristics.interface import Array, Points, PopulationSearch, Rule, Start


@dataclass(frozen=True, kw_only=True, slots=True)
class ParticleSwarm:
    """Global-best particle swarm; its inertia weight is damped by 0.99, as in the code that Gupta, Pratihar, Deb (2023) cite.

    The paper itself prints a constant weight of 1 (`ConstantInertiaSwarm`), with which the swarm does not settle: this is why the
    cited code is the default. Velocities are limited, and reversed where a particle reaches a bound.

    Particles start at rest. The whole swarm moves, is evaluated as one batch, and only then are the bests updated
    (synchronous). Yarpiz updates the global best within the sweep, after every particle (asynchronous), which a batch
    evaluation cannot do; all else, including the defaults, is as there.

    Source:
        Kennedy, Eberhart (1995), Particle swarm optimization; Yarpiz project YPEA102 (Heris 2015), the code used by
        Gupta, Pratihar, Deb (2023), section 5.
    """

    population: int = 50  #: Number of particles
    inertia: float = 1.0  #: Share of the velocity kept in the first iteration (w)
    #: Factor on the inertia after every iteration (wdamp): 0.99 in the code that the paper cites, 1 for the constant inertia
    #: that it prints
    inertia_damping: float = 0.99
    cognitive: float = 1.5  #: Pull towards a particle's own best (c1)
    social: float = 2.0  #: Pull towards the swarm's best (c2)
    #: Largest speed in a variable, as a share of its range, per iteration
    velocity_limit: float = 0.1
    name: ClassVar[str] = "pso"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=1)
        check_number(self, "inertia", "cognitive", "social", at_least=0.0)
        check_number(self, "inertia_damping", "velocity_limit", above=0.0, at_most=1.0)

    def start(self, start: Start) -> "_ParticleSwarmSearch":
        return _ParticleSwarmSearch(self, start)


@dataclass(frozen=True, kw_only=True, slots=True)
class ConstantInertiaSwarm(ParticleSwarm):
    """Global-best particle swarm `pso`, with the constant inertia weight of 1 that Gupta, Pratihar, Deb (2023) print."""

    inertia_damping: float = 1.0
    name: ClassVar[str] = "pso-constant"


def move(X: Array, V: Array, to_own: Array, to_swarm: Array, inertia: float, limit: Array) -> tuple[Array, Array]:
    """Return new positions and velocities (P, n) after one iteration, regardless of the bounds.

    Pulls to a particle's and to the swarm's best (P, n) are random weights times distances; the limit (n,) is the largest speed.

    Source:
        Kennedy, Eberhart (1995), with the inertia weight of Shi, Eberhart (1998).
    """
    V = np.clip(inertia * V + to_own + to_swarm, -limit, limit)
    return X + V, V


def reflect(X: Array, V: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return positions (P, n) clipped to the bounds (n,), and velocities (P, n) reversed where a bound was crossed."""
    inside = np.clip(X, lower, upper)
    return inside, np.where(inside == X, V, -V)


class _ParticleSwarmSearch(PopulationSearch[ParticleSwarm]):
    def __init__(self, settings: ParticleSwarm, start: Start) -> None:
        super().__init__(settings, start)
        self._limit = settings.velocity_limit * (start.upper - start.lower)
        self._inertia = settings.inertia
        self._V = np.zeros_like(start.initial)
        unknown = np.full(len(start.initial), np.inf)
        self._own = Points(start.initial, unknown, unknown)

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        improved = rule.better(f, violation, self._own.f, self._own.violation)
        self._own = self._own.replace_rows(improved, Points(X, f, violation))
        leader = self._own.X[rule.best(self._own.f, self._own.violation)]

        settings, start = self._settings, self._start
        r1, r2 = start.rng.random((2, *X.shape))
        to_own = settings.cognitive * r1 * (self._own.X - X)
        to_swarm = settings.social * r2 * (leader - X)
        moved, V = move(X, self._V, to_own, to_swarm, self._inertia, self._limit)
        self._X, self._V = reflect(moved, V, start.lower, start.upper)
        self._inertia *= settings.inertia_damping
