"""All results of the reproduced NAO paper, and what tables, figures and claims read from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compare.reproductions.nao_paper import PrintedPhase
from compare.reproductions.nao_runs import Run, grid, judged, power_with_legs_twice
from compare.statistics.rank_sum_normal import RankSum, rank_sum_normal
from nlp_gait.problems.gait_problem import Array, GaitProblem

ALGORITHMS = ("pso", "ga")
NAMES = {"pso": "PSO", "ga": "GA", "ipopt": "IPOPT"}


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
    searches: Mapping[str, Sequence[Run]]
    starts: Sequence[Run]
    sweeps: Mapping[int, Sequence[Run]]
    points: Mapping[str, Points]

    @cached_property
    def optimum(self) -> Run:
        """Best start of IPOPT."""
        return min(self.starts, key=lambda start: (not start["success"], start["power_W"]))

    @cached_property
    def converged(self) -> int:
        """Starts of IPOPT that end within 1e-5 of the best."""
        best = self.optimum["power_W"]
        return sum(start["success"] and start["power_W"] <= best * (1 + 1e-5) for start in self.starts)

    def final_powers(self, algorithm: str) -> list[float]:
        """Power at the end of each run [W]; infinite without a feasible solution."""
        return [run["power_W"] if run["feasible"] else math.inf for run in self.searches[algorithm]]

    def median_run(self, algorithm: str) -> int:
        """Number of the run of median power, which the paper tables."""
        powers = self.final_powers(algorithm)
        return int(np.argsort(powers, kind="stable")[(len(powers) - 1) // 2])

    def median(self, algorithm: str) -> Run:
        """Run of median power."""
        return self.searches[algorithm][self.median_run(algorithm)]

    def median_index(self, algorithm: str, name: str) -> float:
        """Median of a performance figure over the final solutions of all runs."""
        return float(np.median([run["indexes"][name] for run in self.searches[algorithm]]))

    @cached_property
    def printed_here(self) -> dict[str, Run]:
        """The paper's solutions as the judge finds them here, by algorithm."""
        return {name: judged(self.problem, optimum.x) for name, optimum in self.paper.optima.items()}

    @cached_property
    def printed_with_legs_twice(self) -> dict[str, float]:
        """Power of the paper's solutions if the legs' mechanical term counted twice [W]."""
        return {name: power_with_legs_twice(self.problem, o.x) for name, o in self.paper.optima.items()}

    @cached_property
    def test(self) -> RankSum:
        """PSO against GA."""
        return rank_sum_normal(self.final_powers("pso"), self.final_powers("ga"))

    def range_within(self, position: int, share: float) -> tuple[float, float]:
        """Values of a variable at which IPOPT's optimum costs at most a share more than the best, on the sweep's grid."""
        good = [p["at"] for p in self.sweeps[position] if p["feasible"] and p["power_W"] <= self.best * (1 + share)]
        return (min(good), max(good)) if good else (math.nan, math.nan)

    @property
    def best(self) -> float:
        """Power of IPOPT's best start [W]."""
        return float(self.optimum["power_W"])

    def share_below(self, position: int) -> float:
        """How far a feasible solution of a search lies below IPOPT's line at most, relative to it; 0 if none does.

        Between the points of the sweep the line is straight, so that it may cut off the inside of a curve.
        """
        line = [p for p in self.sweeps[position] if p["feasible"]]
        at, power = [p["at"] for p in line], [p["power_W"] for p in line]
        if len(line) < 2:
            return 0.0
        below = [1 - (p.power_W / np.interp(p.x[:, position], at, power)).min() for p in self.points.values()]
        return max(0.0, *below)


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
    swing: Sequence[Run]
    durations: Sequence[Run]
    lever: Sequence[Run]

    @property
    def phases(self) -> tuple[PhaseFindings, PhaseFindings]:
        """Both phases."""
        return self.ssp, self.dsp


def feasible_range(points: Mapping[str, Points], position: int, count: int) -> list[float]:
    """Values over the range of the feasible solutions that any algorithm evaluated."""
    columns = [p.x[:, position] for p in points.values()]
    return grid(min(float(c.min()) for c in columns), max(float(c.max()) for c in columns), count)
