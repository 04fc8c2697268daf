"""Runs and sweeps of the reproduction of the NAO paper, and its numbers as printed (``nao_paper.toml``).

These are Tables 6 to 9, section 5.3 and numbers in the text.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from compare.analysis.record_statistics import RankSum
from compare.papers.claims import read_printed
from compare.papers.paper_runs import Effort, make_computation
from compare.study.record import RunRecord
from compare.study.run_task import run_task
from compare.study.store import Computation, Store
from compare.study.task import IPOPT, Handling, ProblemSpec, Stop, Task
from metaheuristics.algorithms.genetic import GeneticAlgorithm, Polynomial, SimulatedBinary
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve_both_ways
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedOptimum:
    """A solution as printed."""

    x: tuple[float, ...]  # x1, x2 and so on
    power_W: float  # least mean power
    legs_twice_W: float  # ours: power with the mechanical term of the moving leg joints counted twice
    indexes: Mapping[str, float]  # performance figures, named as the problem's indexes

    @property
    def figures(self) -> dict[str, float]:
        """Performance figures with the power, as the problem's indexes."""
        return {"power_W": self.power_W, **self.indexes}


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedPhase:
    """Numbers of one support phase as printed, and where they are."""

    problem: str  # name of the problem here
    title: str  # in words
    optima: Mapping[str, PrintedOptimum]  # by search algorithm (Tables 6 and 8, 7 and 9)
    test: RankSum  # section 5.3
    tables: tuple[int, int]  # numbers of the tables of variables and of indexes
    convergence_figure: str  # name of the figure of best per generation
    scatter_figures: Mapping[str, tuple[int, ...]]  # figures of power against variables, to the positions of these in x
    duration: int  # position of the phase's time in x
    poses_every_s: float  # time between the poses of Fig. 20


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocityRange:
    """A range of velocities [m/s] of the solutions of a phase, with the variables' positions in x."""

    phase: Literal["ssp", "dsp"]
    variables: tuple[int, ...]
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A choice other than ours, as options and parameters of the problems."""

    title: str  # in words
    phases: tuple[str, ...] = ("nao-ssp", "nao-dsp")  # problems
    options: Mapping[str, str | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class NaoPaper:
    """Content of ``nao_paper.toml``."""

    ssp: PrintedPhase
    dsp: PrintedPhase
    swing_heights_m: tuple[float, ...]
    swing_power_W: Mapping[str, tuple[float, ...]]  # by search algorithm, at these heights
    durations_s: tuple[float, ...]  # of single support
    velocity_ranges: Mapping[str, VelocityRange]  # by id of the claim
    choices: Mapping[str, Choice]
    torque_changes_Nm: Mapping[str, tuple[float, float]]  # ours, by candidate for the cause of the printed ones


PAPER = read_printed(NaoPaper, "nao/nao_paper.toml")
SSP, DSP = PHASES = PAPER.ssp, PAPER.dsp
SWING_HEIGHT = 7  # position in x of nao-ssp
SWING_POWER_W = {name: dict(zip(PAPER.swing_heights_m, row, strict=True)) for name, row in PAPER.swing_power_W.items()}
ALGORITHMS = ("pso", "ga")  # as the paper names them
# PSO with the constant weight that the paper prints, PSO with the damping of the code that it cites, GA.
SEARCHES = ("pso-constant", "pso", "ga")
PENALTY = Handling(name="penalty", settings={"weight": 10.0})  # W per unit of violation
# What the paper leaves open, chosen otherwise than in ``SEARCHES``.
VARIANTS: Mapping[str, Mapping[str, Any]] = {
    "ga-generational": {"solver": "ga", "settings": {"survival": "generational"}},
    "ga-all-crossed": {
        "solver": GeneticAlgorithm(crossover=SimulatedBinary(probability=1.0, variable_probability=1.0))
    },
    "ga-much-mutation": {"solver": GeneticAlgorithm(mutation=Polynomial(probability=0.3))},
    "ga-penalty": {"solver": "ga", "handling": PENALTY},
    "pso-penalty": {"solver": "pso", "handling": PENALTY},
    "pso-constant-penalty": {"solver": "pso-constant", "handling": PENALTY},
    "pso-fast": {"solver": "pso", "settings": {"velocity_limit": 1.0}},
    "pso-constant-fast": {"solver": "pso-constant", "settings": {"velocity_limit": 1.0}},
}
MORE = {f"{name}-more": name for name in SEARCHES}  # searches from further initial populations
WEBOTS_DRIVE = Drive(period_s=0.04, interpolation="held", feed_forward="none")  # section 5.4


@dataclass(frozen=True, kw_only=True)
class NaoEffort(Effort):
    """Effort of the reproduction of the NAO paper."""

    runs: int = 11  # of each search, as in the paper
    variant_runs: int = 11  # of each other choice of the searches
    more_runs: int = 44  # of each search, with the seeds after those of ``runs``
    evaluations: int = 10_000  # of a search, as in the paper
    starts: int = 20  # of IPOPT
    choices: tuple[str, ...] = tuple(PAPER.choices)  # with an optimum; all have values at the printed solutions
    choice_starts: int = 5  # of IPOPT for each of them
    intervals: int = 10  # between the samples of a phase, as in the paper
    choice: str = ""  # one of the paper's ``choices`` that all is computed with; none if empty
    others: tuple[str, ...] = ("v6", "lever")  # choices with which all verdicts are found again, see ``choose_other``
    sweep_starts: int = 2  # at both ends of a sweep
    sweep_points: tuple[int, int] = (13, 10)  # over the range of all feasible solutions, and of the cheap ones

    @property
    def steps(self) -> int:
        """Runs, two special sweeps and one over each variable, a simulation of each printed solution, and the report."""
        sweeps = 2 * (SSP in self.phases) + sum(len(p.optima["pso"].x) for p in self.phases)
        other = sum(self.choose_other(choice).steps - 1 for choice in self.others)
        return len(make_tasks(self)) + sweeps + sum(len(p.optima) for p in self.phases) + 1 + other

    @property
    def phases(self) -> tuple[PrintedPhase, ...]:
        """Phases that the choice changes; both without one."""
        return tuple(p for p in PHASES if not self.choice or p.problem in PAPER.choices[self.choice].phases)

    def choose_other(self, choice: str) -> "NaoEffort":
        """Return the effort with another choice: all searches, fewer starts of IPOPT and points of its sweeps."""
        fewer = replace(self, variant_runs=min(3, self.variant_runs), starts=min(8, self.starts), sweep_points=(5, 4))
        return replace(fewer, choice=choice, others=(), choices=("v6",), choice_starts=1)


@dataclass(frozen=True, kw_only=True)
class FixedOptimum:
    """IPOPT's optimum with a variable fixed at a value."""

    at: float
    power_W: float
    feasible: bool


