"""What do options change? Variants of a problem (another trajectory, real motors, free joints), solved and compared."""

import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from compare.analysis.units import with_unit
from compare.judge import evaluate
from compare.questions.question import Answer, Question, Work, make_optima_table, make_record_table, make_table
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.registry import find_maker
from nlp_gait.gaits.biped.curves import SPANS
from nlp_gait.symbolic.trajectories import refine_spline

CONSTANT = 1e-4  # share of its range by which a variable may move and is shown as constant
# Many variables may take longer than a usual solve.
SOLVER = IpoptSettings(time_limit_s=3600.0, iterations=1000)


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A problem with other options."""

    name: str  #: in words
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)  #: that are changed
    problem: str = ""  #: another problem with the same options; empty for the problem itself
    alone: bool = False  #: start only from the optimum that it contains, without random starts


PROBLEM = "problem"  # in the text of a variant, names another problem
FREE_JOINTS = ("nao-ssp-free", "nao-dsp-free")  # problems whose starts are fitted to a planned motion

# The features of ``nlp_gait.gaits.biped.motors``; the first variant is the paper's.
MOTORS = tuple(
    Variant(name=name, options={"motors": features})
    for name, features in {
        "as published": "",
        "with speed and torque limits": "limits",
        "with coupled ankles, too": "limits,ankle",
        "with these, braking is free": "limits,ankle,free-braking",
        "with these, braking gives back": "limits,ankle,regeneration",
        "with these, K of each motor": "limits,ankle,heat",
        "with these, K and free braking": "limits,ankle,heat,free-braking",
        "with these, inertia of rotors": "limits,ankle,rotor",
    }.items()
)
ORDERS, FREE_ORDERS = tuple(SPANS)[:5], ("spline-2", "spline-4", "spline-8", "spline-16")
# Samples in each interval, so that no motion bends between them: with 4, free joints on 16 spans hide a tenth of their power.
SAMPLES, FREE_SAMPLES = 4, 8


def list_trajectories(problem: GaitProblem) -> tuple[Variant, ...]:
    """Return motions of rising order, the richest on the papers' samples, other objectives, and free joints."""

    def make(name: str, trajectory: str, samples: int = SAMPLES, **options: str) -> Variant:
        changed: dict[str, str | int | float | bool] = {
            "trajectory": trajectory,
            "samples_per_interval": samples,
            **options,
        }
        return Variant(name=name, options=changed, alone=True)

    free = f"{problem.name}-free"
    return (
        *(replace(make(order, order), alone=False) for order in ORDERS),
        make(f"{ORDERS[-1]}, few samples", ORDERS[-1], 1),
        make("spline-4, least jerk", "spline-4", objective="jerk"),
        make("spline-4, least torque change", "spline-4", objective="torque-smoothness"),
        *(replace(make(f"free joints, {order}", order, FREE_SAMPLES), problem=free) for order in FREE_ORDERS),
    )


@dataclass(frozen=True, kw_only=True)
class SolvedVariant:
    """The optimum of a variant."""

    name: str  #: in words
    problem: str  #: name
    options: Mapping[str, Any]  #: that are changed
    variables: int  #: number of them
    feasible: bool  #: at least one start converged to a feasible point
    status: str  #: in words
    objective: float  #: at the optimum
    unit: str  #: of the objective
    indexes: Mapping[str, float]  #: performance figures at the optimum
    dense: Mapping[str, float] | None  #: the same on the judge's dense grid
    worst: str  #: row that is violated most between the samples, with the amount; empty if there is none
    start: str  #: variant from whose optimum this one starts; empty for random starts alone
    converged: int  #: number of starts with a feasible optimum
    starts: int
    iterations: int  #: of the reported start
    time_s: float  #: wall time of the solver, all starts
    x: Mapping[str, float]  #: by variable name
    #: next to the first variant; None if their variables differ
    unchanged: float | None  #: objective at the first variant's optimum
    unchanged_violation: float | None  #: violation there
    as_first: float | None  #: first variant's objective at this optimum
    moved: float | None  #: largest distance of a variable between both optima, as a share of its range
    moved_variable: str | None  #: name of that variable


