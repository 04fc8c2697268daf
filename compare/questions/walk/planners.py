"""Other planners over the footsteps of the cheapest gaits: the textbook's cart-table, and the least squared torques."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from compare.questions.walk.study import CYCLE, Gait, result_of, walked
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.formulation.registry import find_maker
from nlp_gait.gaits.biped.body import LIFT
from nlp_gait.gaits.biped.cart_table import Footsteps, plan_cart_table_walk
from nlp_gait.gaits.biped.recorded_cycle import RecordedCycles
from nlp_gait.gaits.humanoid.problems import humanoid_cycles
from nlp_gait.gaits.nao.recorded import nao_cycles
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.robots.biped import make_biped
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk

CART_TABLE, LEAST_TORQUE, LEAST_POWER = "cart-table", "least-torque", "least-power"
PLANNERS = (CART_TABLE, LEAST_TORQUE)
HEIGHT = "hip_z_lift_off_m"  # variable whose bounds are those of the hip's height
HEIGHT_STEP_M = 0.005  # between the hip's heights that are tried, of NAO
# Makers of what the textbook walks, judged by the limits of each cycle.
ON_A_TABLE: dict[str, Callable[..., RecordedCycles]] = {"nao-cycle": nao_cycles, "humanoid-cycle": humanoid_cycles}


@dataclass(frozen=True, kw_only=True)
class Rival:
    """Gait of another planner over the footsteps of a cheapest gait.

    Attributes:
        planner: its name.
        at: value on the axis.
        indexes: exact performance figures, as of the cheapest gait; empty where there is no gait.
        broken: limits that do not hold, with their excess.
        note: what was chosen on the way, or why there is no gait.
        walk: playback in the engine; None if it was not played.
    """

    planner: str
    at: float
    indexes: Mapping[str, float]
    broken: tuple[str, ...]
    note: str
    walk: Walk | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries and numbers."""
        return asdict(self)


def checked_planners(names: Sequence[str], problem: GaitProblem) -> tuple[str, ...]:
    """Planners by name.

    Raises:
        InputError: one is not known, or does not know an option of the problem.
    """
    for name in names:
        if name not in PLANNERS:
            raise InputError(f"a baseline is one of {', '.join(PLANNERS)}, got {name!r}")
    if CART_TABLE in names:
        usual = find_maker(problem.name)().options
        for name, value in problem.options.items():
            if name not in ("objective", *_shared(problem)) and value != usual.get(name):
                raise InputError(f"the {CART_TABLE} walk is not judged with {name}={value}; leave that option out")
    return tuple(dict.fromkeys(names))


def _shared(problem: GaitProblem) -> dict[str, Any]:
    """Options of a cycle that its textbook walk has too."""
    known = inspect.signature(ON_A_TABLE[problem.name]).parameters
    return {name: value for name, value in problem.options.items() if name in known}


def rivals(
    spec: ProblemSpec,
    gaits: Sequence[Gait],
    planners: Sequence[str],
    *,
    starts: int,
    seed: int,
    steps: int,
    drive: Drive,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> Iterator[Rival]:
    """Gaits of other planners over the footsteps, the times and the swing height of each feasible gait, one after the other.

    Args:
        spec: of the gaits, of least power.
        gaits: cheapest ones.
        planners: some of ``PLANNERS``.
        starts: of IPOPT for least squared torques.
        seed: of these.
        steps: that are played; 0 plays none.
        drive: of the playback.
        store: of finished results; None stores nothing.
        progress: told of each gait.
    """
    store = store or Store()
    for gait in gaits:
        if not gait.found.feasible:
            continue
        for planner in planners:
            if planner == CART_TABLE:
                planned = cart_table(result_of(spec, gait.found), gait, store)
            else:
                planned = least_torque(spec, gait, starts, seed, store)
            yield _rival(planner, gait.at, planned, steps, drive, store)
            progress(f"{planner} {gait.at:g}")


def cart_table(own: Result, gait: Gait, store: Store) -> tuple[Result | None, str]:
    """The textbook's walk at the cheapest height of its hip: from the highest that reaches, lower as long as it pays."""
    problem = own.problem
    body = ON_A_TABLE[problem.name](**_shared(problem))
    single, double = (gait.found.x[name] for name in problem.display.durations)

    def at(height_m: float) -> Result:
        footsteps = Footsteps(
            step_m=gait.indexes["step_length_m"],
            single_s=single,
            double_s=double,
            hip_height_m=height_m,
            lift_m=gait.found.x[LIFT],
        )
        walk = plan_cart_table_walk(body, footsteps)
        known = {parameter.name for parameter in walk.problem.parameters}
        shared = {name: value for name, value in problem.values.items() if name in known}
        return replace(walk, problem=walk.problem.with_values(**shared))

    def cheapest() -> float | None:
        best: tuple[float, float | None] = (np.inf, None)
        low, high = (problem.value(f"{HEIGHT}.{end}") for end in ("lower", "upper"))
        for height in np.arange(high, low - 1e-9, -height_step_m(problem)):
            try:
                walk = at(float(height))
            except InputError:  # a foot is out of reach
                continue
            energy = build_exact_model(walk.problem).at(walk.x, walk.problem.p).indexes["energy_J_per_m"]
            if energy >= best[0]:
                break
            best = energy, float(height)
        return best[1]

    height = store.compute(f"{CART_TABLE}-{{key}}", {**fingerprint(problem), "x": own.x.tolist()}, cheapest)
    if height is None:
        return None, "no height of the hip reaches"
    return at(height), f"hip {1000.0 * height:.0f} mm high"


def height_step_m(problem: GaitProblem) -> float:
    """Between the hip's heights that are tried: NAO's, of other robots in proportion to their legs [m]."""
    if problem.name == CYCLE:
        return HEIGHT_STEP_M
    assert problem.display.robot is not None  # a cycle is some robot's; for the type checker
    return HEIGHT_STEP_M * make_biped(problem.display.robot).length_scale


def least_torque(spec: ProblemSpec, gait: Gait, starts: int, seed: int, store: Store) -> tuple[Result | None, str]:
    """The gait of least squared torques at the same times, so with the same steps."""
    own = result_of(spec, gait.found).problem
    problem = replace(spec, options={**spec.options, "objective": "torque"}).load().with_values(**own.values)
    same = {name: gait.found.x[name] for name in (*own.display.durations, LIFT)}
    solution = solve(problem, starts=starts, seed=seed, fix=same, solver=store_runs(store))
    if not solution.converged:
        return None, solution.status
    return Result(problem=problem, x=problem.check_x(solution.x)), ""


def _rival(
    planner: str, at: float, planned: tuple[Result | None, str], steps: int, drive: Drive, store: Store
) -> Rival:
    """A planned gait, judged and played."""
    result, note = planned
    if result is None:
        return Rival(planner=planner, at=at, indexes={}, broken=(), note=note)
    exact = build_exact_model(result.problem)
    values = exact.at(result.x, result.problem.p)
    broken = tuple(f"{row.name} by {row.violation:.2g} {row.unit}" for row in exact.find_violated(values))
    walk = walked(result, steps, drive, store) if steps else None
    return Rival(planner=planner, at=at, indexes=dict(values.indexes), broken=broken, note=note, walk=walk)
