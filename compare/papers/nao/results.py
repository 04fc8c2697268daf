"""Results of Gupta, Pratihar, Deb (2023) in both readings: printed solutions, optima, sweeps, simulations, runs of searches."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from compare.papers.paper import read_rows
from compare.papers.paper_runs import (
    Effort,
    Runner,
    Runs,
    choose_best,
    collect_cloud,
    evaluate_point,
    make_computation,
    make_search_tasks,
    make_start_tasks,
    simulate_point,
)
from compare.study.memo import Computation
from compare.study.record import RunRecord
from compare.study.run import IPOPT, ProblemSpec, Run
from metaheuristics import GeneticAlgorithm
from metaheuristics.algorithms.genetic import SimulatedBinary
from metaheuristics.registry import make_algorithm
from nlp_gait.formulation.signals import Signals

FOLDER = Path(__file__).parent
PENALTY_W = 100.0  # per unit of violation
PHASES = {"ssp": "single support", "dsp": "double support"}
MARGINS = tuple(f"dbm_{axis}_{kind}_m" for kind in ("min", "mean") for axis in "xy")
INDEXES = ("power_W", "torque_change_Nm", *MARGINS)
RECONSTRUCTED, PHYSICAL = READINGS = {
    "reconstructed": "ten samples, (19) and (20) with g = 9.8, 23 masses in double support: what gives the printed margins",
    "physical": "ten intervals, physical gravity, all masses",
}
PRINTED_OPTIONS: Mapping[str, Any] = {"intervals": 9, "zmp_gravity": "printed"}
SEARCHES = {"PSO": "pso", "GA": "ga"}  # the latter names have colours
# Searches by reading of the claims on runs: swarm, GA, and words. All are in the reconstructed reading.
OPEN_GA = "the GA's settings"
COMPARED = {
    "damped": (
        "pso",
        "ga",
        "PSO with the damping of the cited code; GA with Deb's rules; the best of parents and children survive",
    ),
    "constant": ("pso-constant", "ga", "PSO with the printed inertia weight of 1"),
    "all crossed": ("pso", "ga-crossed", "as damped; the GA crosses every pair"),
    "one elite": ("pso", "ga-elite", "as damped; children replace all parents of the GA but the best"),
    "no elite": ("pso", "ga-generational", "as damped; children replace all parents of the GA"),
    "penalty": ("pso", "ga-penalty", f"as damped; the GA adds {PENALTY_W:g} W times the violation to the power"),
}
TIMES = {"ssp": "single_support_time_s", "dsp": "double_support_time_s"}
HIPS_M = (0.256, 0.27, 0.29, 0.31)
SWEEPS: Mapping[tuple[str, str], tuple[str, tuple[float, ...]]] = {
    ("hip", "ssp"): ("hip_height_m", HIPS_M),
    ("hip", "dsp"): ("hip_height_m", HIPS_M),
    ("time", "ssp"): (TIMES["ssp"], (0.7, 1.0, 2.0, 4.0)),
    ("time", "dsp"): (TIMES["dsp"], (0.3, 0.5, 1.0, 2.0)),
    ("swing", "ssp"): ("swing_height_m", (0.024, 0.028)),
    ("gap", "dsp"): (TIMES["dsp"], (0.8, 1.1, 1.2, 1.3, 1.4, 1.6, 1.8)),
}


@dataclass(frozen=True, kw_only=True)
class NaoEffort(Effort):
    """Effort of the reproduction; what does not depend on runs of the searches is the same in each."""

    variant_runs: int = 22  # of each other GA
    evaluations: int = 10_000  # of a search, as in the paper
    starts: int = 3  # of IPOPT at each optimum from random points, and at most one for each point of a sweep


# Variables in the problem's order, and figures, of each printed solution
SOLUTIONS = {(row["phase"], row["search"]): row for row in read_rows(FOLDER / "solutions.csv")}
PRINTED_X = {key: tuple(map(float, row["x"].split())) for key, row in SOLUTIONS.items()}
PRINTED = {key: {index: float(row[index]) for index in INDEXES} for key, row in SOLUTIONS.items()}


def make_spec(phase: str, reading: str, label: str = "", **options: Any) -> ProblemSpec:
    """Return the problem of a phase in a reading, with further options."""
    printed = {**PRINTED_OPTIONS, **({"zmp_masses": 23} if phase == "dsp" else {})}
    chosen = {**(printed if reading == RECONSTRUCTED else {}), **options}
    return ProblemSpec(name=f"nao-{phase}", options=chosen, label=f"nao-{phase}-{reading}{label}")


def list_sweep(reading: str, what: str, phase: str) -> dict[float, ProblemSpec]:
    """Return the problems of a sweep by the value of the fixed variable."""
    variable, values = SWEEPS[what, phase]
    specs = {value: make_spec(phase, reading, f"-{what}-{value:g}") for value in values}
    return {
        value: replace(spec, values={f"{variable}.{end}": value for end in ("lower", "upper")})
        for value, spec in specs.items()
    }


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoResults:
    """Results of one reading."""

    reading: str
    runs: Runs
    computed: Mapping[str, Any] = field(default_factory=dict)  # by name
    searches: Mapping[str, str] = field(default_factory=dict)  # labels of the runs of PSO and GA; empty without runs

    def _change(self, phase: str, search: str, changes: Mapping[str, float]) -> list[float]:
        names = make_spec(phase, self.reading).load().names
        return list({**dict(zip(names, PRINTED_X[phase, search], strict=True)), **changes}.values())

    def measure(self, phase: str, search: str = "PSO", /, **changes: float) -> Mapping[str, float]:
        """Return the figures of a printed solution, with other values of some variables."""
        return evaluate_point(make_spec(phase, self.reading), self._change(phase, search, changes))

    def sample(self, phase: str, search: str = "PSO", /, **changes: float) -> Signals:
        """Return the signals of a printed solution, with other values of some variables."""
        return make_spec(phase, self.reading).load().signals(self._change(phase, search, changes))

    def best(self, spec: ProblemSpec) -> RunRecord:
        """Return IPOPT's best run."""
        return choose_best(self.runs[spec.title, IPOPT])

    def sweep(self, what: str, phase: str) -> list[tuple[float, float]]:
        """Return values of the variable of a sweep and the least power there, where there is a gait."""
        ends = {value: self.best(spec) for value, spec in list_sweep(self.reading, what, phase).items()}
        return [(value, end.objective) for value, end in ends.items() if end.feasible]

    def list_runs(self, phase: str, search: str) -> list[RunRecord]:
        """Return the runs of a search."""
        return self.runs[f"nao-{phase}-{self.reading}", self.searches[search]]

    def final_powers(self, phase: str, search: str) -> list[float]:
        """Return the power at the end of each run [W]; infinite without a feasible solution."""
        return [run.objective if run.feasible else math.inf for run in self.list_runs(phase, search)]


