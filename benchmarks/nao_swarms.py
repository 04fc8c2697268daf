"""Searches of the NAO paper by rules that `reproduce` does not have: ``python -m benchmarks.nao_swarms``.

The swarm's best updated after every particle, velocities that are kept at a bound, and margins that are zero outside the sole.
Prints a table in Markdown: median power of eleven runs, and p of the rank-sum test against our rules, and against GA by the
same margins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar
from unittest.mock import patch

import casadi as ca
import numpy as np

import nlp_gait
from compare.analysis.record_statistics import approximate_rank_sum
from metaheuristics import ParticleSwarm, minimize
from metaheuristics.algorithms import particle_swarm
from metaheuristics.algorithms.genetic import GeneticAlgorithm
from metaheuristics.algorithms.particle_swarm import ConstantInertiaSwarm, move, reflect
from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from nlp_gait.gaits.biped.limits import BalanceMargins

RUNS, EVALUATIONS = 11, 10_000
LEAST_M = 1e-6  # that counts as a margin > 0


@dataclass(frozen=True, kw_only=True)
class AsynchronousSwarm(ParticleSwarm):
    """The swarm's best is updated after every particle, as in the code that the paper cites."""

    name: ClassVar[str] = "asynchronous"

    def start(self, start: Start) -> AsynchronousSearch:  # type: ignore[override]
        """Begin a run."""
        return AsynchronousSearch(self, start)


class AsynchronousSearch(PopulationSearch[AsynchronousSwarm]):
    """Evaluates the first swarm at once, and then one particle after the other."""

    def __init__(self, settings: AsynchronousSwarm, start: Start) -> None:
        super().__init__(settings, start)
        self._limit, self._inertia = settings.velocity_limit * (start.upper - start.lower), settings.inertia
        self._V, self._at, self._turn = np.zeros_like(start.initial), start.initial.copy(), -1

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        """Learn from the particle that has moved, and move the next one."""
        if self._turn < 0:
            self._own, self._f, self._violation = X.copy(), f.copy(), violation.copy()
            self._leader = rule.best(f, violation)
        else:
            k = self._turn
            if rule.better(f, violation, self._f[[k]], self._violation[[k]])[0]:
                self._own[k], self._f[k], self._violation[k] = X[0], f[0], violation[0]
                best = [self._leader]
                if rule.better(f, violation, self._f[best], self._violation[best])[0]:
                    self._leader = k
        self._turn = (self._turn + 1) % len(self._own)
        self._move(self._turn)

    def _move(self, k: int) -> None:
        settings, start = self._settings, self._start
        if k == 0 and np.any(self._V):
            self._inertia *= settings.inertia_damping
        r1, r2 = start.rng.random((2, 1, self._own.shape[1]))
        x = self._at[[k]]
        to_own = settings.cognitive * r1 * (self._own[[k]] - x)
        to_swarm = settings.social * r2 * (self._own[[self._leader]] - x)
        moved, V = move(x, self._V[[k]], to_own, to_swarm, self._inertia, self._limit)
        self._X, V = reflect(moved, V, start.lower, start.upper)
        self._at[k], self._V[k] = self._X[0], V[0]


def keep_velocities(X: Array, V: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Clip positions, and leave velocities as they are."""
    return np.clip(X, lower, upper), V


def load_with_zero_margins(phase: str) -> nlp_gait.GaitProblem:
    """Return a phase whose margins are zero outside the sole and must be positive, (21) and (22) as printed."""
    usual = BalanceMargins.__init__

    def clip(self: BalanceMargins, margins: Callable[..., Any], means: tuple[float, float]) -> None:
        usual(self, lambda *at: tuple(ca.fmax(margin, 0.0) for margin in margins(*at)), means)

    with patch.object(BalanceMargins, "__init__", clip):
        problem = nlp_gait.load(phase)
        problem.signals(np.array([problem.lower, problem.upper]).mean(axis=0))  # builds it
        nlp_gait.compile_objective(problem)
    return problem.with_values(dbm_x_min_limit_m=LEAST_M, dbm_y_min_limit_m=LEAST_M)


def run(problem: nlp_gait.GaitProblem, algorithm: Any) -> list[float]:
    """Return the powers at the ends of eleven runs [W]; infinite without a feasible point."""
    objective = nlp_gait.compile_objective(problem, threads=1)
    ends = [minimize(objective, algorithm, evaluations=EVALUATIONS, seed=seed) for seed in range(RUNS)]
    return [end.objective if end.violation == 0.0 else float("inf") for end in ends]


def main() -> None:
    """Run everything and print the table."""
    print("| phase | rules | search | median [W] | p against ours | p against GA |\n| - | - | - | - | - | - |")
    for phase in ("nao-ssp", "nao-dsp"):
        problem, zero = nlp_gait.load(phase), load_with_zero_margins(phase)
        ga = {"margins zero outside the sole": run(zero, GeneticAlgorithm()), "ours": run(problem, GeneticAlgorithm())}
        for name, algorithm, damping in (
            ("PSO, constant weight", ConstantInertiaSwarm(), 1.0),
            ("PSO, damped", ParticleSwarm(), 0.99),
            ("GA", GeneticAlgorithm(), None),
        ):
            ours = run(problem, algorithm)
            found = {"ours": ours, "margins zero outside the sole": run(zero, algorithm)}
            if damping is not None:
                found["best updated after every particle"] = run(problem, AsynchronousSwarm(inertia_damping=damping))
                with patch.object(particle_swarm, "reflect", keep_velocities):
                    found["velocities kept at a bound"] = run(problem, algorithm)
            for rules, powers in found.items():
                p = [approximate_rank_sum(powers, other).p_two_sided for other in (ours, ga.get(rules, ga["ours"]))]
                print(f"| {phase} | {rules} | {name} | {np.median(powers):.5f} | {p[0]:.2g} | {p[1]:.2g} |", flush=True)


if __name__ == "__main__":
    main()
