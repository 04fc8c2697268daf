"""Other planners over the footsteps of the cheapest gaits: the textbook's cart-table, and the least squared torques."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from compare.questions.walk.study import Gait, result_of
from compare.study.progress import Progress, unwatched
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import exact_model, violated_rows
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.problem import Result
from nlp_gait.problems.nao.cycle.cart_table import Footsteps, cart_table_walk
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.plan import plan_of
from nlp_gait.simulation.playback import play
from nlp_gait.simulation.walking import Walk, measure_walk

CART_TABLE, LEAST_TORQUE, LEAST_POWER = "cart-table", "least-torque", "least-power"
PLANNERS = (CART_TABLE, LEAST_TORQUE)
HEIGHT_STEP_M = 0.005  # between the hip's heights that are tried


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


def checked_planners(names: Sequence[str]) -> tuple[str, ...]:
    """Planners by name.

    Raises:
        InputError: one is not known.
    """
    for name in names:
        if name not in PLANNERS:
            raise InputError(f"a baseline is one of {', '.join(PLANNERS)}, got {name!r}")
    return tuple(dict.fromkeys(names))


def rivals(
    spec: ProblemSpec,
    gaits: Sequence[Gait],
    planners: Sequence[str],
    *,
    starts: int,
    seed: int,
    steps: int,
    drive: Drive,
    progress: Progress = unwatched,
) -> list[Rival]:
    """Gaits of other planners over the footsteps, the times and the swing height of each feasible gait.

    Args:
        spec: of the gaits, of least power.
        gaits: cheapest ones.
        planners: some of ``PLANNERS``.
        starts: of IPOPT for least squared torques.
        seed: of these.
        steps: that are played; 0 plays none.
        drive: of the playback.
        progress: told of each gait.
    """
    found = []
    for gait in gaits:
        if not gait.found.feasible:
            continue
        for planner in planners:
            plan = cart_table if planner == CART_TABLE else least_torque
            found.append(_rival(planner, gait.at, plan(spec, gait, starts, seed), steps, drive))
            progress(f"{planner} {gait.at:g}")
    return found


def cart_table(spec: ProblemSpec, gait: Gait, starts: int, seed: int) -> tuple[Result | None, str]:
    """The textbook's walk at the cheapest height of its hip: from the highest that reaches, lower as long as it pays."""
    own = result_of(spec, gait.found)
    problem, x = own.problem, dict(gait.found.x)
    single, double = (x[name] for name in problem.durations)
    best: tuple[float, Result | None, str] = (np.inf, None, "no height of the hip reaches")
    low, high = (problem.value(f"hip_z_lift_off_m.{end}") for end in ("lower", "upper"))
    for height in np.arange(high, low - 1e-9, -HEIGHT_STEP_M):
        footsteps = Footsteps(
            step_m=gait.indexes["step_length_m"],
            single_s=single,
            double_s=double,
            hip_height_m=float(height),
            lift_m=x["swing_height_m"],
        )
        try:
            walk = cart_table_walk(
                footsteps, robot=str(problem.options["robot"]), intervals=int(problem.options["intervals"])
            )
        except InputError:  # out of reach
            continue
        shared = {name: value for name, value in problem.values.items() if name in walk.problem.values}
        result = Result(problem=walk.problem.with_values(**shared), x=np.array(walk.x))
        energy = exact_model(result.problem).at(result.x, result.problem.p).indexes["energy_J_per_m"]
        if energy >= best[0]:
            break
        best = energy, result, f"hip {1000.0 * height:.0f} mm high"
    return best[1:]


def least_torque(spec: ProblemSpec, gait: Gait, starts: int, seed: int) -> tuple[Result | None, str]:
    """The gait of least squared torques at the same times, so with the same steps."""
    own = result_of(spec, gait.found).problem
    options = {**spec.options, "objective": "torque"}
    problem = replace(spec, options=options).load().with_values(**own.values)
    times = {name: gait.found.x[name] for name in (*own.durations, "swing_height_m")}
    solution = solve(problem, starts=starts, seed=seed, fix=times)
    if not solution.success:
        return None, solution.status
    return Result(problem=problem, x=problem.check_x(solution.x)), ""


def _rival(planner: str, at: float, planned: tuple[Result | None, str], steps: int, drive: Drive) -> Rival:
    """A planned gait, judged and played."""
    result, note = planned
    if result is None:
        return Rival(planner=planner, at=at, indexes={}, broken=(), note=note)
    exact = exact_model(result.problem)
    values = exact.at(result.x, result.problem.p)
    broken = tuple(f"{row.name} by {row.violation:.2g} {row.unit}" for row in violated_rows(exact.rows(values)))
    walk = None
    if steps:
        plan = plan_of(result, steps)
        walk = measure_walk(plan, play(plan, drive=drive), drive, steps)
    indexes = {name: float(value) for name, value in values.indexes.items()}
    return Rival(planner=planner, at=at, indexes=indexes, broken=broken, note=note, walk=walk)
