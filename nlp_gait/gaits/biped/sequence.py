"""Motions of several phases, such as a cycle or a walk: their phases as data, the joints between these, and all of their rows."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.formulation import Assembly, Constraint, Objective, Parameter, Point, RowsOverTime, Signals, Variable
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, Support
from nlp_gait.gaits.biped.limits import make_rows
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

ENERGY_PER_METRE = Objective(name="energy_per_metre", unit="J/m")
# Parameters that differ between the kinds of phases; their names begin with the kind.
BALANCE = tuple(f"dbm_{axis}_{kind}_limit_m" for kind in ("min", "mean") for axis in "xy")


class End(NamedTuple):
    """Where a phase begins or ends."""

    state: int | None = None  # by index; None for the pose in which the robot stands
    mirrored: bool = False  # the mirror image, as seen from the foot that has just landed


class Part(NamedTuple):
    """A phase of a longer motion over the left foot, which stands at x = 0."""

    name: str  # before the names of its rows and indexes
    kind: Support
    begin: End
    end: End
    feet: tuple[Any, Any]  # places of the right foot at begin and end, in step lengths; or its footholds
    duration: str  # variable of the motion
    lift: str = LIFT  # variable of the motion: height of a swing
    step: int = 1  # to which it belongs
    occurs: int = 1  # how often it occurs; 0 for a pose, of which only the limits count


LIFT_OFF, TOUCH_DOWN = End(0), End(1)
CYCLE_END = End(0, mirrored=True)
CYCLE = (
    Part(Support.SINGLE, Support.SINGLE, LIFT_OFF, TOUCH_DOWN, (-1, 1), TIMES[Support.SINGLE]),
    Part(Support.DOUBLE, Support.DOUBLE, TOUCH_DOWN, CYCLE_END, (1, 1), TIMES[Support.DOUBLE]),
)


TORQUE_JUMP = "torque_jump_limit_Nm"


@dataclass(frozen=True, kw_only=True)
class Switch:
    """A switch to a phase from the one before it, at which positions and rates are continuous and torques may jump."""

    name: str
    mirrored: bool = False  # the mirror image of the phase follows, as after the last one of a cycle

    def join(
        self, phases: Mapping[Support, Phase], at: Point, before: Samples, after: Samples, ops: Nonsmooth
    ) -> tuple[list[Constraint], dict[str, MX]]:
        """Return the rows that join two phases, here those that limit the torques' jumps, and indexes, their largest [Nm]."""
        body, limit = phases[Support.SINGLE].body, at[TORQUE_JUMP]
        images, signs = body.mirror
        first = DM(signs) * after.torque[images, 0] if self.mirrored else after.torque[:, 0]
        jump, size = first - before.torque[:, -1], body.torque_scale
        rows = make_rows(f"{self.name}_torque_jump", "Nm", jump, -limit, limit, body.joints, "once", size)
        return [rows], {f"{self.name}_torque_jump_Nm": ca.mmax(ca.fabs(jump))}


