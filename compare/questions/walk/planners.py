"""Other planners on the footsteps of the cheapest gaits: the textbook's cart-table, and the least squared torques."""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import list_units, make_axis_label, with_unit
from compare.drawing.figures import make_axes, use_style
from compare.questions.perturbed_problem import rebuild
from compare.questions.question import Work, make_csv_table, make_table
from compare.questions.walk.cheapest_cycle import Gait, describe_end, simulate_walk
from compare.report.document import Figure, Part, Value
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.biped.body import LIFT
from nlp_gait.gaits.biped.cart_table import Footsteps, plan_cart_table_walk
from nlp_gait.gaits.capabilities import CART_TABLE_BODIES, resolve
from nlp_gait.robots.biped import make_biped_model
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk

CART_TABLE, LEAST_TORQUE, LEAST_POWER = "cart-table", "least-torque", "least-power"
PLANNERS = (CART_TABLE, LEAST_TORQUE)
COLOURS = {CART_TABLE: "#D55E00", LEAST_TORQUE: "#009E73", LEAST_POWER: "#000000"}
HEIGHT = "hip_z_lift_off_m"  # variable whose bounds are those of the hip's height
HEIGHT_STEP_M = 0.005  # between the hip's heights that are tried, of NAO
# By how much the battery's energy fell from the cart-table to the least squared torques, at 0.5 to 1.3 m/min [%].
PUBLISHED = (9.16, 13.35)
SOURCE = (
    "the electric energy of a small biped, three speeds of ten runs each (doi 10.1177/1729881420917808; abstract read)"
)
SHOWN_LIMITS = 2
Place = Literal["model", "engine"]
PLACES: tuple[Place, ...] = ("model", "engine")


@dataclass(frozen=True, kw_only=True)
class PlannedGait:
    """Gait of a planner on the footsteps of a cheapest gait."""

    planner: str  #: its name
    at: float  #: value on the axis
    indexes: Mapping[str, float]  #: exact performance indexes; empty if there is no gait
    broken: tuple[str, ...]  #: violated limits, with their violation
    note: str  #: what the planner chose, or why there is no gait
    walk: Walk | None = None  #: in the engine; None without a simulation

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self)

    def energy(self, where: Place) -> float | None:
        """Return the energy for each planned metre [J/m], if it is known."""
        if where == "model":
            return self.indexes.get("energy_J_per_m")
        return None if self.walk is None else self.walk.engine_J_per_planned_m


def check_planners(names: Sequence[str], problem: GaitProblem) -> None:
    """Raise InputError if a planner is unknown, or does not support an option of the problem."""
    for name in names:
        if name not in PLANNERS:
            raise InputError(f"a baseline is one of {', '.join(PLANNERS)}, got {name!r}")
    if CART_TABLE in names:
        shared = _select_shared_options(problem)
        defaults = ProblemSpec(name=problem.address, options=shared).load().options
        for name, value in problem.options.items():
            if name not in ("objective", *shared) and value != defaults.get(name):
                raise InputError(f"the {CART_TABLE} walk does not support {name}={value}; leave that option out")


def _select_shared_options(problem: GaitProblem) -> dict[str, Any]:
    """Options of a cycle that its textbook walk has too."""
    known = inspect.signature(resolve(CART_TABLE_BODIES, problem.name)).parameters
    return {name: value for name, value in problem.options.items() if name in known}


def plan_gaits(
    problem: GaitProblem,
    gaits: Sequence[Gait],
    planners: Sequence[str],
    *,
    starts: int,
    seed: int,
    steps: int,
    drive: Drive,
    work: Work,
) -> Iterator[PlannedGait]:
    """Yield the gaits of other planners with the footsteps, durations and swing height of each feasible gait.

    Starts and seed are those of IPOPT for least squared torques; so many steps are simulated, none for 0.
    """
    for gait in gaits:
        for planner in planners if gait.point.feasible else ():
            if planner == CART_TABLE:
                result, note = plan_cart_table(gait, work)
            else:
                result, note = plan_least_torque(problem, gait, starts, seed, work)
            yield _judge(planner, gait.at, result, note, steps, drive, work)
            work.progress(f"{planner} {gait.at:g}")