def make_tasks(effort: NaoEffort) -> list[Task]:
    """Return searches and starts of IPOPT; equal runs of the searches start from the same population."""
    stop, tasks = Stop(evaluations=effort.evaluations), []
    for phase in effort.phases:
        spec = make_spec(phase.problem, effort)
        for name in SEARCHES:
            tasks += [Task(problem=spec, solver=name, stop=stop, run=k) for k in range(effort.runs)]
        for label, kind in VARIANTS.items():
            tasks += [Task(problem=spec, label=label, stop=stop, run=k, **kind) for k in range(effort.variant_runs)]
        more = range(effort.runs, effort.runs + effort.more_runs)
        for label, name in MORE.items():
            tasks += [Task(problem=spec, solver=name, label=label, stop=stop, run=k) for k in more]
        tasks += [Task(problem=spec, solver=IPOPT, run=k) for k in range(effort.starts)]
        for chosen in list_choices(phase.problem, effort).values():
            tasks += [Task(problem=chosen, solver=IPOPT, run=k) for k in range(effort.choice_starts)]
    return tasks


def list_choices(problem: str, effort: NaoEffort, *, solved: bool = True) -> dict[str, ProblemSpec]:
    """Return a phase with each other choice by name; only those with an optimum, or all of them."""
    spec = make_spec(problem, effort)
    return {
        name: replace(spec.with_options(**choice.options), values=choice.values, label=f"{problem}-{name}")
        for name, choice in PAPER.choices.items()
        if problem in choice.phases and (name in effort.choices or not solved)
    }