class AssembledParts(NamedTuple):
    """What the parts of a motion contribute, by name."""

    samples: Mapping[str, Samples]
    objectives: Mapping[str, MX]
    times: Mapping[str, MX]  # durations [s]
    energies: Mapping[str, MX]  # [J]
    rows: tuple[Constraint, ...]
    indexes: Mapping[str, MX]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sequence:
    """A motion of several phases, each distinct one sampled once."""

    body: Body
    variables: tuple[Variable, ...]
    phases: Mapping[Support, Phase]  # by kind
    parts: tuple[Part, ...]  # in the order of time

    def read_part(self, part: Part, at: Any) -> Any:
        """Return the point of a part's phase from that of the motion."""
        return at

    def limit_part(self, part: Part) -> Phase:
        """Return the phase with the limits of a part."""
        return self.phases[part.kind]

    @property
    def phase_parameters(self) -> list[Parameter]:
        """Parameters of all phases, each once; the names of those of balance begin with the kind."""
        unique: dict[str, Parameter] = {}
        for kind, phase in self.phases.items():
            for parameter in phase.parameters:
                if parameter.name in BALANCE:
                    text = f"{parameter.description}, {kind.words}"
                    parameter = replace(parameter, name=f"{kind}_{parameter.name}", description=text)
                unique.setdefault(parameter.name, parameter)
        return list(unique.values())

    def assemble_parts(self, at: Point, ops: Nonsmooth) -> AssembledParts:
        """Sample and assemble all parts."""
        points = {part.name: self.read_part(part, at) for part in self.parts}
        samples: dict[str, Samples] = {}
        for kind in (Support.SINGLE, Support.DOUBLE):  # phases of double support differ in their limits only
            names = [part.name for part in self.parts if (part.kind is Support.SINGLE) == (kind is Support.SINGLE)]
            several = self.phases[kind].sample_several([points[name] for name in names], ops)
            samples |= dict(zip(names, several, strict=True))
        assembled = {p.name: self._assemble_part(p, points[p.name], samples[p.name], ops) for p in self.parts}
        times = {p.name: ca.fmax(points[p.name][self.phases[p.kind].duration], LEAST_DURATION) for p in self.parts}
        return AssembledParts(
            samples=samples,
            objectives={name: part.objective for name, part in assembled.items()},
            times=times,
            energies={name: part.indexes[f"{name}_power_W"] * times[name] for name, part in assembled.items()},
            rows=tuple(row for part in assembled.values() for row in part.constraints),
            indexes={key: value for part in assembled.values() for key, value in part.indexes.items()},
        )

    def _assemble_part(self, part: Part, at: Point, samples: Samples, ops: Nonsmooth) -> Assembly:
        """Assemble one part at its own point, with its name before those of its rows and indexes."""
        limits = {limit: at.positions[f"{part.kind}_{limit}"] for limit in BALANCE}  # a phase knows their plain names
        assembly = self.limit_part(part).assemble(replace(at, positions={**at.positions, **limits}), ops, samples)
        return Assembly(
            objective=assembly.objective,
            constraints=tuple(replace(row, name=f"{part.name}_{row.name}") for row in assembly.constraints),
            indexes={f"{part.name}_{key}": value for key, value in assembly.indexes.items()},
        )

    @property
    def rows_over_time(self) -> tuple[RowsOverTime, ...]:
        """Each part as functions of time, where it occurs first."""

        def assemble(part: Part, at: Point, instants: MX, ops: Nonsmooth) -> Assembly:
            point = self.read_part(part, at)
            return self._assemble_part(part, point, self.phases[part.kind].sample(point, ops, instants), ops)

        over_time: list[RowsOverTime] = []
        begins: tuple[str, ...] = ()
        for part in self.parts:
            phase = replace(self.phases[part.kind], duration=part.duration)
            for rows in phase.rows_over_time(part.name, begins) if part.occurs else ():
                means = tuple(f"{part.name}_{index}" for index in rows.means)
                over_time.append(replace(rows, assemble=partial(assemble, part), means=means))
            begins = (*begins, *[part.duration] * part.occurs)
        return tuple(over_time)

    def list_step_signals(self, at: Any) -> list[Signals]:
        """Return time histories of each step at a point of numbers, repeated steps as often as they occur."""
        steps: dict[int, list[Part]] = {}
        for part in self.parts:
            if part.occurs:
                steps.setdefault(part.step, []).append(part)
        return [
            joined
            for parts in steps.values()
            for joined in [join_phases(self.phases[p.kind].signals(self.read_part(p, at)) for p in parts)]
            * parts[0].occurs
        ]


def join_phases(phases: Iterable[Signals]) -> Signals:
    """Join phases that begin at time zero; of both samples at a switch, equal without an impact, the earlier one is kept."""
    first, *later = phases
    arrays = {name: [array] for name, array in first.arrays.items()}
    for phase in later:
        begin = arrays["t"][-1][-1]
        for name, array in phase.arrays.items():
            arrays[name].append((begin + array if name == "t" else array)[1:])
    return replace(first, arrays={name: np.concatenate(parts) for name, parts in arrays.items()})
