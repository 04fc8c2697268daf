"""What is a search worth where the simulator scores? IPOPT's gaits of the model beside searches in the engine."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from typing import ClassVar

import numpy as np

from compare.drawing.charts import Chart, Series, draw_chart
from compare.questions.question import Answer, Question, Work, make_record_table
from compare.questions.sweep import Axis
from compare.report.document import Figure, make_text_table
from metaheuristics import make_algorithm, minimize
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import identify_problem
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import Bumps
from nlp_gait.simulation.objective import Arena, EngineObjective, GaitScore
from nlp_gait.simulation.simulate import Conditions

GENERATIONS, LEAST_POPULATION = 10, 4  # a population may be smaller than usual, so that so many generations fit
HELD_OUT = (1001, 1002, 1003)  # seeds of floors on which no gait is tuned
HELD_OUT_M = 0.001  # height of their bumps, for gaits that are tuned on a calm floor
HEADER = (
    *("gait", "simulations", "J/m", "held-out J/m", "falls", "model J/m", "off the way", "slip mm"),
    "model's rows violated",
)
REPEATED = {"torque": 1e-3, "velocity": 0.02, "none": 0.02}  # relative difference of a repeated score, by feed-forward
MODEL, TUNED, CONTINUED = "IPOPT, the model's optimum", "IPOPT, limits tuned in the engine", "CMA from IPOPT's optimum"


@dataclass(frozen=True, kw_only=True)
class TunedGait:
    """The best gait of one row, before it is judged."""

    solver: str
    x: tuple[float, ...]
    simulations: int
    J_per_m: float  #: score of the search
    violation: float
    #: Simulations and the least energy so far of a gait that does what it may
    history: tuple[tuple[int, float], ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)  #: tuned limits


@dataclass(frozen=True, kw_only=True)
class ScoredGait:
    """A gait after ten steps, on the floor of the search and on others."""

    found: TunedGait
    model_J_per_m: float
    rows_violated: int  #: of the model
    here: GaitScore
    elsewhere: tuple[GaitScore, ...]
    repeats: bool  #: whether the score of the search is found again

    @property
    def elsewhere_J_per_m(self) -> float:
        """Mean energy on the held-out floors."""
        return float(np.mean([score.J_per_m for score in self.elsewhere]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Tune(Question[list[ScoredGait]]):
    """Which gait needs least energy in the engine, by model and IPOPT or by searches with as many simulations?"""

    name: ClassVar[str] = "tune"
    counts: ClassVar[str] = "rows"

    drive: Drive = Drive()
    conditions: Conditions = Conditions()
    limits: Sequence[Axis] = ()  #: parameters and bounds that are tuned
    algorithms: Sequence[str] = ("cma", "pso", "ga")
    simulations: int = 300  #: of one search
    runs: int = 3
    seed: int = 0
    steps: int | None = 4  #: that a search simulates; None for a whole walk
    judged_steps: int = 10  #: of a cycle, after which all gaits are compared
    starts: int = 3  #: of IPOPT

    @property
    def total(self) -> int:
        """Rows, and the solves of tuned limits."""
        return 2 + len(self._grid) + len(self._searches)

    @property
    def _searches(self) -> list[tuple[str, int]]:
        return [(name, self.seed + run) for name in self.algorithms for run in range(self.runs)]

    @cached_property
    def _arena(self) -> Arena:
        return Arena(self.problem, drive=self.drive, conditions=self.conditions, steps=self.steps)

    @cached_property
    def _judges(self) -> list[Arena]:
        bumps = self.conditions.bumps or Bumps(height_m=HELD_OUT_M)
        floors = [replace(self.conditions, bumps=replace(bumps, seed=seed)) for seed in HELD_OUT]
        steps = None if self.steps is None else self.judged_steps
        worlds = [self.conditions, *floors]
        return [Arena(self.problem, drive=self.drive, conditions=c, steps=steps, settle_s=1.0) for c in worlds]

    def find(self, work: Work) -> Iterator[list[ScoredGait]]:
        """Yield the rows found so far; raises InputError for a problem that is no walk or cycle."""
        if "energy_J_per_m" not in build_exact_model(self.problem).index_names:
            raise InputError(
                f"{self.problem.name} has no energy per metre; tune a walking cycle or a whole walk: nao-cycle"
            )
        inputs = {**identify_problem(self.problem), "steps": self.steps, "starts": self.starts}
        inputs |= {"drive": asdict(self.drive), "conditions": asdict(self.conditions)}

        def compute(solver: str, more: Mapping[str, object], function: partial[TunedGait]) -> TunedGait:
            work.progress(solver)
            return work.compute(TunedGait, "tune", {**inputs, "solver": solver, **more}, function)

        optimum = compute(MODEL, {}, partial(self._solve, self.problem, {}))
        rows = [self._judge(optimum)]
        yield rows
        x = np.array(optimum.x)
        grid = [dict(zip([axis.name for axis in self.limits], values, strict=True)) for values in self._grid]
        tuned = [compute(TUNED, v, partial(self._solve, self.problem.with_values(**v), v)) for v in grid]
        if tuned:
            best = min(tuned, key=lambda found: (found.violation, found.J_per_m))
            rows.append(self._judge(replace(best, solver=TUNED, simulations=len(tuned))))
            yield rows
        for solver, name, seed, first in [
            (CONTINUED, "cma", self.seed, x),
            *((name.upper(), name, seed, None) for name, seed in self._searches),
        ]:
            effort = {"seed": seed, "simulations": self.simulations}
            rows.append(self._judge(compute(solver, effort, partial(self._search, solver, name, seed, first))))
            yield rows

    @property
    def _grid(self) -> list[tuple[float, ...]]:
        return list(itertools.product(*(axis.values for axis in self.limits))) if self.limits else []

    def _solve(self, problem: GaitProblem, values: Mapping[str, float]) -> TunedGait:
        solution = solve(problem, starts=self.starts, seed=self.seed, workers=1)
        score = self._arena.score(np.array(solution.best.x))
        return TunedGait(
            solver=MODEL,
            x=tuple(solution.best.x.tolist()),
            simulations=1,
            J_per_m=score.J_per_m,
            violation=score.violation,
            values=values,
        )

    def _search(self, solver: str, name: str, seed: int, first: Array | None) -> TunedGait:
        objective = EngineObjective([self._arena])
        population = min(make_algorithm(name).population, max(LEAST_POPULATION, self.simulations // GENERATIONS))
        algorithm = make_algorithm(name, population=population)
        initial = None if first is None else np.clip(first, objective.lower, objective.upper)[None]
        result = minimize(objective, algorithm, evaluations=self.simulations, seed=seed, initial=initial)
        h = result.history
        feasible = [
            (int(n), float(f)) for n, f, v in zip(h.evaluations, h.objective, h.violation, strict=True) if v == 0.0
        ]
        return TunedGait(
            solver=solver,
            x=tuple(result.x.tolist()),
            simulations=int(result.evaluations),
            J_per_m=float(result.objective),
            violation=float(result.violation),
            history=tuple(feasible),
        )

    def _judge(self, found: TunedGait) -> ScoredGait:
        x, model = np.array(found.x), build_exact_model(self.problem)
        values, again = model.at(x, self.problem.p), self._arena.score(x)
        here, *elsewhere = [arena.score(x) for arena in self._judges]
        return ScoredGait(
            found=found,
            model_J_per_m=values.indexes["energy_J_per_m"],
            rows_violated=len(model.find_violated(values)),
            here=here,
            elsewhere=tuple(elsewhere),
            repeats=math.isclose(again.J_per_m, found.J_per_m, rel_tol=REPEATED[self.drive.feed_forward]),
        )

    def report(self, findings: list[ScoredGait]) -> Answer:
        """Return the table of all rows, best energies over simulations, and a sentence for each search."""
        length = "a whole walk" if self.steps is None else f"{self.judged_steps} steps"
        caption = f"After {length} in the engine; held out: three other floors"
        table = make_text_table(HEADER, [_make_cells(row) for row in findings], caption)
        lines = [series for row in findings for series in _list_progress(row)]
        chart = Chart(x="simulations", y="energy in the engine [J/m]", series=lines, log=(True, True))
        caption = "Least energy of a gait that does what it may, over simulations, by the score of the search"
        differing = [row.found.solver for row in findings if not row.repeats]
        notes = [f"Scores that were not found again when simulated here: {', '.join(differing)}."] if differing else []
        return Answer(
            title=f"{self.problem.title}: tuned in the engine",
            headline=(*_compare_energies(findings), *notes),
            parts=(
                table,
                Figure(name="tune", caption=caption, drawing=[draw_chart(chart)]),
                make_record_table("tune-rows", findings),
            ),
            stem="tune",
            data={"schema": 1, "rows": [asdict(row) for row in findings]},
            results={},
        )


def _list_progress(row: ScoredGait) -> Iterator[Series]:
    found = row.found
    if found.history:
        n, energy = np.array([*found.history, (found.simulations, found.history[-1][1])]).T
        yield Series(name=found.solver, x=n, y=energy, shape="step")
    elif found.violation == 0.0:
        yield Series(name=found.solver, x=np.array([found.simulations]), y=np.array([found.J_per_m]), shape="points")


def _make_cells(row: ScoredGait) -> tuple[str, ...]:
    here, scores = row.here, (row.here, *row.elsewhere)
    limits = "".join(f", {name} = {value:.4g}" for name, value in row.found.values.items())
    return (
        row.found.solver + limits,
        f"{row.found.simulations}",
        f"{here.J_per_m:.2f}" if here.fell_at_s is None else f"falls at {here.fell_at_s:.1f} s",
        f"{row.elsewhere_J_per_m:.2f}",
        f"{sum(score.fell_at_s is not None for score in scores)} of {len(scores)}",
        f"{row.model_J_per_m:.2f}",
        f"{here.off:.1%}",
        f"{1e3 * here.slip_m:.1f}",
        f"{row.rows_violated}",
    )


def _compare_energies(findings: Sequence[ScoredGait]) -> Iterator[str]:
    """Yield a sentence for IPOPT's gait, and for each other solver its median energy as a multiple of it."""
    first = findings[0].here
    if first.fell_at_s is not None:
        yield f"IPOPT's optimum of the model falls at {first.fell_at_s:.1f} s."
    else:
        yield f"IPOPT's optimum of the model needs {first.J_per_m:.2f} J/m in the engine, after one simulation."
    for solver in dict.fromkeys(row.found.solver for row in findings[1:]):
        rows = [row for row in findings if row.found.solver == solver]
        standing = [row.here.J_per_m for row in rows if row.here.fell_at_s is None]
        after = f"After {rows[0].found.simulations} simulations"
        fallen = f"; {len(rows) - len(standing)} of {len(rows)} fall" if len(standing) < len(rows) else ""
        if not standing:
            yield f"{after} every gait of {solver} falls."
        else:
            ratio = float(np.median(standing)) / first.J_per_m
            of_median = "the median gait" if len(rows) > 1 else "the gait"
            yield f"{after} {of_median} of {solver} needs {ratio:.2f} times that energy{fallen}."
