"""The price of a motion that keeps its limits whatever masses and soles turn out to be within their tolerances.

The uncertain robots form a box: each mass within a share, each sole within a distance. A scenario problem over a few of its
corners is solved; then the corner that is worst for each limit, by the rows' derivatives, joins them, until none that is found in
this way breaks a limit or costs more.

Source:
    Mutapcic, Boyd (2009), Cutting-set methods for robust convex optimization with pessimizing oracles, used here on a problem
    that is not convex: the corners are checked exactly, but it is not proven that the box holds no worse point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare.questions.robust.family import Box, Corner, Family, Worst
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import ProblemSpec
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import replace_nan
from nlp_gait.formulation.solution import Solution
from nlp_gait.formulation.worst_case import make_worst_case
from nlp_gait.progress import Progress, ignore_progress

ROUNDS = 8


@dataclass(frozen=True, kw_only=True)
class Robust:
    """A motion that keeps its limits in a box of robots.

    Attributes:
        name: of the box, in words.
        box: half-widths by quantity.
        corners: changes of the robots in the scenario problem; the first is the nominal one, without changes.
        robots: their names.
        rounds: number of searches for worse corners.
        settled: whether the last round found no worse corner.
        status: of the last solution.
        nominal_x: optimum for the nominal robot alone.
        nominal_W: its power there.
        nominal_worst: what it meets in the corners.
        x: robust optimum.
        power_W: with the nominal robot.
        worst_W: in the worst corner: what was minimised.
        worst: what the robust motion meets in the corners.
        random_worst: what it meets in random corners that had no part in it.
    """

    name: str
    box: Mapping[str, float]
    corners: tuple[Mapping[str, float], ...]
    robots: tuple[str, ...]
    rounds: int
    settled: bool
    status: str
    nominal_x: Mapping[str, float]
    nominal_W: float
    nominal_worst: Worst
    x: Mapping[str, float]
    power_W: float
    worst_W: float
    worst: Worst
    random_worst: Worst


def boxes(spec: ProblemSpec, mass: float, sole_m: float) -> dict[str, Box]:
    """Boxes of uncertainty, each wider than the one before: soles alone, with the whole robot's mass, with each link's."""
    robot = spec.load().display.robot
    if robot is None:
        raise InputError(f"problem {spec.name!r} has no robot to be uncertain about; the NAO problems have one")
    soles = {"sole_x_m": sole_m, "sole_y_m": sole_m}
    links = {f"{link}.mass": mass for link in robot.links}
    return {
        "soles": soles,
        "soles, mass of the whole": {"mass": mass, **soles},
        "soles, mass of each link": {**links, **soles},
    }


def robust(
    spec: ProblemSpec,
    name: str,
    box: Box,
    *,
    starts: int = 10,
    seed: int = 0,
    samples: int = 20,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> Robust:
    """Robust optimum over a box of robots.

    Args:
        spec: a NAO problem.
        name: of the box.
        box: half-widths by the robot's quantity.
        starts: random starts of the nominal problem.
        seed: of the starts and of the random corners.
        samples: random corners on which the robust optimum is checked.
        store: of finished results; None stores nothing.
        progress: told each step when it begins.
    """
    store = store or Store()
    asked = {"box": dict(box), "name": name, "starts": starts, "seed": seed, "samples": samples}

    def found() -> dict[str, Any]:
        return dict(replace_nan(asdict(_found(spec, name, box, starts, seed, samples, store_runs(store), progress))))

    return decode(Robust, store.compute("box-{key}", {**fingerprint(spec.load()), **asked}, found))


def _found(
    spec: ProblemSpec, name: str, box: Box, starts: int, seed: int, samples: int, solver: Solver, progress: Progress
) -> Robust:
    family = Family(spec, box)
    progress(f"{name}: nominal optimum")
    nominal = solve(family.nominal, starts=starts, seed=seed, solver=solver)
    _require(nominal, "the nominal problem")
    first = x = family.nominal.check_x(nominal.x)
    corners: list[Corner] = [family.centre]
    found, settled, rounds = nominal, False, 0
    for rounds in range(1, ROUNDS + 1):
        progress(f"{name}: round {rounds}, {len(corners)} scenarios")
        worse = family.worst_corners(x, corners, float(found.objective))
        if not worse:
            settled = True
            break
        corners += worse
        found = solve(make_worst_case([family.problem(corner) for corner in corners]), x0=x, solver=solver)
        _require(found, f"{len(corners)} scenarios together ({name})")
        x = family.nominal.check_x(found.x)
    rng = np.random.default_rng(seed)
    random = [tuple(rng.choice((-1, 1), len(box)).tolist()) for _ in range(samples)]
    progress(f"{name}: {samples} random corners")
    return Robust(
        name=name,
        box=dict(box),
        corners=tuple(family.changes(corner) for corner in corners),
        robots=tuple(family.robot(corner) for corner in corners),
        rounds=rounds,
        settled=settled,
        status=found.status,
        nominal_x=nominal.x,
        nominal_W=nominal.objective,
        nominal_worst=family.worst(first, corners),
        x=found.x,
        power_W=family.values(family.centre, x).cost,
        worst_W=found.objective,
        worst=family.worst(x, corners),
        random_worst=family.worst(x, random or corners),
    )


def _require(solution: Solution, what: str) -> None:
    if not solution.converged:
        raise InputError(f"{what}: {solution.status}; a smaller uncertainty or more --starts may help")