def plan_cart_table(gait: Gait, work: Work) -> tuple[Result | None, str]:
    """Return the textbook's walk at the cheapest height of its hip, from the highest that reaches downwards."""
    problem, x = gait.result.problem, gait.point.x
    cycles = resolve(CART_TABLE_BODIES, problem.name)(**_select_shared_options(problem))
    single, double = (x[name] for name in problem.display.durations)

    def plan(height_m: float) -> Result:
        step_m = gait.indexes["step_length_m"]
        footsteps = Footsteps(step_m=step_m, single_s=single, double_s=double, hip_height_m=height_m, lift_m=x[LIFT])
        walk = plan_cart_table_walk(cycles, footsteps)
        known = {parameter.name for parameter in walk.problem.parameters}
        shared = {name: value for name, value in problem.values.items() if name in known}
        return replace(walk, problem=walk.problem.with_values(**shared))

    def find_height() -> float | None:
        least, best = np.inf, None
        low, high = (problem.value(f"{HEIGHT}.{end}") for end in ("lower", "upper"))
        for height in np.arange(high, low - 1e-9, -compute_height_step(problem)).tolist():
            try:
                walk = plan(height)
            except InputError:  # a foot is out of reach
                continue
            energy = build_exact_model(walk.problem).at(walk.x, walk.problem.p).indexes["energy_J_per_m"]
            if energy >= least:
                break
            least, best = energy, height
        return best

    inputs = {**fingerprint(problem), "x": gait.result.x.tolist()}
    height = work.store.compute(f"{CART_TABLE}-{{key}}", inputs, find_height)
    if height is None:
        return None, "no height of the hip reaches"
    return plan(height), f"hip {1000.0 * height:.0f} mm high"


def compute_height_step(problem: GaitProblem) -> float:
    """Return the step between the hip's heights that are tried, in proportion to the legs [m]."""
    robot = problem.display.robot
    assert robot is not None  # a cycle has a robot; for the type checker
    return HEIGHT_STEP_M * round(make_biped_model(robot).length_scale, 12)


def plan_least_torque(
    problem: GaitProblem, gait: Gait, starts: int, seed: int, work: Work
) -> tuple[Result | None, str]:
    """Return the gait of least squared torques with the same durations, so with the same steps."""
    least_power = gait.result.problem
    problem = rebuild(problem, objective="torque").with_values(**least_power.values)
    same = {name: gait.point.x[name] for name in (*least_power.display.durations, LIFT)}
    solution = solve(problem, starts=starts, seed=seed, fix=same, solver=work.solver())
    if not solution.converged:
        return None, solution.status
    return Result(problem=problem, x=problem.check_x(solution.x)), ""


def _judge(
    planner: str, at: float, result: Result | None, note: str, steps: int, drive: Drive, work: Work
) -> PlannedGait:
    if result is None:
        return PlannedGait(planner=planner, at=at, indexes={}, broken=(), note=note)
    exact = build_exact_model(result.problem)
    values = exact.at(result.x, result.problem.p)
    broken = tuple(f"{row.name} by {row.violation:.2g} {row.unit}" for row in exact.find_violated(values))
    walk = simulate_walk(result, steps, drive, work) if steps else None
    return PlannedGait(planner=planner, at=at, indexes=dict(values.indexes), broken=broken, note=note, walk=walk)