def make_spec(problem: str, effort: NaoEffort) -> ProblemSpec:
    """Return a phase of the paper."""
    spec = ProblemSpec(name=problem, options={"intervals": effort.intervals, "robot": "nao-v5"})
    return spec.with_options(**PAPER.choices[effort.choice].options) if effort.choice else spec


def run_and_store_points(folder: Path, task: Task, start: RunRecord | None = None) -> RunRecord:
    """Perform a run, and store every feasible solution that a search evaluated, see ``load_points``."""
    if task.title not in SEARCHES:
        return run_task(task, start)
    feasible: list[tuple[Array, Array]] = []

    def add_feasible(X: Array, f: Array, violation: Array) -> None:
        good = violation == 0.0
        feasible.append((X[good], f[good]))

    record = run_task(task, callback=add_feasible)
    x, power = (np.concatenate(arrays) for arrays in zip(*feasible, strict=True))
    Store(folder).save_arrays(_name_points(task), task.definition(), {"x": x, "power_W": power})
    return record


def load_points(store: Store, task: Task) -> tuple[Array, Array] | None:
    """Return the feasible solutions of a search: x (m, n) and power (m,) [W]; None if they are not stored."""
    arrays = store.load_arrays(_name_points(task), task.definition())
    return None if arrays is None else (arrays["x"], arrays["power_W"])


def _name_points(task: Task) -> str:
    return f"points/{task.problem.title}-{task.title}-{task.run:02d}"


def make_special_sweeps(effort: NaoEffort) -> list[Computation]:
    """Return IPOPT over the paper's swing heights, and over durations of single support; nothing without that phase."""
    spec, starts = make_spec(SSP.problem, effort), effort.sweep_starts
    sweeps = [
        make_sweep("table7-swing-heights", spec, SWING_HEIGHT, PAPER.swing_heights_m, starts),
        make_sweep("durations", spec, SSP.duration, PAPER.durations_s, starts),
    ]
    return sweeps if SSP in effort.phases else []


def make_sweep(name: str, spec: ProblemSpec, position: int, values: Sequence[float], starts: int) -> Computation:
    """Return a sweep over a variable: its optima lead to each other, so they are not runs by themselves."""
    inputs = {"variable": spec.load().names[position], "values": list(values), "starts": starts}
    return make_computation(name, spec, partial(solve_sweep, spec), **inputs)


def solve_sweep(spec: ProblemSpec, variable: str, values: Sequence[float], starts: int) -> list[dict[str, Any]]:
    """Return the fields of ``FixedOptimum`` at ascending values, infeasible points included."""
    problem = spec.load()
    solutions = solve_both_ways([problem.fix(**{variable: value}) for value in values], starts=starts)
    return [
        {"at": value, "power_W": solution.objective, "feasible": solution.converged}
        for value, solution in zip(values, solutions, strict=True)
    ]


def make_simulations(effort: NaoEffort) -> list[Computation]:
    """Return the simulation of each printed solution, as in section 5.4."""
    return [
        make_computation(f"simulate-{phase.problem}-{name}", spec, partial(simulate_solution, spec), x=list(optimum.x))
        for phase in effort.phases
        for spec in [make_spec(phase.problem, effort)]
        for name, optimum in phase.optima.items()
    ]


def simulate_solution(spec: ProblemSpec, x: Sequence[float]) -> dict[str, Any]:
    """Return when the robot falls, its largest tilt, and how far joints come beyond their limits [rad], planned and simulated."""
    problem = spec.load()
    plan = make_plan(Result(problem=problem, x=problem.check_x(x)))
    trace = simulate_plan(plan, drive=WEBOTS_DRIVE)
    limits = np.array([plan.robot.joint(name).limits_rad for name in plan.joints]).T
    beyond = [float(max((limits[0] - q).max(), (q - limits[1]).max())) for q in (plan.signals.arrays["q"], trace.q)]
    return {
        "fell_at_s": trace.fell_at_s,
        "tilt_rad": float(trace.tilt.max()),
        "planned_beyond_rad": beyond[0],
        "simulated_beyond_rad": beyond[1],
    }


def evaluate_indexes(problem: GaitProblem, x: Sequence[float]) -> Mapping[str, float]:
    """Return the performance figures of a solution by the exact functions."""
    return build_exact_model(problem).at(problem.check_x(x), problem.p).indexes
