"""Both phases of NAO's walking cycle as one problem: rows of each phase, torques across the switches, energy and speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.problem.gait_problem import Array, Assembly, Constraint, Parameter, Point, Signals, Variable
from nlp_gait.problems.nao.body import GRAVITY, JOINTS, LEAST_DURATION
from nlp_gait.problems.nao.cycle_motion import LEAST_STEP, STEP, TIMES
from nlp_gait.problems.nao.double_support import Box, double_support_margins, double_support_mean_margins, support_box
from nlp_gait.problems.nao.legs import leg_geometry
from nlp_gait.problems.nao.limits import TORQUE_SCALE, assemble_phase, phase_parameters
from nlp_gait.problems.nao.phase import Phase
from nlp_gait.problems.nao.single_support import single_support_margins, single_support_mean_margins
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import mirror_sign, partner
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SPEED = "speed_m_s"
LEAST_SPEED = 1e-4  # [m/s]
PUBLISHED_STEP = 0.06  # [m]; the box around both soles, of which the least mean margins in double support are shares
NO_JUMP_LIMIT = 1000.0  # [Nm]
STEP_SCALE = 0.01  # [m]; counts as 1 in the total violation, as a balance margin does
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
        left, right = (leg_geometry(self.robot, side).hip_m[1] for side in "LR")
        box = support_box(self.robot, {"L": (0.0, left), "R": (PUBLISHED_STEP, right)})
        means = {
            "ssp": single_support_mean_margins(self.robot.feet["left"]),
            "dsp": double_support_mean_margins(box),
        }
        own = {name: phase_parameters(self.robot, mean) for name, mean in means.items()}
        balance = [
            replace(parameter, name=f"{name}_{parameter.name}", description=f"{parameter.description}, {name.upper()}")
            for name, parameters in own.items()
            for parameter in parameters
            if parameter.name in BALANCE
        ]
        shared = [parameter for parameter in own["ssp"] if parameter.name not in BALANCE]
        jump = Parameter(
            name="torque_jump_limit_Nm",
            unit="Nm",
            default=NO_JUMP_LIMIT,
            description="largest jump of a torque at a switch; the default is out of reach",
            minimum=0.0,
        )
        return (*self._speed_parameters(), *balance, jump, *shared)

    def _speed_parameters(self) -> tuple[Parameter, ...]:
        if not self.at_given_speed:
            return ()
        step = self.variables[-1]
        ends = (("lower", step.lower), ("upper", step.upper))
        return (
            Parameter(name=SPEED, unit="m/s", default=0.03, description="speed of walking", minimum=LEAST_SPEED),
            *(
                Parameter(name=f"{STEP}.{end}", unit="m", default=value, description=f"{end} bound of the step length")
                for end, value in ends
            ),
        )

    def motion(self, point: Point) -> Point:
        """The point with the step length as the last entry of x, where it is none yet."""
        if not self.at_given_speed:
            return point
        step = point[SPEED] * (point[TIMES["ssp"]] + point[TIMES["dsp"]])
        return replace(point, x=ca.vertcat(point.x, step), positions=self._positions(point))

    def _positions(self, point: Point) -> Mapping[str, tuple[Literal["x", "p"], int]]:
        return {**point.positions, STEP: ("x", len(self.variables) - 1)}

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Objective, rows and indexes.

        Torques may change by ``torque_change_limit_Nm`` over every interval of both phases, and at a switch by a limit of its
        own, which is off by default: the published one is for a change over an interval of time, while at a switch the
        supporting feet change at once and in this model the loads with them.
        """
        motion = self.motion(point)
        margins = {"ssp": self._single_margins, "dsp": self._double_margins}
        samples = {name: phase.samples(motion, ops) for name, phase in self.phases.items()}
        parts = {
            name: assemble_phase(
                _named_for(motion, name),
                ops,
                samples[name],
                margins[name](samples[name].zmp, motion, ops),
                phase.samples_per_interval,
            )
            for name, phase in self.phases.items()
        }
        times = {name: ca.fmax(motion[time], LEAST_DURATION) for name, time in TIMES.items()}
        period, step = times["ssp"] + times["dsp"], ca.fmax(motion[STEP], LEAST_STEP)
        energy = parts["ssp"].objective * times["ssp"] + parts["dsp"].objective * times["dsp"]
        rows = [replace(row, name=f"{name}_{row.name}") for name, part in parts.items() for row in part.constraints]
        indexes = {f"{name}_{key}": value for name, part in parts.items() for key, value in part.indexes.items()}
        jumps = self._jumps(samples["ssp"].torque, samples["dsp"].torque)
        return Assembly(
            objective=energy / period if self.at_given_speed else energy / step,
            constraints=(*rows, *_jump_rows(jumps, motion), *self._step_rows(motion)),
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

    def _step_rows(self, motion: Point) -> tuple[Constraint, ...]:
        if not self.at_given_speed:
            return ()
        lower, upper = (motion[f"{STEP}.{end}"] for end in ("lower", "upper"))
        return (
            Constraint(name="step_length", unit="m", scale=STEP_SCALE, value=motion[STEP], lower=lower, upper=upper),
        )

    def _single_margins(self, zmp: MX, motion: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        left_y = leg_geometry(self.robot, "L").hip_m[1]
        return single_support_margins(zmp, (0.0, left_y), self.robot.feet["left"], ops)

    def _double_margins(self, zmp: MX, motion: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        """In the box around the left foot and the right one a step ahead."""
        left, right = self.robot.feet["left"], self.robot.feet["right"]
        left_y, right_y = (leg_geometry(self.robot, side).hip_m[1] for side in "LR")
        step = motion[STEP]
        box = Box(
            back=ca.fmin(-left.back_m, step - right.back_m),
            front=ca.fmax(left.front_m, step + right.front_m),
            right=min(left_y - left.right_m, right_y - right.right_m),
            left=max(left_y + left.left_m, right_y + right.left_m),
        )
        return double_support_margins(zmp, box, ops)

    def _jumps(self, single: MX, double: MX) -> dict[str, MX]:
        """Changes of torques (22, 1) at the switches [Nm]; after lift-off the mirror image of the cycle's start follows."""
        images = [JOINTS.index(partner(name)) for name in JOINTS]
        signs = DM([mirror_sign(self.robot, name) for name in JOINTS])
        touch_down, lift_off = double[:, 0] - single[:, -1], signs * single[images, 0] - double[:, -1]
        return {"lift_off": lift_off, "touch_down": touch_down}

    def signals(self, point: Point, x: Array, p: Array) -> dict[str, Signals]:
        """Time histories of both phases at a given x (n,) and parameter vector (k,); the second one's time goes on.

        Args:
            point: symbols of the problem.
            x: decision variables.
            p: parameter values.
        """
        full = replace(point, x=MX.sym("x", len(self.variables)), positions=self._positions(point))
        values = ca.Function("motion", [point.x, point.p], [self.motion(point).x])(x, p).full().ravel()
        single, double = (phase.signals(full, values, p) for phase in self.phases.values())
        later = {**double.arrays, "t": single.arrays["t"][-1] + double.arrays["t"]}
        return {"ssp": single, "dsp": Signals(joints=double.joints, arrays=later)}


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
    return Signals(
        joints=first.joints,
        arrays={
            name: np.concatenate([array, *(other.arrays[name][1:] for other in others)])
            for name, array in first.arrays.items()
        },
    )


def _jump_rows(jumps: Mapping[str, MX], motion: Point) -> tuple[Constraint, ...]:
    limit = motion["torque_jump_limit_Nm"]
    return tuple(
        Constraint(
            name=f"{switch}_torque_jump",
            labels=JOINTS,
            unit="Nm",
            scale=TORQUE_SCALE,
            value=jump,
            lower=-limit,
            upper=limit,
        )
        for switch, jump in jumps.items()
    )


def _named_for(point: Point, phase: str) -> Point:
    """The point as a phase reads it: under the plain names, the limits that carry the phase's name."""
    own = {name: point.positions[f"{phase}_{name}"] for name in BALANCE}
    return replace(point, positions={**point.positions, **own})
