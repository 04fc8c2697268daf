"""What is a search worth where the simulator scores? IPOPT's gaits of the model beside searches in the engine."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np

from compare.drawing.charts import Chart, Series, draw_chart
from compare.questions.question import Answer, Question, Work, make_record_table, make_table
from compare.questions.sweep import Axis
from compare.report.document import Figure
from metaheuristics import make_algorithm, minimize
from nlp_gait.backends.exact import build_exact_model, identify_problem
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import Bumps
from nlp_gait.simulation.objective import Arena, EngineObjective, GaitScore
from nlp_gait.simulation.simulate import Conditions

GENERATIONS, LEAST_POPULATION = 10, 4  # a population may be smaller than usual, so that so many generations fit
HELD_OUT = (1001, 1002, 1003)  # seeds of floors on which no gait is tuned
HELD_OUT_M = 0.001  # height of their bumps, for gaits that are tuned on a calm floor
MODEL, TUNED, CONTINUED = "IPOPT", "IPOPT+limits", "IPOPT+CMA"
NEARBY = 0.02  # first standard deviation of CMA from IPOPT's optimum, as a share of each variable's range
CAPTION = (
    f"After {{}} in the engine; held out: mean over three other floors, where it stands. {MODEL}: the optimum of the model; "
    f"{TUNED}: with limits tuned in the engine; {CONTINUED}: CMA from the optimum with a first standard deviation of "
    f"{100 * NEARBY:g} % of each range"
)
CURVES = "Least energy of a gait that does what it may, over simulations, by the score of the search"


@dataclass(frozen=True, kw_only=True)
class TunedGait:
    """The best gait of one row."""

    solver: str
    x: tuple[float, ...]
    simulations: int
    score: GaitScore  #: of the search
    #: Simulations and the least energy so far of a gait that does what it may
    history: tuple[tuple[int, float], ...]
    limits: Mapping[str, float]  #: as they are tuned
    model_J_per_m: float
    rows_violated: int  #: of the model
    here: GaitScore  #: after more steps, on the floor of the search
    elsewhere: tuple[GaitScore, ...]  #: on others

    @property
    def elsewhere_J_per_m(self) -> float:
        """Mean energy on the held-out floors on which it stands; NaN if it falls on all."""
        standing = [score.J_per_m for score in self.elsewhere if score.fell_at_s is None]
        return float(np.mean(standing)) if standing else math.nan


COLUMNS: Mapping[str, Callable[[TunedGait], str]] = {
    "gait": lambda row: row.solver,
    "simulations": lambda row: f"{row.simulations}",
    "J/m": lambda row: (
        f"{row.here.J_per_m:.2f}" if row.here.fell_at_s is None else f"falls at {row.here.fell_at_s:.1f} s"
    ),
    "held-out J/m": lambda row: "-" if math.isnan(row.elsewhere_J_per_m) else f"{row.elsewhere_J_per_m:.2f}",
    "off its way": lambda row: f"{100 * row.here.off:.1f} %",
    "falls": lambda row: f"{sum(s.fell_at_s is not None for s in (row.here, *row.elsewhere))} of {1 + len(HELD_OUT)}",
    "model J/m": lambda row: f"{row.model_J_per_m:.2f}",
    "model's rows violated": lambda row: f"{row.rows_violated}",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Tune(Question[list[TunedGait]]):
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
        return 2 + len(self._grid) + len(self.algorithms) * self.runs

    @property
    def _grid(self) -> list[dict[str, float]]:
        values = itertools.product(*(axis.values for axis in self.limits)) if self.limits else ()
        return [dict(zip([axis.name for axis in self.limits], point, strict=True)) for point in values]

    @cached_property
    def _arenas(self) -> list[Arena]:
        """The world of the search; then, for more steps, the same and those of the held-out floors."""
        bumps = self.conditions.bumps or Bumps(height_m=HELD_OUT_M)
        floors = [replace(self.conditions, bumps=replace(bumps, seed=seed)) for seed in HELD_OUT]
        steps = None if self.steps is None else self.judged_steps
        make = partial(Arena, self.problem, drive=self.drive)
        judges = [make(conditions=world, steps=steps, settle_s=1.0) for world in (self.conditions, *floors)]
        return [make(conditions=self.conditions, steps=self.steps), *judges]

    def find(self, work: Work) -> Iterator[list[TunedGait]]:
        """Yield the rows found so far; raises InputError for a problem that is no walk or cycle."""
        if "energy_J_per_m" not in build_exact_model(self.problem).metric_names:
            raise InputError(
                f"{self.problem.name} has no energy per metre; tune a walking cycle or a whole walk: nao-cycle"
            )
        for limits in self._grid:
            self.problem.with_values(**limits)  # raises for unknown names and values that are not allowed
        inputs = {**identify_problem(self.problem), "steps": (self.steps, self.judged_steps), "starts": self.starts}
        inputs |= {"drive": asdict(self.drive), "conditions": asdict(self.conditions)}

        def compute(solver: str, tune: Callable[..., TunedGait], **effort: Any) -> TunedGait:
            work.progress(solver)
            call = partial(tune, solver, **effort)
            return work.compute(TunedGait, "tune", {**inputs, "solver": solver, **effort}, call)

        optimum = compute(MODEL, self._solve, seed=self.seed, limits={})
        rows = [optimum]
        yield rows
        tuned = [compute(TUNED, self._solve, seed=self.seed, limits=limits) for limits in self._grid]
        if tuned:
            best = min(tuned, key=lambda row: (row.score.violation, row.score.J_per_m))
            rows.append(replace(best, simulations=len(tuned)))
            yield rows
        effort = {"simulations": self.simulations, "seed": self.seed}
        rows.append(compute(CONTINUED, self._search, name="cma", first=optimum.x, sigma=NEARBY, **effort))
        yield rows
        for name, run in itertools.product(self.algorithms, range(self.runs)):
            effort["seed"] = self.seed + run
            rows.append(compute(name.upper(), self._search, name=name, first=None, **effort))
            yield rows

    def _solve(self, solver: str, *, seed: int, limits: Mapping[str, float]) -> TunedGait:
        solution = solve(self.problem.with_values(**limits), starts=self.starts, seed=seed, workers=1)
        return self._judge(solver, np.array(solution.best.x), limits=limits)

    def _search(
        self,
        solver: str,
        *,
        name: str,
        first: Sequence[float] | None,
        simulations: int,
        seed: int,
        **settings: float,
    ) -> TunedGait:
        objective = EngineObjective(self._arenas[:1])
        population = min(make_algorithm(name).population, max(LEAST_POPULATION, simulations // GENERATIONS))
        algorithm = make_algorithm(name, population=population, **settings)
        initial = None if first is None else np.clip(first, objective.lower, objective.upper)[None]
        result = minimize(objective, algorithm, evaluations=simulations, seed=seed, initial=initial)
        h = result.history
        found = zip(h.evaluations.tolist(), h.objective.tolist(), h.violation.tolist(), strict=True)
        return self._judge(solver, result.x, result.evaluations, [(n, f) for n, f, excess in found if excess == 0.0])

    def _judge(
        self,
        solver: str,
        x: Array,
        simulations: int = 1,
        history: Sequence[tuple[int, float]] = (),
        limits: Mapping[str, float] | None = None,
    ) -> TunedGait:
        model = build_exact_model(self.problem)
        values = model.at(x, self.problem.p)
        score, here, *elsewhere = [arena.score(x) for arena in self._arenas]
        end = [(simulations, score.J_per_m)] if score.violation == 0.0 else []
        return TunedGait(
            solver=solver,
            x=tuple(x.tolist()),
            simulations=simulations,
            score=score,
            history=(*history, *end),
            limits=limits or {},
            model_J_per_m=values.metrics["energy_J_per_m"],
            rows_violated=len(model.find_violated(values)),
            here=here,
            elsewhere=tuple(elsewhere),
        )

    def report(self, findings: list[TunedGait]) -> Answer:
        """Return the table of all rows, best energies over simulations, and a sentence for each search."""
        length = "a whole walk" if self.steps is None else f"{self.judged_steps} steps"
        lines = [
            Series(name=row.solver, x=n, y=energy, shape="step" if len(n) > 1 else "points")
            for row, (n, energy) in ((row, np.array(row.history).T) for row in findings if row.history)
        ]
        chart = Chart(x="simulations", y="energy in the engine [J/m]", series=lines, log=(True, True))
        return Answer(
            title=f"{self.problem.title}: tuned in the engine",
            headline=tuple(_compare_energies(findings)),
            parts=(
                make_table(CAPTION.format(length), findings, COLUMNS),
                Figure(name="tune", caption=CURVES, drawing=[draw_chart(chart)]),
                make_record_table("tune-rows", findings),
            ),
            stem="tune",
            data={"schema": 1, "rows": [asdict(row) for row in findings]},
        )


def _compare_energies(findings: Sequence[TunedGait]) -> Iterator[str]:
    """Yield a sentence for IPOPT's gait, and for each other solver its median energy as a multiple of it."""
    first = findings[0].here
    if first.fell_at_s is not None:
        yield f"IPOPT's optimum of the model falls at {first.fell_at_s:.1f} s."
    else:
        violations = "; ".join(first.list_violations())
        yield (
            f"IPOPT's optimum of the model needs {first.J_per_m:.2f} J/m in the engine, after one simulation"
            f"{f', but violates limits: {violations}' if violations else ''}."
        )
    for solver in dict.fromkeys(row.solver for row in findings[1:]):
        rows = [row for row in findings if row.solver == solver]
        standing = [row.here.J_per_m for row in rows if row.here.fell_at_s is None]
        limits = ", ".join(f"{name} = {value:.4g}" for name, value in rows[0].limits.items())
        words = f"{solver}, {rows[0].simulations} simulations{f' ({limits})' if limits else ''}: "
        if standing:
            words += (
                f"{np.median(standing) / first.J_per_m:.2f} times that energy{' (median)' if len(rows) > 1 else ''}; "
            )
        violating = sum(row.here.violation > 0.0 for row in rows if row.here.fell_at_s is None)
        others = f", {violating} of {len(rows)} violate limits" if violating else ""
        yield f"{words}{len(rows) - len(standing)} of {len(rows)} fall{others}."
