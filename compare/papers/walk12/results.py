"""Results of the 12-joint walk by reading: printed gaits, optima, and runs of the GA."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.papers.paper import parse_settings, read_rows
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
from metaheuristics.algorithms.genetic import GoswamiGeneticAlgorithm
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_steps import compute_steps

FOLDER = Path(__file__).parent
READINGS = {row["name"]: row for row in read_rows(FOLDER / "readings.csv")}
OPTIONS = {name: parse_settings(row["option"])[0] for name, row in READINGS.items()}
LITERAL, RAISED, SECOND = "as printed", "ankle raised", "one second"
GA, GA_EVALUATIONS = GoswamiGeneticAlgorithm(), 930  # Table II: 30 epochs after the first population
F1MAX, F2MAX = 442.522, 0.13  # [1/(m^2 s)], [m]
NAMES = ("s", "n", "H", "h")  # of the variables in their order
UNBENT_WEIGHTS = (0.15, 0.9, 1.0)


@dataclass(frozen=True, slots=True)
class PaperRow:
    """A row of Table III or IV."""

    weight: float  # lambda
    step_time_s: float  # T
    s: float  # [m], as n, H and h
    n: float
    H: float
    h: float
    f1max: float  # f1 that counts as 1 [1/(m^2 s)]
    f: float  # the objective as printed

    @property
    def x(self) -> tuple[float, ...]:
        """The variables in the problem's order [m]."""
        return self.s, self.n, self.H, self.h

    @property
    def implied_f1(self) -> float:
        """The f1 with which (11) gives the printed f."""
        return (self.f - (1 - self.weight) * self.s / F2MAX) / self.weight * self.f1max


TABLE_3, TABLE_4 = (
    [PaperRow(*map(float, row.values())) for row in read_rows(FOLDER / f"{name}.csv")]
    for name in ("table_3", "table_4")
)
SMALL, SECOND_ROW, LAST = TABLE_3[0], TABLE_3[1], TABLE_3[-1]  # lambda 0.1, 0.15 and 1


@dataclass(frozen=True, kw_only=True)
class Walk12Effort(Effort):
    """Effort of the reproduction."""

    runs: int = 10  # of the GA on each problem
    starts: int = 10  # of IPOPT on each problem
    lengths_m: tuple[float, ...] = tuple(np.linspace(0.05, 0.13, 9).round(6).tolist())  # of the front


def compute_f1(row: PaperRow, **options: str) -> float:
    """Return f1 of a printed gait at its step time [1/(m^2 s)]."""
    spec = ProblemSpec(name="walk12", options=options, values={"step_time_s": row.step_time_s})
    return evaluate_point(spec, row.x)["f1_per_m2s"]


def compute_f(row: PaperRow, f1max: float, **options: str) -> float:
    """Return f of a printed gait in the model under a normalisation."""
    return row.weight * compute_f1(row, **options) / f1max + (1 - row.weight) * row.s / F2MAX


def follow(x: Sequence[float], **options: Any) -> Mapping[str, Array]:
    """Return the time histories of a step of a gait, see ``compute_steps``."""
    return compute_steps(load_point_mass_biped(), np.array(x), **{"steps": 1, "intervals": 400, **options}).arrays


