"""Results of Gupta, Pratihar, Deb (2023) in both readings: printed solutions, optima, sweeps, and runs of the searches."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.papers.paper import read_rows
from compare.papers.paper_runs import (
    Effort,
    Runner,
    Runs,
    choose_best,
    evaluate_point,
    make_search_tasks,
    make_start_tasks,
)
from compare.study.record import RunRecord
from compare.study.run import IPOPT, ProblemSpec, Run
from metaheuristics.registry import make_algorithm
from nlp_gait.formulation.signals import Signals

FOLDER = Path(__file__).parent
SOLUTIONS = FOLDER / "solutions.csv"
PHASES = {"ssp": "single support", "dsp": "double support"}
MARGINS = tuple(f"dbm_{axis}_{kind}_m" for kind in ("min", "mean") for axis in "xy")
KINDS = {"power": "power_W", "torque": "torque_change_Nm"}
INDEXES = (*KINDS.values(), *MARGINS)
READINGS = {
    "printed": "ten samples, (19) and (20) with g = 9.8 as printed, 23 masses in double support",
    "physical": "ten intervals, physical gravity, all masses",
}
PRINTED_OPTIONS: Mapping[str, Any] = {"intervals": 9, "zmp_gravity": "printed"}
SEARCHES = ("PSO", "GA")
SWARMS = {"constant": "pso-constant", "damped": "pso"}
TIMES = {"ssp": "single_support_time_s", "dsp": "double_support_time_s"}
HIPS_M = (0.256, 0.27, 0.29, 0.31)
SWEEPS: Mapping[tuple[str, str], tuple[str, tuple[float, ...]]] = {
    ("hip", "ssp"): ("hip_height_m", HIPS_M),
    ("hip", "dsp"): ("hip_height_m", HIPS_M),
    ("time", "ssp"): (TIMES["ssp"], (0.7, 1.0, 2.0, 4.0)),
    ("time", "dsp"): (TIMES["dsp"], (0.3, 0.5, 1.0, 2.0)),
    ("swing", "ssp"): ("swing_height_m", (0.024, 0.028)),
}
SHARES = [(share, arms) for share in ("printed", "lever") for arms in ("carried", "separate", "shared")]


@dataclass(frozen=True, kw_only=True)
class NaoEffort(Effort):
    """Effort of the reproduction; what does not depend on runs of the searches is the same in each."""

    evaluations: int = 10_000  # of a search, as in the paper
    starts: int = 3  # of IPOPT at each optimum from random points, and at most one for each point of a sweep


# Variables in the problem's order, and figures, of each printed solution
PRINTED_X = {(row["phase"], row["search"]): tuple(map(float, row["x"].split())) for row in read_rows(SOLUTIONS)}
PRINTED = {(row["phase"], row["search"]): {i: float(row[i]) for i in INDEXES} for row in read_rows(SOLUTIONS)}


def make_spec(phase: str, reading: str, label: str = "", **options: Any) -> ProblemSpec:
    """Return the problem of a phase in a reading, with further options."""
    printed = {**PRINTED_OPTIONS, **({"zmp_masses": 23} if phase == "dsp" else {})}
    chosen = {**(printed if reading == "printed" else {}), **options}
    return ProblemSpec(name=f"nao-{phase}", options=chosen, label=f"nao-{phase}-{reading}{label}")


def fix(spec: ProblemSpec, **variables: float) -> ProblemSpec:
    """Return the problem with fixed variables."""
    bounds = {f"{name}.{end}": value for name, value in variables.items() for end in ("lower", "upper")}
    return replace(spec, values={**spec.values, **bounds})


def list_sweep(reading: str, what: str, phase: str) -> list[ProblemSpec]:
    """Return the problems of a sweep."""
    variable, values = SWEEPS[what, phase]
    return [fix(make_spec(phase, reading, f"-{what}-{value:g}"), **{variable: value}) for value in values]


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoResults:
    """Results of one reading."""

    reading: str
    runs: Runs
    swarm: str = ""  # that is PSO; empty without runs

    def change(self, phase: str, search: str, changes: Mapping[str, float]) -> list[float]:
        """Return a printed solution with other values of some variables."""
        names = make_spec(phase, self.reading).load().names
        return list({**dict(zip(names, PRINTED_X[phase, search], strict=True)), **changes}.values())

    def measure(self, phase: str, search: str = "PSO", /, **changes: float) -> Mapping[str, float]:
        """Return the figures of a printed solution, with other values of some variables."""
        return evaluate_point(make_spec(phase, self.reading), self.change(phase, search, changes))

    def sample(self, phase: str, search: str = "PSO", /, **changes: float) -> Signals:
        """Return the signals of a printed solution, with other values of some variables."""
        return make_spec(phase, self.reading).load().signals(self.change(phase, search, changes))

    def best(self, spec: ProblemSpec) -> RunRecord:
        """Return IPOPT's best run."""
        return choose_best(self.runs[spec.title, IPOPT])

    def sweep(self, what: str, phase: str) -> list[tuple[float, float]]:
        """Return values of the variable of a sweep and the least power there, where there is a gait."""
        ends = [self.best(spec) for spec in list_sweep(self.reading, what, phase)]
        pairs = zip(SWEEPS[what, phase][1], ends, strict=True)
        return [(value, end.objective) for value, end in pairs if end.feasible]

    def excess(self, phase: str) -> float | None:
        """Return the power of PSO's printed solution above the optimum [%]; None without a feasible optimum."""
        best = self.best(make_spec(phase, self.reading))
        return 100 * (self.measure(phase)["power_W"] / best.objective - 1) if best.feasible else None

    def list_runs(self, phase: str, search: str) -> list[RunRecord]:
        """Return the runs of a search."""
        return self.runs[f"nao-{phase}-{self.reading}", self.swarm if search == "PSO" else "ga"]

    def final_powers(self, phase: str, search: str) -> list[float]:
        """Return the power at the end of each run [W]; infinite without a feasible solution."""
        ends = self.list_runs(phase, search)
        return [end.objective if end.feasible else math.inf for end in ends]


