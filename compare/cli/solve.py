"""``nlp-gait solve`` and ``nlp-gait plan``."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

import nlp_gait
from compare.analysis.units import describe_value, with_unit
from compare.cli import options
from compare.cli.command import OUTPUT_FILE, Output, Rows, command, fail, report_interrupts, say, show_progress
from compare.study.references import find_reference
from nlp_gait.backends.exact import identify_problem
from nlp_gait.backends.plan_walk import MARGINS as MARGINS_OF_SOLE
from nlp_gait.backends.plan_walk import WalkPlan, WalkSettings
from nlp_gait.backends.solvers import registry
from nlp_gait.errors import OutputError
from nlp_gait.files import replace_nan, write_json
from nlp_gait.formulation.solution import Solution
from nlp_gait.interrupts import Interrupted
from nlp_gait.proofs.guarantee import guarantee

SHOWN_MARGINS = 4
SHOWN_VARIABLES, SHOWN_ROWS = 12, 20  # of a solution; both tables together have no more than the second number

MARGINS = (
    f"Least distance of the ZMP from the edges of its support, as shares below 0.5 of a sole's length and width (default: "
    f"{MARGINS_OF_SOLE[0]:g},{MARGINS_OF_SOLE[1]:g}); 0,0 for the cheapest walk."
)


@command
def solve(
    *,
    starts: Annotated[int | None, Option(min=1, max=100000)] = None,
    seed: options.Seed = 0,
    problem: options.NamedProblem,
    solver: str = "ipopt",
    jobs: options.Jobs = None,
    out: Annotated[Path | None, OUTPUT_FILE] = None,
) -> Output:
    """Solve a problem with an NLP solver from several random starts; the exact functions judge the best.

    Examples: `nlp-gait solve nao-ssp --starts 20 --seed 0`, `nlp-gait solve nao-ssp --set swing_height_m=0.024`
    """
    loaded = problem.load()
    chosen = registry.make_solver(solver)
    starts, stopped = loaded.hints.starts if starts is None else starts, ""
    with (
        report_interrupts("interrupted before there was a result; nothing was written"),
        show_progress(f"{solver} starts", starts, "building and compiling") as advance,
    ):
        try:
            solution = nlp_gait.solve(
                loaded,
                starts=starts,
                seed=seed,
                solver=chosen,
                workers=jobs,
                progress=lambda outcome: advance(f"{outcome.objective:.6g}, {outcome.status}"),
            )
        except Interrupted as interrupt:
            if not isinstance(interrupt.partial, Solution):
                raise
            solution, stopped = interrupt.partial, interrupt.sentence
    proven = guarantee(loaded, loaded.check_x(solution.x)) if solution.feasible and loaded.moves else None
    reference = find_reference(identify_problem(loaded))
    data = {**solution.to_json(), "guaranteed": None if proven is None else asdict(proven), **reference.to_json()}
    parts = [*_describe(solution)]
    if proven is not None:
        parts.append(f"Guaranteed: {proven}")
    if solution.feasible and reference.objective is not None:
        parts.append(describe_value(reference, solution.objective, loaded.objective))
    written, failures = [], [] if solution.converged else [solution.status]
    if out is not None:
        try:
            write_json(out, replace_nan(data))
            written.append(out)
        except OutputError as error:  # the solution is printed nevertheless
            failures = [str(error)]
    if stopped:
        stopped += f"; the best point so far is {f'in {out}' if written else 'printed'}"
        failures = []
    return Output(data=data, parts=parts, written=written, failures=failures, interrupted=stopped)


def _describe(solution: Solution) -> Iterator[str | Rows]:
    problem, best = solution.problem, solution.best
    value = with_unit(solution.objective, problem.objective.unit)
    words = f"{problem.objective.name} {value}" if solution.feasible else "no feasible point was found"
    yield f"{problem.load_name}: {words} ({solution.status})"
    kind = "Optimum" if solution.converged else "Best feasible point" if solution.feasible else "Least infeasible point"
    x, active = list(solution.x.items()), solution.active_constraints
    if len(x) > SHOWN_VARIABLES:
        order = np.argsort(-np.abs(best.x) / problem.scale, kind="stable")[:SHOWN_VARIABLES]
        x, kind = [x[i] for i in order], f"{kind}: the largest variables in units of their ranges"
    shown = active[: SHOWN_ROWS - len(x)]
    units = {variable.name: variable.unit for variable in problem.variables}
    yield Rows(kind, ("variable", "value"), [(name, with_unit(value, units[name], ".6g")) for name, value in x])
    rows = [(a.name, a.side, with_unit(a.bound, a.unit, "g"), f"{a.price:.4g} {a.price_unit}") for a in shown]
    if rows:
        yield Rows("Active constraints, dearest first", ("bound", "side", "at", "price"), rows)
    hidden = len(solution.x) - len(x), len(active) - len(shown)
    if any(hidden):
        yield f"and {hidden[0]:,} more variables and {hidden[1]:,} more active constraints: --out FILE or --json"
    counts, time = solution.evaluations, solution.time_s
    yield (
        f"{sum(start.converged for start in solution.starts)} of {len(solution.starts)} starts converged; "
        f"{best.iterations} iteration{'s' * (best.iterations != 1)} of the best; calls "
        f"f {counts.f}, g {counts.g}, gradient {counts.gradient}, Jacobian {counts.jacobian}, Hessian {counts.hessian}"
    )
    yield (
        f"build {time.build:.2f} s, derivatives {time.compile:.2f} s, solve {time.solve:.2f} s; "
        f"{best.solver}{f' with {best.linear_solver}' if best.linear_solver else ''}"
    )


@dataclass(frozen=True, kw_only=True)
class RouteOptions:
    """Where a walk leads, and how fast."""

    steps: Annotated[int | None, Option(min=2, max=1000)] = None
    speed: Annotated[float | None, Option(min=0.001, max=1000.0)] = None
    speeds: str = ""
    distance: Annotated[float | None, Option(min=0.001, max=1000000.0)] = None
    slope_deg: Annotated[float, Option(min=-45.0, max=45.0)] = 0.0
    stairs: Annotated[str, Option(metavar="RISExRUN:N")] = ""
    turn_deg: Annotated[float, Option(min=-36000.0, max=36000.0)] = 0.0
    footholds: Path | None = None

    def plan(self, robot: str, settings: WalkSettings) -> WalkPlan:
        """Return the walk of a robot; raises as ``plan_walk``."""
        if self.turn_deg or self.footholds is not None or self.speeds:
            if (self.speed, self.stairs, self.slope_deg) != (None, "", 0.0):
                fail("a walk whose steps differ is on a level floor; leave out --speed, --slope-deg and --stairs")
            return nlp_gait.plan_route(
                robot,
                footholds=self.footholds,
                turn_deg=self.turn_deg,
                steps=self.steps,
                distance_m=self.distance,
                speeds_m_s=[options.parse_number("speed", v, "--speeds") for v in options.parse_names(self.speeds)],
                settings=settings,
            )
        if self.stairs:
            if (self.steps, self.distance, self.slope_deg) != (None, None, 0.0):
                fail("stairs determine steps and distance and are level; leave out --steps, --distance and --slope-deg")
            return nlp_gait.plan_climb(robot, self.stairs, speed_m_s=self.speed, settings=settings)
        return nlp_gait.plan_walk(
            robot,
            self.steps,
            speed_m_s=self.speed,
            distance_m=self.distance,
            slope_deg=self.slope_deg,
            settings=settings,
        )


@command
def plan(
    *,
    robot: str = "nao-v5",
    route: RouteOptions,
    margins: Annotated[str | None, Option(metavar="ALONG,ACROSS", help=MARGINS)] = None,
    values: Annotated[list[str] | None, Option("--set", metavar="NAME=VALUE")] = None,
    limits: options.Limits = None,
    starts: Annotated[int, Option(min=1, max=100)] = 3,
    out: Annotated[Path | None, OUTPUT_FILE] = None,
) -> Output:
    """Plan a whole walk from standing to standing: weight shift, half step, steps, half step, weight shift.

    Examples: `nlp-gait plan --robot nao-v5 --steps 10 --speed 0.05 --out walk.json`, then `nlp-gait simulate walk.json` and
    `nlp-gait export walk.json --to csv --period-ms 1`
    """
    given = dict(options.parse_pairs(values, "--set"))
    pairs = [("limits", ",".join(limits or ()))]
    if "intervals" in given:
        pairs.append(("intervals", given.pop("intervals")))
    numbers = {name: options.parse_number(name, text, "--set") for name, text in given.items()}
    of_phases = options.parse_options("nao-walk", pairs)
    least = None if margins is None else options.parse_numbers("a margin", margins, "--margins")
    settings = WalkSettings(values=numbers, margins=least, starts=starts, progress=say, **of_phases)
    walk = route.plan(robot, settings)
    if out is not None:
        walk.save(out)
    step = walk.solution.x.get("step_length_m")
    return Output(
        data=walk.to_json(),
        parts=[
            f"{walk.steps} steps, {walk.distance_m:.3f} m in {walk.duration_s:.2f} s: {walk.energy_J:.2f} J, "
            f"{walk.energy_J / walk.distance_m:.2f} J/m" + ("" if step is None else f"; steps of {step:.4f} m"),
            *(_describe_margins(walk.active_margins) if walk.feasible else ()),
        ],
        written=[] if out is None else [out],
        failures=[] if walk.feasible else ["no feasible walk was found. " + ". ".join(walk.obstacles)],
    )


def _describe_margins(active: Sequence[str]) -> Iterator[str]:
    if not active:
        yield "No balance margin is active"
        return
    hidden = f"; and {len(active) - SHOWN_MARGINS} more" if len(active) > SHOWN_MARGINS else ""
    yield f"Active margins: {'; '.join(active[:SHOWN_MARGINS])}{hidden}"
