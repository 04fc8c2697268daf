"""Findings of the reproduction of the NAO paper: all results, and what tables, figures and claims read from them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from compare.analysis.record_statistics import RankSum, approximate_rank_sum
from compare.papers.nao.nao_runs import PAPER, SWING_HEIGHT, FixedOptimum, PrintedPhase, evaluate_indexes
from compare.papers.paper_runs import choose_best
from compare.study.record import RunRecord, Verdict
from compare.study.references import find_reference
from compare.study.task import ProblemSpec
from nlp_gait.backends.identity import identify_problem
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.signals import Signals

NAMES = {"pso-constant": "PSO, constant weight", "pso": "PSO, damped", "ga": "GA", "ipopt": "IPOPT"}
FINE = 2001  # points at which a line between the points of a sweep is read
READING_TOLERANCE_M = 5e-4  # within which a solution counts as having a swing height
# IPOPT's line bends most where solutions cost at most this share more than the best one.
CHEAP = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class FeasiblePoints:
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
    sweeps: Mapping[int, Sequence[FixedOptimum]]  # IPOPT's optima over each variable, by its position in x
    points: Mapping[str, FeasiblePoints]  # by search
    variants: Mapping[str, Sequence[RunRecord]]  # runs of the searches with other choices
    choices: Mapping[str, ProblemSpec]  # the phase with each other choice of ``nao_paper.toml``
    choice_starts: Mapping[str, Sequence[RunRecord]]  # of IPOPT, for the choices with an optimum
    simulations: Mapping[str, Mapping[str, Any]]  # of the printed solutions, by search

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
        ends = [run.verdict for run in {**self.searches, **self.variants}[algorithm]]
        return [end.objective if end.feasible else math.inf for end in ends]

    @property
    def feasible_ends(self) -> list[Verdict]:
        """The feasible ones of the ends of all runs of the searches."""
        return [run.verdict for runs in self.searches.values() for run in runs if run.verdict.feasible]

    def median_run(self, algorithm: str) -> int:
        """Return the number of the run of median power, which the paper's tables show."""
        powers = self.final_powers(algorithm)
        return int(np.argsort(powers, kind="stable")[(len(powers) - 1) // 2])

    def median(self, algorithm: str) -> RunRecord:
        """Return the run of median power."""
        return self.searches[algorithm][self.median_run(algorithm)]

    def gather_solutions(self, *, whole: bool) -> dict[str, Array]:
        """Return x (m, n) by search: the ends of its runs, or all feasible solutions that they evaluated."""
        if whole:
            return {name: points.x for name, points in self.points.items()}
        return {name: np.array([list(run.x.values()) for run in runs]) for name, runs in self.searches.items()}

    def list_swing_powers(self, algorithm: str, *, whole: bool = False) -> Array:
        """Return the least power of a search near each of the paper's swing heights [W]; NaN where it has no solution.

        It is read off the history of the run of median power, which Table 7 shows, or of all runs.
        """
        points, run = self.points[algorithm], None if whole else self.median_run(algorithm)
        heights = PAPER.swing_heights_m
        return np.array([points.cheapest_near(SWING_HEIGHT, at, READING_TOLERANCE_M, run) for at in heights])

    @cached_property
    def printed_here(self) -> dict[str, Mapping[str, float]]:
        """Performance figures of the paper's solutions, by search."""
        return {name: evaluate_indexes(self.problem, optimum.x) for name, optimum in self.paper.optima.items()}

    @cached_property
    def printed_by_choice(self) -> dict[str, dict[str, Mapping[str, float]]]:
        """The same with each other choice, by choice and search."""
        return {
            choice: {name: evaluate_indexes(spec.load(), optimum.x) for name, optimum in self.paper.optima.items()}
            for choice, spec in self.choices.items()
        }

    def optimum_with(self, choice: str) -> RunRecord | None:
        """Return IPOPT's best start with another choice; None if it was not solved."""
        return choose_best(self.choice_starts[choice]) if choice in self.choice_starts else None

    @property
    def lowest_hip_m(self) -> float:
        """Lowest hip of the sweep for which IPOPT finds a gait [m]."""
        return min(point.at for point in self.sweeps[0] if point.feasible)

    @cached_property
    def printed_pso(self) -> dict[str, float]:
        """The paper's PSO solution by name of the variable."""
        return self.problem.by_name(self.problem.check_x(self.paper.optima["pso"].x))

    def evaluate_printed(self, **changes: float) -> Mapping[str, float]:
        """Return the performance figures of the paper's PSO solution with other values of some variables, by name."""
        return evaluate_indexes(self.problem, list((self.printed_pso | changes).values()))

    def sample_printed(self, **changes: float) -> Signals:
        """Return the signals of the paper's PSO solution with other values of some variables, by name."""
        return self.problem.signals(list((self.printed_pso | changes).values()))

    def test(self, algorithm: str, other: str = "ga") -> RankSum:
        """Return the rank-sum test of a search's powers against another's."""
        return approximate_rank_sum(self.final_powers(algorithm), self.final_powers(other))

    def range_within(self, position: int, share: float) -> tuple[float, float]:
        """Return the least and the greatest value of a variable at which IPOPT's line is at most a share above the best."""
        at, power = self._line(position)
        fine = np.linspace(at[0], at[-1], FINE)
        good = fine[np.interp(fine, at, power) <= self.best * (1 + share)]
        return (float(good.min()), float(good.max())) if len(good) else (math.nan, math.nan)

    @cached_property
    def best(self) -> float:
        """Least known power [W]: the shipped one of exactly this problem, or that of IPOPT's best start."""
        known = find_reference(identify_problem(self.problem)).objective
        found = self.optimum.verdict.objective
        return found if known is None else min(found, known)

    def compute_least_speed(self, x: Mapping[str, float]) -> float:
        """Return the least forward velocity of the hip in a gait, between the samples too [m/s]."""
        hip = self.problem.signals(self.problem.check_x(list(x.values()))).arrays["hip"][:, 0]
        first, last = x["hip_vx_start_m_s"], x["hip_vx_end_m_s"]
        mean, t = (hip[-1] - hip[0]) / x[self.problem.names[self.paper.duration]], np.linspace(0.0, 1.0, 101)
        bend = 3 * (first + last - 2 * mean)
        return float((first + (last - first - bend) * t + bend * t**2).min())

    def share_below(self, position: int) -> float:
        """Return how far a feasible solution of a search lies below IPOPT's line at most, relative to it; 0 if none does.

        Between the points of the sweep the line is straight, so it may cut off the inside of a curve.
        """
        at, power = self._line(position)
        below = [1 - (p.power_W / np.interp(p.x[:, position], at, power)).min() for p in self.points.values()]
        return max(0.0, *below)

    def _line(self, position: int) -> Array:
        """IPOPT's feasible optima over a variable (2, m): its values, ascending, and power [W]."""
        return np.array([(p.at, p.power_W) for p in self.sweeps[position] if p.feasible]).T


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoFindings:
    """All results."""

    ssp: PhaseFindings  # single support
    dsp: PhaseFindings  # double support
    swing: Sequence[FixedOptimum]  # IPOPT's optima of single support over the paper's swing heights
    durations: Sequence[FixedOptimum]  # likewise over durations
    others: Mapping[str, "NaoFindings"] = field(default_factory=dict)  # with other choices, by choice

    @property
    def phases(self) -> tuple[PhaseFindings, PhaseFindings]:
        """Single and double support."""
        return self.ssp, self.dsp

    @cached_property
    def torque_changes_Nm(self) -> dict[str, tuple[float, float]]:
        """Torque change of the printed solutions of double support, by candidate for its cause and search."""
        changes = dict(PAPER.torque_changes_Nm)
        for name, found in self.dsp.printed_by_choice.items():
            changes[PAPER.choices[name].title] = found["pso"]["torque_change_Nm"], found["ga"]["torque_change_Nm"]
        return changes

    def swing_power(self, height_m: float) -> float:
        """Return the least power at one of the paper's swing heights [W]."""
        return next(point.power_W for point in self.swing if point.at == height_m)


def choose_sweep_values(
    points: Mapping[str, FeasiblePoints], position: int, optimum: float, counts: tuple[int, int]
) -> list[float]:
    """Return values of the variable at a position for a sweep, ascending, with that at IPOPT's optimum.

    Counts are the numbers of values over the range of all solutions, and over that of the cheap ones.
    """
    values = np.concatenate([p.x[:, position] for p in points.values()])
    power = np.concatenate([p.power_W for p in points.values()])
    cheap = values[power <= (1 + CHEAP) * power.min()]
    parts = [np.linspace(part.min(), part.max(), count) for part, count in zip((values, cheap), counts, strict=True)]
    return np.unique(np.clip([*np.concatenate(parts), optimum], values.min(), values.max())).tolist()
