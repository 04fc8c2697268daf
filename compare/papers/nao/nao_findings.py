"""Findings of the reproduction of the NAO paper: all results, and what tables, figures and claims read from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compare.analysis.statistics.inference import RankSum, rank_sum_normal
from compare.judge import evaluate
from compare.papers.nao.nao_paper import PrintedPhase
from compare.papers.nao.nao_runs import SweepPoint, compute_power_with_legs_twice
from compare.papers.paper_runs import choose_best
from compare.study.record import RunRecord, Verdict
from nlp_gait.formulation import Array, GaitProblem

NAMES = {"pso": "PSO", "ga": "GA", "ipopt": "IPOPT"}
FINE = 2001  # points at which a line between the points of a sweep is read
# IPOPT's line bends most where solutions cost at most this share more than the best one.
CHEAP = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Feasible solutions that all runs of one search evaluated: x (m, n), power (m,) [W] and run (m,)."""

    x: Array
    power_W: Array
    run: Array

    def cheapest_near(self, position: int, value: float, tolerance: float, run: int | None = None) -> float:
        """Return the least power of the solutions whose variable lies within a tolerance of a value; NaN if there is none."""
        near = np.abs(self.x[:, position] - value) <= tolerance
        if run is not None:
            near &= self.run == run
        return float(self.power_W[near].min()) if near.any() else math.nan


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseFindings:
    """Results of one support phase."""

    paper: PrintedPhase  # numbers in print
    problem: GaitProblem  # our problem
    # Runs by search, in the order of their seeds; equal runs start from the same population
    searches: Mapping[str, Sequence[RunRecord]]
    starts: Sequence[RunRecord]  # of IPOPT
    sweeps: Mapping[int, Sequence[SweepPoint]]  # IPOPT's optima over each variable, by its position in x
    points: Mapping[str, Points]  # by search

    @cached_property
    def optimum(self) -> RunRecord:
        """Best start of IPOPT."""
        return choose_best(self.starts)

    @cached_property
    def converged(self) -> int:
        """Number of IPOPT's starts that end within 1e-5 of the best."""
        return sum(start.claimed and start.verdict.objective <= self.best * (1 + 1e-5) for start in self.starts)

    def final_powers(self, algorithm: str) -> list[float]:
        """Return the power at the end of each run [W]; infinite without a feasible solution."""
        return [run.verdict.objective if run.verdict.feasible else math.inf for run in self.searches[algorithm]]

    def median_run(self, algorithm: str) -> int:
        """Return the number of the run of median power, which the paper's tables show."""
        powers = self.final_powers(algorithm)
        return int(np.argsort(powers, kind="stable")[(len(powers) - 1) // 2])

    def median(self, algorithm: str) -> RunRecord:
        """Return the run of median power."""
        return self.searches[algorithm][self.median_run(algorithm)]

    def median_index(self, algorithm: str, name: str) -> float:
        """Return the median of a performance figure over the final solutions of all runs."""
        return float(np.median([run.verdict.indexes[name] for run in self.searches[algorithm]]))

    @cached_property
    def printed_here(self) -> dict[str, Verdict]:
        """The judge's verdicts on the paper's solutions, by search."""
        return {
            name: Verdict.from_evaluation(evaluate(self.problem, optimum.x))
            for name, optimum in self.paper.optima.items()
        }

    @cached_property
    def printed_with_legs_twice(self) -> dict[str, float]:
        """Power of the paper's solutions with the legs' mechanical term counted twice [W], by search."""
        return {name: compute_power_with_legs_twice(self.problem, o.x) for name, o in self.paper.optima.items()}

    @cached_property
    def test(self) -> RankSum:
        """Rank-sum test of PSO's powers against GA's."""
        return rank_sum_normal(self.final_powers("pso"), self.final_powers("ga"))

    def range_within(self, position: int, share: float) -> tuple[float, float]:
        """Return the least and the greatest value of a variable at which IPOPT's line is at most a share above the best."""
        at, power = self._line(position)
        fine = np.linspace(at[0], at[-1], FINE)
        good = fine[np.interp(fine, at, power) <= self.best * (1 + share)]
        return (float(good.min()), float(good.max())) if len(good) else (math.nan, math.nan)

    @property
    def best(self) -> float:
        """Power of IPOPT's best start [W]."""
        return self.optimum.verdict.objective

    def share_below(self, position: int) -> float:
        """Return how far a feasible solution of a search lies below IPOPT's line at most, relative to it; 0 if none does.

        Between the points of the sweep the line is straight, so it may cut off the inside of a curve.
        """
        at, power = self._line(position)
        below = [1 - (p.power_W / np.interp(p.x[:, position], at, power)).min() for p in self.points.values()]
        return max(0.0, *below)

    def _line(self, position: int) -> tuple[Array, Array]:
        """IPOPT's feasible optima over a variable: its values, ascending, and power [W]."""
        line = [(p.at, p.power_W) for p in self.sweeps[position] if p.feasible]
        at, power = np.array(line).T
        return at, power


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoFindings:
    """All results."""

    ssp: PhaseFindings  # single support
    dsp: PhaseFindings  # double support
    swing: Sequence[SweepPoint]  # IPOPT's optima of single support over the paper's swing heights
    durations: Sequence[SweepPoint]  # likewise over durations
    lever: Sequence[RunRecord]  # IPOPT's starts for double support with the lever rule for the torso's share

    @property
    def phases(self) -> tuple[PhaseFindings, PhaseFindings]:
        """Single and double support."""
        return self.ssp, self.dsp

    def swing_power(self, height_m: float) -> float:
        """Return the least power at one of the paper's swing heights [W]."""
        return next(point.power_W for point in self.swing if point.at == height_m)


def choose_sweep_values(
    points: Mapping[str, Points], position: int, optimum: float, counts: tuple[int, int]
) -> list[float]:
    """Return values of a variable for a sweep, ascending.

    Args:
        points: feasible solutions by search.
        position: of the variable in x.
        optimum: value at IPOPT's optimum, which is added.
        counts: number of values over the range of all solutions, and over that of the cheap ones.
    """
    values = np.concatenate([p.x[:, position] for p in points.values()])
    power = np.concatenate([p.power_W for p in points.values()])
    cheap = values[power <= (1 + CHEAP) * power.min()]
    parts = [np.linspace(part.min(), part.max(), count) for part, count in zip((values, cheap), counts, strict=True)]
    return np.unique(np.clip([*np.concatenate(parts), optimum], values.min(), values.max())).tolist()