@dataclass(frozen=True, kw_only=True, eq=False)
class Variants(Question[tuple[SolvedVariant, ...]]):
    """How do the optima of some variants of a problem differ?

    Each starts from the richest earlier variant that it contains, and from random points.
    """

    name: ClassVar[str] = "variants"
    counts: ClassVar[str] = "variants"

    variants: Sequence[Variant]  #: at least one
    starts: int = 10  #: of each variant, the optimum of an earlier one among them
    seed: int = 0  #: of the random starts

    def __post_init__(self) -> None:
        """Build each variant; raises InputError and UnknownNameError for options that are not allowed."""
        if not self.variants or len({variant.name for variant in self.variants}) < len(self.variants):
            raise InputError("variants: at least one is required, each with its own name")
        for variant in self.variants:
            load_variant(self.problem, variant)

    @property
    def total(self) -> int:
        return len(self.variants)

    def find(self, work: Work) -> Iterator[tuple[SolvedVariant, ...]]:
        solver, solved = work.solver(SOLVER), dict[str, SolvedVariant]()
        for variant in self.variants:
            problem = load_variant(self.problem, variant)
            near, x0 = self._find_start(variant, problem, solved)
            starts = 1 if variant.alone and x0 is not None else self.starts
            solution = solve(problem, starts=starts, seed=self.seed, x0=x0, solver=solver)
            judged = evaluate(problem, solution.x, prove=False)
            solved[variant.name] = SolvedVariant(
                name=variant.name,
                problem=problem.name,
                options=variant.options,
                variables=len(problem.names),
                feasible=solution.converged,
                status=solution.status,
                objective=solution.objective,
                unit=problem.objective.unit,
                indexes=judged.indexes,
                dense=judged.dense,
                worst="".join(f"{row.name} by {row.violation:.2g} {row.unit}" for row in judged.dense_violations[:1]),
                start=near,
                converged=sum(start.converged for start in solution.starts),
                starts=len(solution.starts),
                iterations=solution.best.iterations,
                time_s=solution.time_s.solve,
                x=solution.x,
                **self._compare_to_first(problem, solution.x, solved),
            )
            work.progress(variant.name)
            yield tuple(solved.values())

    def _find_start(
        self, variant: Variant, problem: GaitProblem, solved: Mapping[str, SolvedVariant]
    ) -> tuple[str, Array | None]:
        """Return name and start of the richest earlier variant that this one contains, or joints fitted to the richest one."""
        feasible = [solution for solution in solved.values() if solution.feasible]
        feasible.sort(key=lambda solution: (solution.problem == problem.name, solution.variables), reverse=True)
        variants = {variant.name: variant for variant in self.variants}
        for solution in feasible:
            if not self._has_curves(problem, variants[solution.name]):
                continue
            x = convert_motion(solution.x, problem)
            if x is not None:
                return solution.name, np.clip(x, problem.lower, problem.upper)
        if feasible and problem.name in FREE_JOINTS:
            from nlp_gait.gaits.nao.free_joints import fit_joints

            planned = load_variant(self.problem, variants[feasible[0].name])
            x = fit_joints(str(problem.options["trajectory"]), planned, planned.check_x(feasible[0].x))
            return feasible[0].name, np.clip(x, problem.lower, problem.upper)
        return "", None

    def _has_curves(self, problem: GaitProblem, simpler: Variant) -> bool:
        """Return whether a problem has all curves that a variant has with the problem's trajectory; a cubic names none."""
        richer, order = load_variant(self.problem, simpler), problem.options.get("trajectory")
        if order is not None and "trajectory" in richer.options:
            richer = load_variant(self.problem, replace(simpler, options={**simpler.options, "trajectory": order}))
        return set(richer.names) <= set(problem.names)

    def _compare_to_first(
        self, problem: GaitProblem, x: Mapping[str, float], solved: Mapping[str, SolvedVariant]
    ) -> dict[str, Any]:
        first = load_variant(self.problem, self.variants[0])
        if first.names != problem.names:
            return dict.fromkeys(("unchanged", "unchanged_violation", "as_first", "moved", "moved_variable"))
        here = problem.check_x(x)
        there = problem.check_x(next(iter(solved.values())).x) if solved else here
        moves, unchanged = np.abs(here - there) / problem.scale, build_exact_model(problem).at(there, problem.p)
        return {
            "unchanged": problem.objective.sign * unchanged.cost,
            "unchanged_violation": unchanged.violation,
            "as_first": first.objective.sign * build_exact_model(first).at(here, first.p).cost,
            "moved": float(moves.max()),
            "moved_variable": problem.names[int(moves.argmax())],
        }

    def get_optimum(self, findings: tuple[SolvedVariant, ...]) -> float | None:
        first = findings[0]
        same = load_variant(self.problem, self.variants[0]).options == self.problem.options
        return first.objective if first.feasible and same else None

    def report(self, findings: tuple[SolvedVariant, ...]) -> Answer:
        name, stem, first = self.problem.name, f"{self.problem.name}-variants", findings[0]
        changes: dict[str, Any] = {
            "variant": lambda v: v.name,
            "variables": lambda v: str(v.variables),
            "optimum": lambda v: with_unit(v.objective, v.unit),
            "change": lambda v: f"{100 * (v.objective / first.objective - 1):+z.1f} %" if v.unit == first.unit else "-",
            "first optimum here": lambda v: (
                with_unit(v.unchanged, v.unit) + " (infeasible)" * bool(v.unchanged_violation)
            ),
            "optimum as the first": lambda v: with_unit(v.as_first, first.unit),
            "x* moves most in": lambda v: (
                f"{v.moved_variable} by {v.moved:.0%} of its range" if (v.moved or 0.0) > CONSTANT else "-"
            ),
            "violated most between samples": lambda v: v.worst or "nothing",
        }
        same = [v for v in findings if v.moved is not None]
        optima = (make_optima_table({v.name: v.x for v in same}),) if len(same) > 1 else ()
        return Answer(
            stem=stem,
            title=f"{name}: variants",
            parts=(
                make_table("What each variant changes; how each was solved is in the CSV file", findings, changes),
                *optima,
                make_record_table(stem, findings),
            ),
            data={"problem": name, "variants": [asdict(variant) for variant in findings]},
        )

    def failures(self, findings: tuple[SolvedVariant, ...]) -> list[str]:
        return [f"{variant.name}: {variant.status}" for variant in findings if not variant.feasible]


