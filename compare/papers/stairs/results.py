"""Results of the stairs paper: plans, tracked steps by reading, and computations on them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.papers.paper import parse_settings, read_rows
from compare.papers.paper_runs import (
    Effort,
    Runner,
    Runs,
    choose_best,
    make_computation,
    make_search_tasks,
    simulate_point,
)
from compare.papers.stairs import printed
from compare.papers.stairs.printed import FOLDER, TABLE_4
from compare.study.memo import Computation
from compare.study.record import RunRecord
from compare.study.run import IPOPT, ProblemSpec, Run
from metaheuristics import AntColony, minimize
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.formulation import Assembly, Point
from nlp_gait.gaits.stairs.track import PLAN
from nlp_gait.symbolic.nonsmooth import Nonsmooth

PLANS = {"least jerk": "jerk", "least energy": "energy"}  # readings of claims on plans
TRACKINGS = {row["name"]: row for row in read_rows(FOLDER / "readings.csv")}  # of the tracked step
LITERAL, NETWORK = "as printed", "network"
DRAWN_CASE = 2
# Choices of the planner that are undone one by one: their options are in differences.csv.
CHOICES = {
    row["id"]: parse_settings(row["option"])
    for row in read_rows(FOLDER / "differences.csv")
    if row["id"] in ("end-rate", "straight", "torso", "times", "shanks", "hull", "edges", "hip-height")
}
ANTS, ITERATIONS = 30, 100  # Table IV
COLONY = AntColony(population=ANTS, spread=0.7)  # of the printed evaporation; the paper defines none for real numbers
NETWORK_RATES = {
    "1e-4, lengths in m": (1e-4, 1.0),
    "1e-4, lengths in cm": (1e-4, 100.0),
    "0.3, lengths in m": (0.3, 1.0),
}
# Fast for one solve from near the optimum; compiled and with exact derivatives a plan takes twice as long.
NEAR_OPTIMUM = {"compiled": False, "hessian": "limited-memory"}


@dataclass(frozen=True, kw_only=True)
class StairsEffort(Effort):
    """Effort of the reproduction."""

    runs: int = 11  # of the colony on each reading of the tracked step, at most as many as readings.csv says
    evaluations: int = ANTS * ITERATIONS  # of a run, as in the paper
    poses: int = 350  # of the network, every 0.01 s


@dataclass(frozen=True, kw_only=True, eq=False)
class StairsResults:
    """Results in one reading."""

    plan: str  # "jerk" or "energy"
    runs: Runs
    computed: Mapping[str, Any]  # by name
    tracking: str = ""  # reading of the tracked step

    def best(self, case: int) -> RunRecord:
        """Return our best plan of a case."""
        return choose_best(self.runs[f"{self.plan}-{case}", IPOPT])

    def list_plans(self, name: str) -> list[float]:
        """Return a variable of the plans of all cases."""
        return [self.best(case).x[name] for case in TABLE_4]

    @cached_property
    def motions(self) -> dict[int, tuple[Any, dict[str, Any]]]:
        """Motions of the plans by case, see ``move``."""
        return {case: printed.move(make_plan_spec(self.plan, case), self.best(case).x) for case in TABLE_4}

    @cached_property
    def _peaks(self) -> list[tuple[float, float]]:
        plans = [(case, self.best(case).x) for case in TABLE_4]
        return [printed.measure_peaks(make_track_spec(case, x), x["torso_pitch_rad"]) for case, x in plans]

    def list_peaks(self, column: int) -> list[float]:
        """Return the largest accelerations [rad/s^2] (0) or jerks [rad/s^3] (1) of the plans by case."""
        return [peak[column] for peak in self._peaks]

    def list_computed(self, what: str, key: str | None = None) -> list[Any]:
        """Return a number of a computation on the plans of all cases, or on the tracked steps."""
        results = [self.computed[f"{what}-{self.tracking or self.plan}-{case}"] for case in TABLE_4]
        return results if key is None else [result[key] for result in results]

    @cached_property
    def tracked(self) -> list[RunRecord]:
        """The colony's best tracked steps by case."""
        return [choose_best(self.runs[make_title(self.tracking, case), "aco"]) for case in TABLE_4]

    def list_ends(self, name: str) -> list[list[float]]:
        """Return a tuned value or a metric at the ends of all feasible runs of the colony, by case."""
        runs = [self.runs[make_title(self.tracking, case), "aco"] for case in TABLE_4]
        return [[{**run.x, **run.metrics}[name] for run in of_case if run.feasible] for of_case in runs]

    def list_tracked(self, name: str) -> list[float]:
        """Return a tuned value or a metric of the tracked steps of all cases."""
        return [{**run.x, **run.metrics}[name] for run in self.tracked]


def make_plan_spec(plan: str, case: int, label: str = "", **options: Any) -> ProblemSpec:
    """Return the planner of a case, of least jerk or energy."""
    options = {"minimise": plan, "shanks": "limited", **options}
    return ProblemSpec(name="stairs-plan", options=options, values=TABLE_4[case].stair, label=label or f"{plan}-{case}")


