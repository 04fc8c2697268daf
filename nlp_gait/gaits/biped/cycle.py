"""Both phases of a walking cycle as one problem: rows of each phase, torques across the switches, energy and speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.formulation import (
    Array,
    Assembly,
    Constraint,
    Display,
    GaitProblem,
    Objective,
    Parameter,
    Point,
    RowsOverTime,
    Signals,
    SolverHints,
    Start,
    Variable,
)
from nlp_gait.formulation.assembly import parameters
from nlp_gait.gaits.biped.cycle_motion import LEAST_STEP, STEP, TIMES
from nlp_gait.gaits.biped.parts import rows
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import LEAST_DURATION
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import mirror_sign
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SPEED = "speed_m_s"
# Energy per metre leaves the speed free; the others are means over the time of a cycle at a given speed.
CycleGoal = Literal["energy-per-metre", "power", "torque"]
ENERGY_PER_METRE = Objective(name="energy_per_metre", unit="J/m")
LEAST_SPEED = 1e-4  # [m/s]
NO_JUMP_LIMIT = 1000.0  # of NAO [Nm]
# Limits that differ between the phases, and so do their names.
BALANCE = tuple(f"dbm_{axis}_{kind}_limit_m" for kind in ("min", "mean") for axis in "xy")


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkingCycle:
    """A cycle sampled over both phases.

    Attributes:
        robot: with links welded that never move.
        images: of every joint on the other side, in the order of the phases' joints.
        gravity: [m/s^2].
        torque_size: of the robot's torques next to NAO's.
        speed_m_s: default of the speed, where it is given.
        variables: of the motion, the step length last.
        phases: ``"ssp"`` and ``"dsp"``.
        at_given_speed: the step length is no decision variable but follows from the speed.
    """

    robot: Robot
    images: tuple[str, ...]
    gravity: float
    torque_size: float = 1.0
    speed_m_s: float = 0.03
    variables: tuple[Variable, ...]
    phases: Mapping[str, Phase]
    at_given_speed: bool

    @property
    def objective(self) -> Objective:
        """What is minimised."""
        return self.phases["ssp"].goal.objective if self.at_given_speed else ENERGY_PER_METRE

    @property
    def decisions(self) -> tuple[Variable, ...]:
        """Variables of the problem, in the order of x."""
        return self.variables[:-1] if self.at_given_speed else self.variables

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Limits and weights of both phases; those of balance carry the phase's name."""
        own = {name: phase.parameters for name, phase in self.phases.items()}
        balance = [
            replace(parameter, name=f"{name}_{parameter.name}", description=f"{parameter.description}, {name.upper()}")
            for name, parameters in own.items()
            for parameter in parameters
            if parameter.name in BALANCE
        ]
        shared = [parameter for parameter in own["ssp"] if parameter.name not in BALANCE]
        shared += [
            parameter for parameter in own["dsp"] if parameter not in own["ssp"] and parameter.name not in BALANCE
        ]
        jump = ("largest jump of a torque at a switch; the default is out of reach", 0.0, math.inf)
        limit = parameters(("torque_jump_limit_Nm", "Nm", NO_JUMP_LIMIT * math.ceil(self.torque_size), *jump))
        return (*self._speed_parameters(), *balance, *limit, *shared)

    def _speed_parameters(self) -> tuple[Parameter, ...]:
        if not self.at_given_speed:
            return ()
        step = self.variables[-1]
        return parameters(
            (SPEED, "m/s", self.speed_m_s, "speed of walking", LEAST_SPEED, math.inf),
            (f"{STEP}.lower", "m", step.lower, "lower bound of the step length", -math.inf, math.inf),
            (f"{STEP}.upper", "m", step.upper, "upper bound of the step length", -math.inf, math.inf),
        )

    def motion(self, at: Point) -> Point:
        """The point with the step length as a variable, where it is not one yet."""
        if not self.at_given_speed:
            return at
        return at.extended(STEP, at[SPEED] * (at[TIMES["ssp"]] + at[TIMES["dsp"]]))

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Objective, rows and indexes.

        Torques may change by ``torque_change_limit_Nm`` over every interval of both phases, and at a switch by a limit of its
        own, which is off by default: the published one is for a change over an interval of time, while at a switch the
        supporting feet change at once and in this model the loads with them.
        """
        at = self.motion(point)
        samples = {name: phase.samples(at, ops) for name, phase in self.phases.items()}
        parts = {name: phase.assemble(_named_for(at, name), samples[name], ops) for name, phase in self.phases.items()}
        times = {name: ca.fmax(at[time], LEAST_DURATION) for name, time in TIMES.items()}
        period, step = times["ssp"] + times["dsp"], ca.fmax(at[STEP], LEAST_STEP)
        energy = sum(parts[name].indexes["power_W"] * times[name] for name in times)
        goal = sum(parts[name].objective * times[name] for name in times) / period
        own = [replace(row, name=f"{name}_{row.name}") for name, part in parts.items() for row in part.constraints]
        indexes = {f"{name}_{key}": value for name, part in parts.items() for key, value in part.indexes.items()}
        jumps = self._jumps(samples["ssp"].torque, samples["dsp"].torque)
        return Assembly(
            objective=goal if self.at_given_speed else energy / step,
            constraints=(*own, *self._jump_rows(jumps, at), *self._step_rows(at)),
            indexes={
                "power_W": energy / period,
                "energy_J_per_m": energy / step,
                "cost_of_transport": energy / step / (self.robot.mass_kg * self.gravity),
                "speed_m_s": step / period,
                "step_length_m": step,
                **indexes,
                **{f"{switch}_torque_jump_Nm": ca.mmax(ca.fabs(jump)) for switch, jump in jumps.items()},
            },
        )

    def _jump_rows(self, jumps: Mapping[str, MX], motion: Point) -> tuple[Constraint, ...]:
        limit, joints = motion["torque_jump_limit_Nm"], self.phases["ssp"].joints
        return tuple(
            rows(f"{switch}_torque_jump", "Nm", jump, -limit, limit, joints, "once", self.torque_size)
            for switch, jump in jumps.items()
        )

    @property
    def rows_over_time(self) -> tuple[RowsOverTime, ...]:
        """Both phases as functions of time."""
        found: list[RowsOverTime] = []
        begins: tuple[str, ...] = ()
        for name, phase in self.phases.items():
            for one in phase.rows_over_time(name, begins):
                found.append(
                    replace(
                        one,
                        assemble=partial(self._assemble_at, name),
                        means=tuple(f"{name}_{index}" for index in one.means),
                    )
                )
            begins = (*begins, phase.duration)
        return tuple(found)

    def _assemble_at(self, name: str, point: Point, phases: MX, ops: Nonsmooth) -> Assembly:
        """Rows and indexes of one phase with samples at other phases (1, k)."""
        at, phase = self.motion(point), self.phases[name]
        part = phase.assemble(_named_for(at, name), phase.samples_at(at, ops, phases), ops)
        return Assembly(
            objective=part.objective,
            constraints=tuple(replace(row, name=f"{name}_{row.name}") for row in part.constraints),
            indexes={f"{name}_{key}": value for key, value in part.indexes.items()},
        )

    def _step_rows(self, motion: Point) -> tuple[Constraint, ...]:
        if not self.at_given_speed:
            return ()
        return (rows("step_length", "m", motion[STEP], motion[f"{STEP}.lower"], motion[f"{STEP}.upper"], over="once"),)

    def _jumps(self, single: MX, double: MX) -> dict[str, MX]:
        """Changes of torques (J, 1) at the switches [Nm]; after lift-off the mirror image of the cycle's start follows."""
        joints = self.phases["ssp"].joints
        images = [joints.index(name) for name in self.images]
        signs = DM([mirror_sign(self.robot, *pair) for pair in zip(joints, self.images, strict=True)])
        touch_down, lift_off = double[:, 0] - single[:, -1], signs * single[images, 0] - double[:, -1]
        return {"lift_off": lift_off, "touch_down": touch_down}

    def signals(self, at: Point) -> dict[str, Signals]:
        """Time histories of both phases at a point of numbers; the second one's time goes on."""
        single, double = (phase.signals(self.motion(at)) for phase in self.phases.values())
        later = {**double.arrays, "t": single.arrays["t"][-1] + double.arrays["t"]}
        return {"ssp": single, "dsp": replace(double, arrays=later)}