def load_variant(problem: GaitProblem, variant: Variant) -> GaitProblem:
    """Return a variant of a problem, with the options and parameter values that both have."""
    options, values = dict(problem.options), dict(problem.values)
    if variant.problem:
        parameters = inspect.signature(find_maker(variant.problem)).parameters
        options = {name: value for name, value in options.items() if name in parameters}
        values = {}
    return ProblemSpec(
        name=variant.problem or problem.address, options={**options, **variant.options}, values=values
    ).load()


def convert_motion(x: Mapping[str, float], problem: GaitProblem) -> Array | None:
    """Return the same motion in a problem with more coefficients in its curves; None if the problem does not contain it."""
    simpler, richer = _group(x), _group(problem.names)
    scalars = [name for name in richer if "[" not in richer[name][0]]
    if not simpler.keys() <= richer.keys() or not simpler.keys() >= set(scalars):
        return None
    spans, values = SPANS.get(str(problem.options.get("trajectory")), 0), dict[str, float]()
    for name, members in richer.items():
        old = np.array([x[member] for member in simpler.get(name, [])])
        if len(old) > len(members):
            return None
        if 0 < len(old) < len(members):
            old = refine_spline(old, spans)
        values |= zip(members, old if len(old) else np.zeros(len(members)), strict=True)
    return problem.check_x(values)


def _group(names: Iterator[str] | Sequence[str] | Mapping[str, float]) -> dict[str, list[str]]:
    """Return names by curve: ``hip_x_m[0]`` is a coefficient of ``hip_x_m``."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(name.partition("[")[0], []).append(name)
    return groups
