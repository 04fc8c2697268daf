"""GaitBench 1: the definition of each instance. An entry never changes; an instance that has to change gets a new id."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from nlp_gait.errors import unknown

Difficulty = Literal["easy", "medium", "hard"]
Subset = Literal["small", "full"]

NAO = "Gupta, Pratihar, Deb (2023), sections 3 and 4"
CYCLE = f"{NAO}; joined to a walking cycle by this package"
SPLINES = f"{NAO}; richer curves by this package"
WALK12 = "Goswami, Vadakkepat, Phung (2008), section 5"
STAIRS = "Bhardwaj, Mishra, Sukavanam, Balasubramanian, section V"


@dataclass(frozen=True, kw_only=True)
class Definition:
    """What an instance is made from.

    Attributes:
        id: its name, which never changes.
        what: one line.
        problem: name, as in ``nlp-gait list``.
        options: of the problem.
        values: parameters that differ from their defaults.
        held: variables that are constants here.
        difficulty: graded by the results of the shipped baseline: variables, share of feasible points, local optima.
        small: whether it also belongs to the subset ``small``.
        source: paper that the problem comes from.
    """

    id: str
    what: str
    problem: str
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    held: Mapping[str, float] = field(default_factory=dict)
    difficulty: Difficulty
    small: bool = False
    source: str = NAO


def _walk12(id: str, what: str, weight: float, *, small: bool = False, **values: float) -> Definition:
    return Definition(
        id=id,
        what=f"12-joint walk, {what}",
        problem="walk12",
        options={"horizon": "1s"} if values else {},
        values={"lambda": weight, **values},
        difficulty="easy",
        small=small,
        source=WALK12,
    )


def _phase(
    id: str,
    what: str,
    difficulty: Difficulty = "medium",
    *,
    robot: str = "nao-v5",
    values: Mapping[str, float] | None = None,
    held: Mapping[str, float] | None = None,
    small: bool = False,
    source: str = NAO,
    **options: str | int | float | bool,
) -> Definition:
    """Define a phase of NAO, whose id begins with ``ssp``, ``dsp`` or ``cycle``."""
    kinds = {
        "ssp": ("nao-ssp", "single support"),
        "dsp": ("nao-dsp", "double support"),
        "cycle": ("nao-cycle", "cycle"),
    }
    free = "-free-" in id
    problem, phase = kinds[id.split("-")[0]]
    return Definition(
        id=id,
        what=f"NAO {robot.removeprefix('nao-').upper()}, {phase}, {what}",
        problem=f"{problem}-free" if free else problem,
        options={"robot": robot, **options},
        values=values or {},
        held=held or {},
        difficulty=difficulty,
        small=small,
        source=source,
    )


SSP_TIME, DSP_TIME, LIFT = "single_support_time_s", "double_support_time_s", "swing_height_m"

DEFINITIONS: tuple[Definition, ...] = (
    _walk12("walk12-w015", "weight 0.15 on stability", 0.15, small=True),
    _walk12("walk12-w050", "weight 0.5 on stability", 0.5),
    _walk12("walk12-w085", "weight 0.85 on stability", 0.85),
    _walk12("walk12-w100", "stability alone", 1.0, small=True),
    _walk12("walk12-fast-w015", "two steps a second, weight 0.15", 0.15, step_time_s=0.5),
    _walk12("walk12-fast-w100", "two steps a second, stability alone", 1.0, step_time_s=0.5),
    _phase("ssp-v5", "steps of 0.06 m, as published", small=True, step_length_m=0.06),
    _phase("ssp-v5-step040", "steps of 0.04 m", step_length_m=0.04),
    _phase("ssp-v5-step050", "steps of 0.05 m", step_length_m=0.05),
    _phase("ssp-v5-step070", "steps of 0.07 m", step_length_m=0.07),
    _phase("ssp-v5-step080", "steps of 0.08 m", small=True, step_length_m=0.08),
    _phase("ssp-v4", "steps of 0.06 m", robot="nao-v4"),
    _phase("ssp-v6", "steps of 0.06 m", robot="nao-v6", small=True),
    _phase("ssp-v6-step080", "steps of 0.08 m", robot="nao-v6", step_length_m=0.08),
    _phase("ssp-v5-time06", "in 0.6 s", held={SSP_TIME: 0.6}),
    _phase("ssp-v5-time10", "in 1 s", held={SSP_TIME: 1.0}, small=True),
    _phase("ssp-v5-time20", "in 2 s", held={SSP_TIME: 2.0}),
    _phase("ssp-v6-time10", "in 1 s", robot="nao-v6", held={SSP_TIME: 1.0}),
    _phase("ssp-v5-lift24", "foot lifted by 24 mm", held={LIFT: 0.024}),
    _phase("ssp-v5-lift30", "foot lifted by 30 mm", held={LIFT: 0.03}),
    _phase("ssp-v5-torque03", "torques change by at most 0.3 Nm", values={"torque_change_limit_Nm": 0.3}),
    _phase("ssp-v5-jerk", "least joint jerk", objective="jerk"),
    _phase("ssp-v5-smooth", "smoothest torques", objective="torque-smoothness"),
    _phase("dsp-v5", "steps of 0.06 m, as published", small=True),
    _phase("dsp-v5-lever", "torso carried by the lever rule", torso_share="lever"),
    _phase("dsp-v4", "steps of 0.06 m", robot="nao-v4"),
    _phase("dsp-v6-lever", "torso carried by the lever rule", robot="nao-v6", torso_share="lever", small=True),
    _phase("dsp-v5-step080", "steps of 0.08 m", step_length_m=0.08),
    _phase("dsp-v5-time05", "in 0.5 s", held={DSP_TIME: 0.5}),
    _phase("cycle-v5", "least energy per metre", "hard", small=True, source=CYCLE),
    _phase("cycle-v5-printed", "torso's mass shared as printed", "hard", torso_share="printed", source=CYCLE),
    _phase("cycle-v5-speed", "least power at a given speed", "hard", objective="power", source=CYCLE),
    _phase("cycle-v6", "least energy per metre", "hard", robot="nao-v6", source=CYCLE),
    _phase("ssp-v5-quintic", "quintics", "hard", trajectory="quintic", source=SPLINES),
    _phase("ssp-v5-spline2", "splines of two spans", "hard", trajectory="spline-2", source=SPLINES),
    _phase("ssp-v5-spline4", "splines of four spans", "hard", trajectory="spline-4", source=SPLINES),
    _phase("ssp-v5-spline8", "splines of eight spans", "hard", trajectory="spline-8", source=SPLINES),
    _phase("dsp-v5-quintic", "quintics", "hard", small=True, trajectory="quintic", source=SPLINES),
    _phase("dsp-v5-spline4", "splines of four spans", "hard", trajectory="spline-4", source=SPLINES),
    _phase("ssp-v5-free-spline4", "every joint a spline of four spans", "hard", trajectory="spline-4", source=SPLINES),
    _phase("ssp-v5-free-spline16", "every joint a spline of 16 spans", "hard", trajectory="spline-16", source=SPLINES),
    _phase("dsp-v5-free-spline4", "every joint a spline of four spans", "hard", trajectory="spline-4", source=SPLINES),
    *(
        Definition(
            id=id,
            what=f"stairs, planned step, {what}",
            problem="stairs-plan",
            options={"minimise": minimise},
            values=values,
            difficulty="hard",
            source=STAIRS,
        )
        for id, what, minimise, values in (
            ("stairs-energy", "least energy", "energy", {}),
            ("stairs-jerk", "least jerk", "jerk", {}),
            ("stairs-energy-rise050", "least energy, rise half the run", "energy", {"rise_run_ratio": 0.5}),
        )
    ),
)

BY_ID: Mapping[str, Definition] = {definition.id: definition for definition in DEFINITIONS}


def names(subset: Subset = "full") -> tuple[str, ...]:
    """Return the ids of the instances, from easy to hard.

    Args:
        subset: ``"small"`` (ten instances, minutes) or ``"full"``.

    Raises:
        UnknownNameError: no such subset.
    """
    if subset not in ("small", "full"):
        raise unknown("subset of GaitBench", str(subset), ("small", "full"))
    return tuple(definition.id for definition in DEFINITIONS if definition.small or subset == "full")


def get_definition(id: str) -> Definition:
    """Return the definition of an instance; raises UnknownNameError."""
    if id not in BY_ID:
        raise unknown("instance of GaitBench", id, BY_ID)
    return BY_ID[id]
