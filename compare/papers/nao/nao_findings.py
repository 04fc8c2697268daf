"""All results of the reproduced NAO paper, and what tables, figures and claims read from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compare.analysis.statistics.inference import RankSum, rank_sum_normal
from compare.judge import evaluate
from compare.papers.nao.nao_paper import PrintedPhase
from compare.papers.nao.nao_runs import Held, power_with_legs_twice
from compare.papers.paper_runs import best
from compare.study.record import RunRecord, Verdict
from nlp_gait.formulation import Array, GaitProblem

NAMES = {"pso": "PSO", "ga": "GA", "ipopt": "IPOPT"}
FINE = 2001  # points at which a line between the points of a sweep is read
# Solutions that cost at most this share more than the best one lie where IPOPT's line bends most.
CHEAP = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Feasible solutions that all runs of one algorithm evaluated: x (m, n) and power (m,) [W], run (m,)."""

    x: Array
    power_W: Array
    run: Array

    def cheapest_near(self, position: int, value: float, tolerance: float, run: int | None = None) -> float:
        """Least power of the solutions whose variable lies within a tolerance of a value; NaN if there are none."""
        near = np.abs(self.x[:, position] - value) <= tolerance
        if run is not None:
            near &= self.run == run
        return float(self.power_W[near].min()) if near.any() else math.nan


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseFindings:
    """Results of one support phase.

    Attributes:
        paper: what is printed.
        problem: as it is here.
        searches: runs by algorithm, in the order of their seeds; equal runs start from the same population.
        starts: of IPOPT.
        sweeps: by position in x, IPOPT's optima over that variable.
        points: by algorithm.
    """

    paper: PrintedPhase
    problem: GaitProblem
    searches: Mapping[str, Sequence[RunRecord]]
    starts: Sequence[RunRecord]
    sweeps: Mapping[int, Sequence[Held]]
    points: Mapping[str, Points]

    @cached_property
    def optimum(self) -> RunRecord:
        """Best start of IPOPT."""
        return best(self.starts)

    @cached_property
    def converged(self) -> int:
        """Starts of IPOPT that end within 1e-5 of the best."""
        return sum(start.claimed and start.verdict.objective <= self.best * (1 + 1e-5) for start in self.starts)

    def final_powers(self, algorithm: str) -> list[float]:
        """Power at the end of each run [W]; infinite without a feasible solution."""
        return [run.verdict.objective if run.verdict.feasible else math.inf for run in self.searches[algorithm]]

    def median_run(self, algorithm: str) -> int:
        """Number of the run of median power, which the paper tables."""
        powers = self.final_powers(algorithm)
        return int(np.argsort(powers, kind="stable")[(len(powers) - 1) // 2])

    def median(self, algorithm: str) -> RunRecord:
        """Run of median power."""
        return self.searches[algorithm][self.median_run(algorithm)]

    def median_index(self, algorithm: str, name: str) -> float:
        """Median of a performance figure over the final solutions of all runs."""
        return float(np.median([run.verdict.indexes[name] for run in self.searches[algorithm]]))

    @cached_property
    def printed_here(self) -> dict[str, Verdict]:
        """The paper's solutions as the judge finds them here, by algorithm."""
        return {name: Verdict.of(evaluate(self.problem, optimum.x)) for name, optimum in self.paper.optima.items()}

    @cached_property
    def printed_with_legs_twice(self) -> dict[str, float]:
        """Power of the paper's solutions if the legs' mechanical term counted twice [W]."""
        return {name: power_with_legs_twice(self.problem, o.x) for name, o in self.paper.optima.items()}

    @cached_property
    def test(self) -> RankSum:
        """PSO against GA."""
        return rank_sum_normal(self.final_powers("pso"), self.final_powers("ga"))

    def range_within(self, position: int, share: float) -> tuple[float, float]:
        """Least and greatest value of a variable at which IPOPT's line is at most a share above the best."""
        at, power = self._line(position)
        fine = np.linspace(at[0], at[-1], FINE)
        good = fine[np.interp(fine, at, power) <= self.best * (1 + share)]
        return (float(good.min()), float(good.max())) if len(good) else (math.nan, math.nan)

    @property
    def best(self) -> float:
        """Power of IPOPT's best start [W]."""
        return self.optimum.verdict.objective

    def share_below(self, position: int) -> float:
        """How far a feasible solution of a search lies below IPOPT's line at most, relative to it; 0 if none does.

        Between the points of the sweep the line is straight, so that it may cut off the inside of a curve.
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
class Findings:
    """All results.

    Attributes:
        ssp: single support.
        dsp: double support.
        swing: IPOPT's optima of single support over the paper's swing heights.
        durations: likewise over durations.
        lever: IPOPT's starts for double support with the lever rule for the torso's share.
    """

    ssp: PhaseFindings
    dsp: PhaseFindings
    swing: Sequence[Held]
    durations: Sequence[Held]
    lever: Sequence[RunRecord]

    @property
    def phases(self) -> tuple[PhaseFindings, PhaseFindings]:
        """Both phases."""
        return self.ssp, self.dsp


def sweep_values(points: Mapping[str, Points], position: int, optimum: float, counts: tuple[int, int]) -> list[float]:
    """Values of a variable for a sweep, ascending.

    Args:
        points: feasible solutions by algorithm.
        position: of the variable in x.
        optimum: value at IPOPT's optimum, which is one of them.
        counts: how many over the whole range of the solutions, and how many over the range of the cheap ones.
    """
    values = np.concatenate([p.x[:, position] for p in points.values()])
    power = np.concatenate([p.power_W for p in points.values()])
    cheap = values[power <= (1 + CHEAP) * power.min()]
    parts = [np.linspace(part.min(), part.max(), count) for part, count in zip((values, cheap), counts, strict=True)]
    return np.unique(np.clip([*np.concatenate(parts), optimum], values.min(), values.max())).tolist()