def make_track_spec(case: int, plan: Mapping[str, float], tracking: str = "") -> ProblemSpec:
    """Return the tracking of a plan, given by the planner's variables."""
    options, parameters = parse_settings(TRACKINGS[tracking or LITERAL]["option"])
    values = {**TABLE_4[case].stair, **{name: plan[name] for name in PLAN}, **parameters}
    return ProblemSpec(name="stairs-track", options=options, values=values, label=make_title(tracking, case))


def make_title(tracking: str, case: int | str = "all") -> str:
    """Return the label of a tracked step, or of those of all cases."""
    return f"track-{tracking.replace(' ', '-').replace(',', '')}-{case}"


def compute(runner: Runner, effort: StairsEffort) -> dict[str, StairsResults]:
    """Plan all steps; then undo choices of the planner, simulate the plans, and track them."""
    runs = runner.run_tasks(_make_plan_tasks())
    plans = {plan: StairsResults(plan=plan, runs=runs, computed={}) for plan in PLANS.values()}
    choices = _make_choice_tasks(plans["jerk"].best(DRAWN_CASE)) if effort.runs else ()
    runs |= runner.run_tasks([*_make_track_tasks(effort, plans), *choices])
    computed = runner.compute([*_make_computations(effort, plans)])
    results = {reading: StairsResults(plan=plan, runs=runs, computed=computed) for reading, plan in PLANS.items()}
    if effort.runs:
        for name, row in TRACKINGS.items():
            results[name] = StairsResults(plan=row["plan"], runs=runs, computed=computed, tracking=name)
        again = runner.compute([*_make_power_computations(effort, results)])
        results = {name: replace(result, computed={**computed, **again}) for name, result in results.items()}
    return results


def _make_plan_tasks() -> Iterator[Run]:
    for row in read_rows(FOLDER / "starts.csv"):
        spec = make_plan_spec(row.pop("plan"), int(row.pop("case")))
        near = {name: float(value) for name, value in row.items()}
        yield Run(problem=spec, solver=IPOPT, settings=NEAR_OPTIMUM, start=near)


def _make_choice_tasks(best: RunRecord) -> Iterator[Run]:
    """Yield plans of least jerk of case 2 under each choice, from ours."""
    for name, (options, values) in CHOICES.items():
        spec = make_plan_spec("jerk", DRAWN_CASE, label=f"jerk-{name}", **options)
        spec = replace(spec, values={**spec.values, **values})
        problem = spec.load()
        near = [best.x[name] for name in problem.names]
        start = problem.by_name(np.clip(near, problem.lower, problem.upper))
        yield Run(problem=spec, solver=IPOPT, start=start)


def _make_track_tasks(effort: StairsEffort, plans: Mapping[str, StairsResults]) -> Iterator[Run]:
    for name, row in TRACKINGS.items():
        for case in TABLE_4:
            spec = make_track_spec(case, plans[row["plan"]].best(case).x, name)
            runs = min(effort.runs, int(row["runs"]))
            yield from make_search_tasks(spec, {"aco": COLONY}, runs, effort.evaluations)


def _make_computations(effort: StairsEffort, plans: Mapping[str, StairsResults]) -> Iterator[tuple[str, Computation]]:
    for plan, result in plans.items():
        for case in TABLE_4:
            spec, x = make_plan_spec(plan, case), dict(result.best(case).x)
            yield make_computation(f"climb-{plan}-{case}", spec, partial(simulate_point, spec), x=list(x.values()))
        first = result.best(1).x
        track, rates = make_track_spec(1, first), [*NETWORK_RATES.values()]
        settings = {"torso_pitch_rad": first["torso_pitch_rad"], "rates": rates, "poses": effort.poses}
        yield make_computation(f"network-{plan}", track, partial(printed.train_network, track), **settings)


def _make_power_computations(
    effort: StairsEffort, results: Mapping[str, StairsResults]
) -> Iterator[tuple[str, Computation]]:
    for name in TRACKINGS:
        for case, run in zip(TABLE_4, results[name].tracked, strict=True):
            spec = make_track_spec(case, results[name].best(case).x, name)
            settings = {"x": [*run.x.values()], "evaluations": effort.evaluations}
            yield make_computation(f"power-{name}-{case}", spec, partial(tune_otherwise, spec), **settings)


def tune_otherwise(spec: ProblemSpec, x: Sequence[float], evaluations: int) -> dict[str, float]:
    """Return the energies of gains tuned without the power in (53), and of x with an upright torso [J]; its least margin [m]."""
    problem = spec.load()

    def drop_power(assembly: Assembly, point: Point, _: Nonsmooth) -> Assembly:
        margin = point["zmp_weight"] * assembly.metrics["zmp_margin_min_m"]
        return replace(assembly, objective=assembly.metrics["tracking_cost"] - margin)

    objective = compile_objective(problem.derive(name="stairs-errors", change=drop_power))
    tuned = minimize(objective, COLONY, evaluations=evaluations, seed=0).x
    points = {"without_power": tuned.tolist(), "upright": [*x[:2], np.pi / 2]}
    metrics = {name: evaluate(problem, point).metrics for name, point in points.items()}
    numbers = {f"{name}_J": float(found["energy_J"]) for name, found in metrics.items()}
    return numbers | {"upright_margin_m": float(metrics["upright"]["zmp_margin_min_m"])}