def cycle_problem(name: str, owner: str, cycle: WalkingCycle, start: Start | None = None) -> GaitProblem:
    """Problem of a cycle, without what drawing and playing need.

    Args:
        name: of the problem.
        owner: whose cycle it is, for the title.
        cycle: both phases.
        start: start point; None for one within the bounds.
    """
    return GaitProblem(
        name=name,
        title=f"{owner}, walking cycle: least {cycle.objective.name.replace('_', ' ')}",
        variables=cycle.decisions,
        own_parameters=cycle.parameters,
        objective=cycle.objective,
        assemble=cycle.assemble,
        grid=cycle.phases["ssp"].grid,
        display=Display(motion=lambda at: joined(cycle.signals(at)), durations=tuple(TIMES.values())),
        hints=SolverHints(start=start),
    )


def start_at_speed(names: Sequence[str], values: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Start point within the bounds whose times fit a step within its bounds, as far as their own bounds allow.

    Args:
        names: of the decision variables.
        values: of the parameters, with speed and bounds.
        rng: random generator.
    """
    x = rng.uniform(*(np.array([values[f"{name}.{end}"] for name in names]) for end in ("lower", "upper")))
    times = [names.index(time) for time in TIMES.values()]
    step = rng.uniform(values[f"{STEP}.lower"], values[f"{STEP}.upper"])
    x[times] *= step / (values[SPEED] * x[times].sum())
    return np.asarray(x)


def joined(phases: Mapping[str, Signals]) -> Signals:
    """Phases one after the other. Of the two samples at a switch the earlier one stays: positions and velocities are equal."""
    first, *others = phases.values()
    return replace(
        first,
        arrays={
            name: np.concatenate([array, *(other.arrays[name][1:] for other in others)])
            for name, array in first.arrays.items()
        },
    )


def _named_for(point: Point, phase: str) -> Point:
    """The point as a phase reads it: under the plain names, the limits that carry the phase's name."""
    own = {name: point.positions[f"{phase}_{name}"] for name in BALANCE}
    return replace(point, positions={**point.positions, **own})