def report_planners(problem: GaitProblem, gaits: Sequence[Gait], others: Sequence[PlannedGait]) -> list[Part]:
    """Return table, sentences, figure and CSV of the planners; none without other planners."""
    if not others:
        return []
    (name,) = gaits[0].point.at
    floor = {
        gait.at: PlannedGait(planner=LEAST_POWER, at=gait.at, indexes=gait.indexes, broken=(), note="", walk=gait.walk)
        for gait in gaits
        if gait.point.feasible
    }
    planned = sorted([*floor.values(), *others], key=lambda row: (row.at, list(COLOURS).index(row.planner)))
    stem = f"{problem.name}-planners"
    columns: dict[str, Callable[[PlannedGait], str]] = {
        name: lambda row: f"{row.at:g}",
        "planner": lambda row: row.planner,
        "model": lambda row: with_unit(row.energy("model"), "J/m", ".2f"),
        "engine": lambda row: with_unit(row.energy("engine"), "J/m", ".2f"),
        "least power saves": lambda row: _format_saving(row, floor[row.at]),
        "in the engine": _describe_simulation,
    }
    header = [name, "planner", "model_J_per_m", "engine_J_per_m", "step_length_m", "broken", "note"]
    rows: list[list[Value]] = [
        [
            *(row.at, row.planner, row.energy("model"), row.energy("engine")),
            *(row.indexes.get("step_length_m"), "; ".join(row.broken), row.note),
        ]
        for row in planned
    ]
    caption = "Energy for each planned metre with the same footsteps; solid: model, dashed: engine."
    return [
        make_table("Planners with the same footsteps, durations and swing heights", planned, columns),
        *_describe_savings(planned),
        *_describe_violations(planned),
        Figure(name=stem, caption=caption, drawing=plot_planners(name, problem, planned)),
        make_csv_table(stem, header, rows),
    ]


def _format_saving(row: PlannedGait, least: PlannedGait) -> str:
    share = _compute_saving(row.energy("model"), least.energy("model"))
    return "-" if row is least or share is None else f"{share:.1f} %"


def _compute_saving(energy: float | None, less: float | None) -> float | None:
    """By how much one is less than the other [%]."""
    return None if energy is None or less is None else 100.0 * (1.0 - less / energy)


def _describe_simulation(row: PlannedGait) -> str:
    if row.walk is None:
        return row.note if row.energy("model") is None else "not simulated"
    return describe_end(row.walk)


def _describe_savings(planned: Sequence[PlannedGait]) -> list[Part]:
    """What least power saves, and what least torques save next to the published range."""
    by = {(row.planner, row.at): row for row in planned}
    sentences: list[Part] = []
    for better, worse in ((LEAST_POWER, CART_TABLE), (LEAST_POWER, LEAST_TORQUE), (LEAST_TORQUE, CART_TABLE)):
        pairs = [(by[worse, at], by[better, at]) for name, at in by if name == worse and (better, at) in by]
        ranges = []
        for where in PLACES:
            shares = [s for a, b in pairs if (s := _compute_saving(a.energy(where), b.energy(where))) is not None]
            if shares:
                ranges.append(f"{min(shares):.1f} to {max(shares):.1f} % in the {where}")
        if ranges:
            sentences.append(f"Less energy by {better} than by {worse}: {', '.join(ranges)}.")
            if better == LEAST_TORQUE:
                sentences.append("Published: {} to {} %, {}.".format(*PUBLISHED, SOURCE))
    return sentences


def _describe_violations(planned: Sequence[PlannedGait]) -> list[Part]:
    sentences: list[Part] = []
    for planner in COLOURS:
        worst = {limit.split(" by ")[0]: limit for row in planned if row.planner == planner for limit in row.broken}
        if worst:
            named = ", ".join(list(worst.values())[:SHOWN_LIMITS])
            more = f" and {len(worst) - SHOWN_LIMITS} more" if len(worst) > SHOWN_LIMITS else ""
            sentences.append(f"Limits that {planner} violates, for example: {named}{more}.")
    return sentences


def plot_planners(name: str, problem: GaitProblem, planned: Sequence[PlannedGait]) -> Drawing:
    """Plot the energy per metre along the axis, with a colour for each planner."""
    with use_style():
        figure, axes = make_axes(6.3, 3.2)
        for planner, colour in COLOURS.items():
            rows = [row for row in planned if row.planner == planner]
            for where, line in zip(PLACES, ("o-", "s--"), strict=True):
                points = [(row.at, value) for row in rows if (value := row.energy(where)) is not None]
                if points:
                    label = planner if where == "model" else None
                    axes.plot(*zip(*points, strict=True), line, color=colour, label=label, markersize=4)
        axes.set(ylabel="energy [J/m]", xlabel=make_axis_label(name, list_units(problem)[name]))
        axes.set_ylim(bottom=0.0)
        axes.legend()
    return figure
