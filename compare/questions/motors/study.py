"""What real motors change: the optimum of a NAO phase with one set of their features after another."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.registry import find_maker
from nlp_gait.interrupts import Interrupted
from nlp_gait.progress import Progress, ignore_progress

# Each variant with the features of ``nao_motors``; the first is the paper's.
VARIANTS: Mapping[str, str] = {
    "as published": "",
    "+ speed and torque limits": "limits",
    "+ coupled ankles": "limits,ankle",
    "with these, braking is free": "limits,ankle,free-braking",
    "with these, braking gives back": "limits,ankle,regeneration",
    "with these, K of each motor": "limits,ankle,heat",
    "with these, K and free braking": "limits,ankle,heat,free-braking",
    "with these, inertia of rotors": "limits,ankle,rotor",
}
# Rows of the problem with limits, and what their largest share of the limit is called.
USES = {
    "speed": ("joint_speed",),
    "torque against speed": ("torque_forwards", "torque_backwards"),
    "continuous torque": ("continuous_torque",),
}


@dataclass(frozen=True, kw_only=True)
class Use:
    """Largest share of one kind of limit that a gait uses, and where."""

    share: float
    row: str


@dataclass(frozen=True, kw_only=True)
class Variant:
    """The optimum with some features of the motors.

    Attributes:
        name: in words.
        features: as in the option ``motors``.
        success: whether IPOPT converged to a feasible point.
        status: in words.
        power_W: at the optimum, as this variant calculates it.
        unchanged_power_W: at the published optimum, as this variant calculates it.
        unchanged_violation: of the published optimum under this variant's limits, 0 if it keeps them.
        published_power_W: at this variant's optimum, as the paper calculates it.
        x: by variable name.
        moved: largest distance of a variable from the published optimum, in units of its range, and the variable's name.
        uses: by kind of limit, at this optimum, whether or not the variant has the limits.
    """

    name: str
    features: str
    success: bool
    status: str
    power_W: float
    unchanged_power_W: float
    unchanged_violation: float
    published_power_W: float
    x: Mapping[str, float]
    moved: tuple[float, str]
    uses: Mapping[str, Use]


def motor_variants(
    spec: ProblemSpec,
    *,
    starts: int = 10,
    seed: int = 0,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> tuple[Variant, ...]:
    """Optimum under each variant.

    Args:
        spec: a NAO phase, without the option ``motors``.
        starts: random starts of IPOPT for each.
        seed: of the starts.
        store: of finished results; None stores nothing.
        progress: told the name of each variant when it is solved.

    Raises:
        InputError: a problem without motors, or one that has the option already.
        Interrupted: Ctrl-C; carries the variants that were solved until then.
    """
    published = spec.load()
    if "motors" in spec.options:
        raise InputError("the command goes through all variants of motors itself; leave out --option motors")
    if "motors" not in inspect.signature(find_maker(spec.address)).parameters:
        raise InputError(f"only nao-ssp and nao-dsp know their motors, got {spec.name!r}")
    store = store or Store()
    store.report_changes("motors", published, starts=starts, seed=seed)
    solver = store_runs(store)
    limited = {rotor: spec.with_options(motors=f"limits{rotor}").load() for rotor in ("", ",rotor")}
    found: list[Variant] = []
    try:
        for name, features in VARIANTS.items():
            problem = spec.with_options(motors=features).load() if features else published
            first = published.check_x(found[0].x) if found else None
            solution = solve(problem, starts=starts, seed=seed, x0=first, solver=solver)
            x = problem.check_x(solution.x)
            unmoved = x if first is None else first
            moves = np.abs(x - unmoved) / problem.scale
            unchanged = build_exact_model(problem).at(unmoved, problem.p)
            found.append(
                Variant(
                    name=name,
                    features=features,
                    success=solution.converged,
                    status=solution.status,
                    power_W=solution.objective,
                    unchanged_power_W=unchanged.cost,
                    unchanged_violation=unchanged.violation,
                    published_power_W=build_exact_model(published).at(x, published.p).cost,
                    x=solution.x,
                    moved=(float(moves.max()), problem.names[int(moves.argmax())]),
                    uses=limit_uses(limited[",rotor" if "rotor" in features else ""], x),
                )
            )
            progress(name)
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted after {len(found)} of {len(VARIANTS)} variants", tuple(found)) from None
    return tuple(found)


def limit_uses(limited: GaitProblem, x: Array) -> dict[str, Use]:
    """Largest shares of the motors' limits that x (n,) uses, in a problem with ``motors=limits``."""
    names, at = build_exact_model(limited).row_names, build_exact_model(limited).at(x, limited.p)
    uses = {}
    for kind, groups in USES.items():
        rows = [i for i, name in enumerate(names) if name.partition("[")[0] in groups]
        shares = [at.g[i] / (at.upper[i] if at.g[i] > 0.0 else at.lower[i]) for i in rows]
        largest = int(np.argmax(shares))
        uses[kind] = Use(share=float(shares[largest]), row=names[rows[largest]])
    return uses
