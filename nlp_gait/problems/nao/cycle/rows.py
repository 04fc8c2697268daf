"""Both phases of NAO's walking cycle as one problem: rows of each phase, torques across the switches, energy and speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.problem import Array, Assembly, Constraint, Parameter, Point, Signals, Stretch, Variable
from nlp_gait.problem.assembly import parameters
from nlp_gait.problems.biped.parts import Margins, rows
from nlp_gait.problems.biped.phase import Phase
from nlp_gait.problems.biped.samples import LEAST_DURATION
from nlp_gait.problems.nao.body import GRAVITY, JOINTS
from nlp_gait.problems.nao.cycle.motion import LEAST_STEP, STEP, TIMES
from nlp_gait.problems.nao.double_support import Box, double_support_mean_margins, margins_in, support_box
from nlp_gait.problems.nao.legs import leg_geometry
from nlp_gait.problems.nao.single_support import single_support_margins, single_support_mean_margins
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import mirror_sign, partner
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SPEED = "speed_m_s"
LEAST_SPEED = 1e-4  # [m/s]
PUBLISHED_STEP = 0.06  # [m]; the box around both soles, of which the least mean margins in double support are shares
NO_JUMP_LIMIT = 1000.0  # [Nm]
# Limits that differ between the phases, and so do their names.
BALANCE = tuple(f"dbm_{axis}_{kind}_limit_m" for kind in ("min", "mean") for axis in "xy")


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkingCycle:
    """A cycle sampled over both phases.

    Attributes:
        robot: with links welded that never move.
        variables: of the motion, the step length last.
        phases: ``"ssp"`` and ``"dsp"``.
        at_given_speed: the step length is no decision variable but follows from the speed.
    """

    robot: Robot
    variables: tuple[Variable, ...]
    phases: Mapping[str, Phase]
    at_given_speed: bool

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
        limit = parameters(("torque_jump_limit_Nm", "Nm", NO_JUMP_LIMIT, *jump))
        return (*self._speed_parameters(), *balance, *limit, *shared)

    def _speed_parameters(self) -> tuple[Parameter, ...]:
        if not self.at_given_speed:
            return ()
        step = self.variables[-1]
        return parameters(
            (SPEED, "m/s", 0.03, "speed of walking", LEAST_SPEED, math.inf),
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
            constraints=(*own, *_jump_rows(jumps, at), *self._step_rows(at)),
            indexes={
                "power_W": energy / period,
                "energy_J_per_m": energy / step,
                "cost_of_transport": energy / step / (self.robot.mass_kg * GRAVITY),
                "speed_m_s": step / period,
                "step_length_m": step,
                **indexes,
                **{f"{switch}_torque_jump_Nm": ca.mmax(ca.fabs(jump)) for switch, jump in jumps.items()},
            },
        )

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """Both phases as functions of time."""
        found: list[Stretch] = []
        begins: tuple[str, ...] = ()
        for name, phase in self.phases.items():
            for stretch in phase.stretch(name, begins):
                found.append(
                    replace(
                        stretch,
                        assemble=partial(self._assemble_at, name),
                        means=tuple(f"{name}_{index}" for index in stretch.means),
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
        """Changes of torques (22, 1) at the switches [Nm]; after lift-off the mirror image of the cycle's start follows."""
        images = [JOINTS.index(partner(name)) for name in JOINTS]
        signs = DM([mirror_sign(self.robot, name) for name in JOINTS])
        touch_down, lift_off = double[:, 0] - single[:, -1], signs * single[images, 0] - double[:, -1]
        return {"lift_off": lift_off, "touch_down": touch_down}

    def signals(self, at: Point) -> dict[str, Signals]:
        """Time histories of both phases at a point of numbers; the second one's time goes on."""
        single, double = (phase.signals(self.motion(at)) for phase in self.phases.values())
        later = {**double.arrays, "t": single.arrays["t"][-1] + double.arrays["t"]}
        return {"ssp": single, "dsp": replace(double, arrays=later)}


def single_margins(robot: Robot) -> Margins:
    """On the left foot, which stands at zero below its own hip joint."""
    return single_support_margins((0.0, leg_geometry(robot, "L").hip_m[1]), robot.feet["left"])


def double_margins(robot: Robot) -> Margins:
    """In the box around the left foot and the right one a step ahead."""
    left, right = robot.feet["left"], robot.feet["right"]
    left_y, right_y = (leg_geometry(robot, side).hip_m[1] for side in "LR")

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        step = at[STEP]
        box = Box(
            back=ca.fmin(-left.back_m, step - right.back_m),
            front=ca.fmax(left.front_m, step + right.front_m),
            right=min(left_y - left.right_m, right_y - right.right_m),
            left=max(left_y + left.left_m, right_y + right.left_m),
        )
        return margins_in(box, zmp, ops)

    return margins


def mean_margins(robot: Robot) -> dict[str, tuple[float, float]]:
    """Default of the least mean margins of each phase in x and y [m]."""
    left, right = (leg_geometry(robot, side).hip_m[1] for side in "LR")
    box = support_box(robot, {"L": (0.0, left), "R": (PUBLISHED_STEP, right)})
    return {
        "ssp": single_support_mean_margins(robot.feet["left"]),
        "dsp": double_support_mean_margins(box),
    }


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


def _jump_rows(jumps: Mapping[str, MX], motion: Point) -> tuple[Constraint, ...]:
    limit = motion["torque_jump_limit_Nm"]
    return tuple(
        rows(f"{switch}_torque_jump", "Nm", jump, -limit, limit, JOINTS, over="once") for switch, jump in jumps.items()
    )


def _named_for(point: Point, phase: str) -> Point:
    """The point as a phase reads it: under the plain names, the limits that carry the phase's name."""
    own = {name: point.positions[f"{phase}_{name}"] for name in BALANCE}
    return replace(point, positions={**point.positions, **own})