def _make_start_tasks(effort: NaoEffort) -> Iterator[Run]:
    for reading in READINGS:
        for phase in PHASES:
            yield from _start_from_print(make_spec(phase, reading), phase, effort.starts)
        for what, phase in SWEEPS:
            if what != "gap" or reading == RECONSTRUCTED:
                for spec in list_sweep(reading, what, phase).values():
                    yield from _start_from_print(spec, phase, min(effort.starts, 1))


def _start_from_print(spec: ProblemSpec, phase: str, random: int) -> list[Run]:
    problem = spec.load()
    first = problem.by_name(np.clip(PRINTED_X[phase, "PSO"], problem.lower, problem.upper))
    settings = {"compiled": False}  # compiling takes longer than it saves
    return make_start_tasks(spec, random, first=[first], settings=settings)


def compute(runner: Runner, effort: NaoEffort) -> dict[str, NaoResults]:
    """Return results by reading, and by what is compared where there are runs."""
    runs = runner.run_tasks(_make_start_tasks(effort))
    computed = runner.compute([*_make_computations(effort)])
    results = {reading: NaoResults(reading=reading, runs=runs, computed=computed) for reading in READINGS}
    if not effort.runs:
        return results
    runs |= runner.run_tasks([*_make_search_tasks(effort)])
    labels = {name: {"PSO": swarm, "GA": ga} for name, (swarm, ga, _) in COMPARED.items()}
    return results | {name: replace(results[RECONSTRUCTED], searches=chosen) for name, chosen in labels.items()}


def _make_search_tasks(effort: NaoEffort) -> Iterator[Run]:
    main = {name: make_algorithm(name) for name in ("pso", "pso-constant", "ga")}
    others = {
        "ga-crossed": GeneticAlgorithm(crossover=SimulatedBinary(probability=1.0)),
        "ga-elite": GeneticAlgorithm(survival="generational"),
        "ga-generational": GeneticAlgorithm(survival="generational", elites=0),
    }
    for phase in PHASES:
        spec = make_spec(phase, RECONSTRUCTED)
        yield from make_search_tasks(spec, main, effort.runs, effort.evaluations)
        yield from make_search_tasks(spec, others, effort.variant_runs, effort.evaluations)
        for task in make_search_tasks(spec, {"ga-penalty": main["ga"]}, effort.variant_runs, effort.evaluations):
            yield replace(task, handling=f"penalty={PENALTY_W}")


def _make_computations(effort: NaoEffort) -> Iterator[tuple[str, Computation]]:
    """Yield simulations of the printed solutions, and clouds of all gaits that a search finds."""
    for phase in PHASES:
        spec = make_spec(phase, RECONSTRUCTED)
        for search, algorithm in SEARCHES.items():
            x, cloud = PRINTED_X[phase, search], {"algorithm": algorithm, "evaluations": effort.evaluations}
            yield make_computation(f"simulation-{phase}-{search}", spec, partial(simulate_point, spec), x=x)
            yield make_computation(f"cloud-{phase}-{search}", spec, partial(collect_cloud, spec), **cloud)