def _make_start_tasks(effort: NaoEffort) -> Iterator[Run]:
    for reading in READINGS:
        for phase in PHASES:
            yield from _start_from_print(make_spec(phase, reading), phase, effort.starts)
        for what, phase in SWEEPS:
            for spec in list_sweep(reading, what, phase):
                yield from _start_from_print(spec, phase, min(effort.starts, 1))
    for share, arms in SHARES:
        spec = make_spec("dsp", "printed", f"-{share}-{arms}", torso_share=share, arms=arms)
        mean = evaluate_point(spec, PRINTED_X["dsp", "PSO"])["dbm_y_mean_m"]
        spec = fix(replace(spec, values={"dbm_y_mean_limit_m": mean}), **{"hip_height_m": 0.31, TIMES["dsp"]: 2.0})
        yield from _start_from_print(spec, "dsp", min(effort.starts, 1))


def _start_from_print(spec: ProblemSpec, phase: str, random: int) -> Iterator[Run]:
    """Yield a run of IPOPT from PSO's printed solution, and others from random points."""
    problem, settings = spec.load(), {"compiled": False}  # compiling takes longer than it saves
    x = np.clip(PRINTED_X[phase, "PSO"], problem.lower, problem.upper)
    yield Run(problem=spec, solver=IPOPT, settings=settings, start=problem.by_name(x))
    for task in make_start_tasks(spec, random, settings=settings):
        yield replace(task, number=task.number + 1)


def compute(runner: Runner, effort: NaoEffort) -> dict[str, NaoResults]:
    """Return results by reading, and by reading and swarm where there are runs."""
    runs = runner.run_tasks(_make_start_tasks(effort))
    results = {reading: NaoResults(reading=reading, runs=runs) for reading in READINGS}
    if not effort.runs:
        return results
    algorithms = {name: make_algorithm(name) for name in (*SWARMS.values(), "ga")}
    specs = [make_spec(phase, reading) for reading in READINGS for phase in PHASES]
    searches = [make_search_tasks(spec, algorithms, effort.runs, effort.evaluations) for spec in specs]
    runs |= runner.run_tasks([task for tasks in searches for task in tasks])
    swarms = {f"{reading}, {label}": (reading, swarm) for reading in READINGS for label, swarm in SWARMS.items()}
    return results | {
        name: NaoResults(reading=reading, runs=runs, swarm=swarm) for name, (reading, swarm) in swarms.items()
    }
