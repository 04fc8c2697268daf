"""Motions of several phases, such as a cycle or a walk: phases as data, the switches between them, and all of their rows."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX, vertcat

from nlp_gait.formulation import (
    Assembly,
    Constraint,
    Grid,
    InstantPoint,
    Objective,
    Parameter,
    Point,
    RowsOverTime,
    Signals,
    Variable,
)
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.gaits.biped.body import LIFT, Body, Coordinate, Support, make_hip_variables
from nlp_gait.gaits.biped.footholds import Foothold
from nlp_gait.gaits.biped.limits import make_rows
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SWITCHES = ("lift_off", "touch_down")
# Ranges of the hip's place ahead of the left foot as shares of a leg's length: generous, so that reach and balance decide. NAO's
# legs are 0.2029 m long.
HIP_X_SHARES = {"lift_off": (-0.25, 0.25), "touch_down": (-0.1, 0.5)}
SUFFIXES = {"m": "m", "m/s": "m_s", "rad": "rad", "rad/s": "rad_s"}
TORQUE_JUMP = "torque_jump_limit_Nm"


class SwitchState(NamedTuple):
    """Hip (3,) and coordinates (k,) at a switch: position with velocity [m, m/s], angles with their rates [rad, rad/s]."""

    hip: SX
    hip_velocity: SX
    angles: SX
    angle_rates: SX


def limit_torque_jump(
    switch: str, body: Body, point: Point, before: Samples, after: Samples, *, mirrored: bool = False
) -> tuple[Constraint, dict[str, MX]]:
    """Return the row that limits torque jumps at a switch, and the largest jump as a metric [Nm].

    Positions and rates are continuous. With ``mirrored`` the mirror image of the phase follows, as after the last one of a cycle.
    """
    partners, signs = body.mirror
    first = DM(signs) * after.torque[partners, 0] if mirrored else after.torque[:, 0]
    jump, limit, name = first - before.torque[:, -1], point[TORQUE_JUMP], f"{switch}_torque_jump"
    row = make_rows(name, "Nm", jump, -limit, limit, body.joints, "once", body.torque_scale)
    return row, {f"{name}_Nm": ca.mmax(ca.fabs(jump))}


def make_state_variables(body: Body, name: str, switch: str) -> list[Variable]:
    """Return the variables of the state at a switch of ``SWITCHES``, whose names contain ``name``."""
    height, vz, _, vx, _, vy, _ = make_hip_variables(body)
    when = f"at {name.replace('_', '-')}"
    low, high = (round(share * body.leg_length_m, 3) for share in HIP_X_SHARES[switch])
    table = [
        ("hip_x", "m", low, high, f"{body.hip_name} ahead of the left foot"),
        ("hip_y", "m", 0.0, body.feet_y[0], "towards the left foot"),
        ("hip_z", "m", height.lower, height.upper, f"height of the {body.hip_name}"),
        ("hip_vx", "m/s", vx.lower, vx.upper, "sagittal velocity"),
        ("hip_vy", "m/s", vy.lower, vy.upper, "lateral velocity"),
        ("hip_vz", "m/s", vz.lower, vz.upper, "vertical velocity"),
    ]
    for c in body.coordinates:
        table.append((c.name, "rad", *c.bounds, c.words))
        table.append((c.rate, "rad/s", -c.largest_rate, c.largest_rate, c.rate_words))
    rows = (
        (f"{what}_{name}_{SUFFIXES[unit]}", unit, lower, upper, f"{words}, {when}")
        for what, unit, lower, upper, words in table
    )
    return list(make_variables(*rows))


def read_state(point: InstantPoint, name: str, coordinates: Iterable[Coordinate]) -> SwitchState:
    """Return the state from the variables whose names contain ``name``."""
    velocity = vertcat(*(point[f"hip_v{axis}_{name}_m_s"] for axis in "xyz"))
    hip = vertcat(*(point[f"hip_{axis}_{name}_m"] for axis in "xyz"))
    rates = vertcat(*(point[f"{c.rate}_{name}_rad_s"] for c in coordinates))
    return SwitchState(hip, velocity, vertcat(*(point[f"{c.name}_{name}_rad"] for c in coordinates)), rates)


ENERGY_PER_METRE = Objective(name="energy_per_metre", unit="J/m")
# Parameters that differ between the kinds of phases; their names begin with the kind.
BALANCE = tuple(f"dbm_{axis}_{kind}_limit_m" for kind in ("min", "mean") for axis in "xy")


class State(NamedTuple):
    """A state between two phases, whose variables are those of a switch of the cycle."""

    name: str  # in names of variables
    switch: str  # of the cycle, whose bounds they have

    def make_variables(self, body: Body) -> list[Variable]:
        """Return the variables of the state."""
        return make_state_variables(body, self.name, self.switch)


class End(NamedTuple):
    """Where a phase begins or ends."""

    state: State | None = None  # None for the pose in which the robot stands
    mirrored: bool = False  # the mirror image, as seen from the foot that has just landed


class MotionSection(NamedTuple):
    """A phase of a longer motion over the left foot, which stands at x = 0."""

    name: str  # prefix of the names of its rows and metrics
    kind: Support
    begin: End
    end: End
    feet: tuple[Foothold, Foothold]  # of the right foot at begin and end; in step lengths if these are variable
    duration: str  # variable of the motion
    lift: str = LIFT  # variable of the motion: height of a swing
    step: int = 1  # number of the step to which it belongs
    occurs: int = 1  # number of repetitions; 0 for a pose, of which only the limits count


class AssembledSections(NamedTuple):
    """What the sections of a motion contribute, by name."""

    samples: Mapping[str, Samples]
    objectives: Mapping[str, MX]
    times: Mapping[str, MX]  # durations [s]
    energies: Mapping[str, MX]  # [J]
    rows: tuple[Constraint, ...]
    metrics: Mapping[str, MX]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sequence(ABC):
    """A motion of several phases, each distinct one sampled once."""

    body: Body
    variables: tuple[Variable, ...]
    phases: Mapping[Support, Phase]  # by kind
    sections: tuple[MotionSection, ...]  # in the order of time

    @property
    def decisions(self) -> tuple[Variable, ...]:
        """Variables of the problem, in the order of x."""
        return self.variables

    @property
    def objective(self) -> Objective:
        """What is minimised."""
        return ENERGY_PER_METRE

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all phases and of the sequence."""

    @property
    def grid(self) -> Grid:
        """Samples of each phase."""
        return self.phases[Support.SINGLE].grid

    @property
    def durations(self) -> tuple[str, ...]:
        """Variables of the durations, in the order of time."""
        return tuple(section.duration for section in self.sections for _ in range(section.occurs))

    @abstractmethod
    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return objective, rows and metrics."""

    @abstractmethod
    def signals(self, point: Any) -> Signals:
        """Return time histories at a point of numbers."""

    def read_section(self, section: MotionSection, point: Any) -> Any:
        """Return the point of a section's phase from that of the motion."""
        return point

    def limit_section(self, section: MotionSection) -> Phase:
        """Return the phase with the limits of a section."""
        return self.phases[section.kind]

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

    def assemble_sections(self, point: Point, ops: Nonsmooth) -> AssembledSections:
        """Sample and assemble all sections."""
        points = {section.name: self.read_section(section, point) for section in self.sections}
        samples: dict[str, Samples] = {}
        for kind in (Support.SINGLE, Support.DOUBLE):  # phases of double support differ in their limits only
            names = [
                section.name
                for section in self.sections
                if (section.kind is Support.SINGLE) == (kind is Support.SINGLE)
            ]
            several = self.phases[kind].sample_several([points[name] for name in names], ops)
            samples |= dict(zip(names, several, strict=True))
        assembled = {p.name: self._assemble_section(p, points[p.name], samples[p.name], ops) for p in self.sections}
        times = {p.name: ca.fmax(points[p.name][self.phases[p.kind].duration], LEAST_DURATION) for p in self.sections}
        return AssembledSections(
            samples=samples,
            objectives={name: section.objective for name, section in assembled.items()},
            times=times,
            energies={name: section.metrics[f"{name}_power_W"] * times[name] for name, section in assembled.items()},
            rows=tuple(row for section in assembled.values() for row in section.constraints),
            metrics={key: value for section in assembled.values() for key, value in section.metrics.items()},
        )

    def _assemble_section(self, section: MotionSection, point: Point, samples: Samples, ops: Nonsmooth) -> Assembly:
        """Assemble one section at its own point, with its name before those of its rows and metrics."""
        # A phase knows their plain names.
        limits = {limit: point.positions[f"{section.kind}_{limit}"] for limit in BALANCE}
        assembly = self.limit_section(section).assemble(
            replace(point, positions={**point.positions, **limits}), ops, samples
        )
        return Assembly(
            objective=assembly.objective,
            constraints=tuple(replace(row, name=f"{section.name}_{row.name}") for row in assembly.constraints),
            metrics={f"{section.name}_{key}": value for key, value in assembly.metrics.items()},
        )

    def rows_over_time(self) -> tuple[RowsOverTime, ...]:
        """Return each section as functions of time, where it occurs first."""

        def assemble(section: MotionSection, whole: Point, instants: MX, ops: Nonsmooth) -> Assembly:
            point = self.read_section(section, whole)
            return self._assemble_section(section, point, self.phases[section.kind].sample(point, ops, instants), ops)

        over_time: list[RowsOverTime] = []
        begins: tuple[str, ...] = ()
        for section in self.sections:
            phase = replace(self.phases[section.kind], duration=section.duration)
            for rows in phase.rows_over_time(section.name, begins) if section.occurs else ():
                means = tuple(f"{section.name}_{index}" for index in rows.means)
                over_time.append(replace(rows, assemble=partial(assemble, section), means=means))
            begins = (*begins, *[section.duration] * section.occurs)
        return tuple(over_time)

    def list_step_signals(self, point: Any) -> list[Signals]:
        """Return time histories of each step at a point of numbers, repeated steps as often as they occur."""
        steps: dict[int, list[MotionSection]] = {}
        for section in self.sections:
            if section.occurs:
                steps.setdefault(section.step, []).append(section)
        return [
            joined
            for sections in steps.values()
            for joined in [join_phases(self.phases[p.kind].signals(self.read_section(p, point)) for p in sections)]
            * sections[0].occurs
        ]


def join_phases(phases: Iterable[Signals]) -> Signals:
    """Join phases that begin at time zero; of both samples at a switch, which are equal, one is kept."""
    first, *later = phases
    arrays = {name: [array] for name, array in first.arrays.items()}
    for phase in later:
        begin = arrays["t"][-1][-1]
        for name, array in phase.arrays.items():
            arrays[name].append((begin + array if name == "t" else array)[1:])
    return replace(first, arrays={name: np.concatenate(pieces) for name, pieces in arrays.items()})