@dataclass(frozen=True)
class Results:
    """Results in one reading of the paper."""

    reading: str
    runs: Runs

    @property
    def options(self) -> dict[str, Any]:
        """Options of the problem."""
        return OPTIONS[self.reading]

    @property
    def is_searched(self) -> bool:
        """Whether there are runs of the GA."""
        return any(solver == "ga" for _, solver in self.runs)

    def find_runs(self, what: str, solver: str = IPOPT) -> list[RunRecord]:
        """Return the runs of a solver: at T = 1 s both horizons are the same."""
        shared = self.reading == SECOND and not what.endswith("s")
        return self.runs[make_title(LITERAL if shared else self.reading, what), solver]

    def best(self, what: str) -> RunRecord:
        """Return IPOPT's best start."""
        return choose_best(self.find_runs(what))

    def list_ends(self, what: str, scale: float = 1.0) -> list[float]:
        """Return f at the ends of the GA's runs on a problem, times a scale; minus infinity without a feasible gait."""
        return [scale * run.objective if run.feasible else -math.inf for run in self.find_runs(what, "ga")]

    def list_f(self, rows: Sequence[PaperRow]) -> list[float]:
        """Return f of printed gaits under the printed f1max."""
        return [compute_f(row, row.f1max, **self.options) for row in rows]

    @property
    def optima(self) -> list[RunRecord]:
        """Optima of Table III."""
        return [self.best(f"{row.weight:g}") for row in TABLE_3]

    @property
    def optima_over_time(self) -> list[RunRecord]:
        """Optima of Table IV under the model's f1max."""
        return [self.best(f"optimum-{row.step_time_s:g}s") for row in TABLE_4]

    @property
    def f1max_over_time(self) -> list[float]:
        """The model's largest f1 at each T of Table IV [1/(m^2 s)]."""
        return [F1MAX * self.best(f"stable-{row.step_time_s:g}s").objective for row in TABLE_4]

    @property
    def f1(self) -> list[float]:
        """Values of the printed gaits of Table III [1/(m^2 s)]."""
        return [compute_f1(row, **self.options) for row in TABLE_3]

    @property
    def front(self) -> list[RunRecord]:
        """Most stable gaits by rising step length."""
        prefix = make_title(LITERAL if self.reading == SECOND else self.reading, "length-")
        result = [choose_best(runs) for (title, _), runs in self.runs.items() if title.startswith(prefix)]
        return sorted(result, key=lambda run: run.x["step_length_m"])


def compute(runner: Runner, effort: Walk12Effort) -> dict[str, Results]:
    """Run Tables III and IV in every reading; Table IV's optima need the model's f1max."""
    runs = runner.run_tasks(_make_tasks(effort))
    results = {reading: Results(reading, runs) for reading in READINGS}
    runs |= runner.run_tasks(_make_optimum_tasks(effort, results))
    return results


def _make_tasks(effort: Walk12Effort) -> Iterator[Run]:
    for reading in READINGS:
        if reading != SECOND:
            for row in TABLE_3:
                yield from _make_runs(effort, make_spec(reading, f"{row.weight:g}", row.weight), ga=True)
            for s in effort.lengths_m:
                bounds = {"step_length_m.lower": s, "step_length_m.upper": s}
                yield from _make_runs(effort, make_spec(reading, f"length-{s:g}", 1.0, **bounds))
        for row in TABLE_4:
            spec = make_spec(reading, f"stable-{row.step_time_s:g}s", 1.0, step_time_s=row.step_time_s)
            yield from _make_runs(effort, spec, ga=True)
    for weight in UNBENT_WEIGHTS:
        yield from _make_runs(effort, make_spec(LITERAL, f"unbent-{weight:g}", weight, reach_margin_rad=0.0))


def _make_optimum_tasks(effort: Walk12Effort, results: Mapping[str, Results]) -> Iterator[Run]:
    for reading, result in results.items():
        for row, f1max in zip(TABLE_4, result.f1max_over_time, strict=True):
            values = {"f1max": f1max, "step_time_s": row.step_time_s}
            yield from _make_runs(effort, make_spec(reading, f"optimum-{row.step_time_s:g}s", row.weight, **values))


def make_spec(reading: str, what: str, weight: float, **values: float) -> ProblemSpec:
    """Return a problem in a reading."""
    values = {"lambda": weight, "f1max": F1MAX, **values}
    return ProblemSpec(name="walk12", options=OPTIONS[reading], values=values, label=make_title(reading, what))


def make_title(reading: str, what: str) -> str:
    """Return the label of a problem."""
    return f"{reading.strip('()').replace(' ', '-')}-{what}"


def _make_runs(effort: Walk12Effort, spec: ProblemSpec, *, ga: bool = False) -> Iterator[Run]:
    yield from make_start_tasks(spec, effort.starts)
    if ga:
        yield from make_search_tasks(spec, {"ga": GA}, effort.runs, GA_EVALUATIONS)
