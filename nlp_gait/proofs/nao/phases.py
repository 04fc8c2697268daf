"""NAO's phases as functions with narrow bounds: least mean power in other variables, from formulas in world coordinates.

The hip's velocities v at both ends are replaced by half sums and half differences of w = v T. The geometry is then independent
of the time T, and a torque is that of gravity plus 1 / T^2 times that of the motion in unit time. Every x has its z, with rows
|w| <= v T in place of the velocities' bounds. The pitch of hip and ankle has no rows: a bound with fewer rows is valid with all.
"""

import math
from collections.abc import Mapping

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.limits import SCALES
from nlp_gait.gaits.biped.support_phases import place_hip, place_soles, place_stance
from nlp_gait.gaits.nao.body import ARM_SWING, measure_leg
from nlp_gait.gaits.nao.problems import LeastPower
from nlp_gait.proofs.nao.instants import PAIRS, PowerInstant, PowerPhase, make_double_support, make_single_support
from nlp_gait.proofs.quadratic_tape import WIDENING, PowerForm, PowerRows
from nlp_gait.robots import Robot

# Up to this angle its tangent is monotone; slack for angles that break their limits within the judge's tolerance [rad].
STEEPEST, ANGLE_SLACK = 1.5, 1e-5


def make_power_form(problem: GaitProblem, data: LeastPower) -> PowerForm:
    """Return the power form of single or double support."""
    cosine = (1.0 - problem.value("reach_margin")) + FEASIBILITY_TOLERANCE + WIDENING
    body = data.body
    if data.division is None:
        phase = make_single_support(body.robot, place_stance(body, data.step_m), ARM_SWING[Support.SINGLE], cosine)
    else:
        soles = place_soles(body, data.step_m)
        places = soles, place_hip(body, soles), ARM_SWING[Support.DOUBLE]
        phase = make_double_support(body.robot, *places, data.division, cosine)
    return _make_form(problem, body.robot, phase)


def to_z(x: Array) -> Array:
    """Return z (..., n) of x (..., n)."""
    z, time = np.array(x, dtype=float), x[..., -1]
    for k in PAIRS:
        a, b = x[..., k] * time, x[..., k + 1] * time
        z[..., k], z[..., k + 1] = (a + b) / 2, (a - b) / 2
    return z


def _make_box_of_z(problem: GaitProblem) -> Array:
    box = np.stack([problem.lower, problem.upper], axis=-1)
    times = box[-1]
    for k in PAIRS:
        ends = [np.multiply.outer(box[j], times).ravel() for j in (k, k + 1)]
        (a, b), (c, d) = ((values.min(), values.max()) for values in ends)
        slack = np.array([-1.0, 1.0]) * 1e-12 * max(abs(a), abs(b), abs(c), abs(d))
        box[k], box[k + 1] = np.array([a + c, b + d]) / 2 + slack, np.array([a - d, b - c]) / 2 + slack
    return box


class _Outputs:
    """Outputs of the function of z, and their roles."""

    def __init__(self) -> None:
        self.expressions: list[SX] = []
        self.rows: list[tuple[int, float, float]] = []
        self.terms: list[tuple[int, int, int, float]] = []
        self.heats: list[tuple[int, float]] = []
        self.pose_rows: list[int] = []

    def add(self, expression: SX) -> int:
        self.expressions.append(expression)
        return len(self.expressions) - 1

    def add_row(
        self, expression: SX, lower: float = -np.inf, upper: float = np.inf, scale: float = 1.0, pose: bool = False
    ) -> None:
        """Add a row, widened by the judge's tolerance and by the difference of the formulas; ``pose``: it costs little."""
        slack = scale * FEASIBILITY_TOLERANCE * (1.0 + WIDENING) + WIDENING
        self.rows.append((self.add(expression), lower - slack, upper + slack))
        if pose:
            self.pose_rows.append(len(self.rows) - 1)


def _make_form(problem: GaitProblem, robot: Robot, phase: PowerPhase) -> PowerForm:
    z, values, out = SX.sym("z", len(problem.names)), problem.parameter_values, _Outputs()
    assert problem.grid is not None  # phases have one; for the type checker
    intervals = problem.grid.parts
    before: dict[str, SX] = {}
    margins: dict[str, list[SX]] = {"x": [], "y": []}
    changes: list[SX] = []
    for k in range(intervals + 1):
        now = phase.instant(z, k / intervals)
        weight = (1.0 if 0 < k < intervals else 0.5) / intervals
        out.heats += [(out.add(tau**2), weight * values["heat_loss_W_per_Nm2"]) for tau in now.torques.values()]
        for name, rate in now.rates.items():
            tau = now.torques[name]
            out.terms.append((out.add(tau * rate), out.add(tau), out.add(rate), weight))
        limit = values["torque_change_limit_Nm"]
        for name, tau in before.items():
            changes.append(now.torques[name] - tau)
            out.add_row(changes[-1], -limit, limit)
        before = now.torques
        _add_pose_rows(out, robot, values, now)
        for axis, zmp, (low, high) in zip("xy", ca.vertsplit(now.zmp), phase.sides, strict=True):
            least = values[f"dbm_{axis}_min_limit_m"]
            out.add_row(zmp, low + least, high - least, SCALES["m"])
            margins[axis].append(phase.margins[axis](zmp))
    means = {axis: sum(margins[axis], SX(0)) / (intervals + 1) for axis in "xy"}
    for axis, mean in means.items():
        out.add_row(mean, values[f"dbm_{axis}_mean_limit_m"], scale=SCALES["m"])
    for k in PAIRS:
        for i, w in ((k, z[k] + z[k + 1]), (k + 1, z[k] - z[k + 1])):
            out.add_row(w - problem.upper[i] * z[-1], upper=0.0, pose=True)
            out.add_row(w - problem.lower[i] * z[-1], lower=0.0, pose=True)
    power = sum((weight * ca.fabs(out.expressions[term]) for term, _, _, weight in out.terms), SX(0))
    metrics = {f"dbm_{axis}_mean_m": mean for axis, mean in means.items()}
    metrics["torque_change_Nm"] = ca.mmax(ca.fabs(ca.vertcat(*changes)))
    metrics["power_W"] = power / z[-1] + sum((loss * out.expressions[heat] for heat, loss in out.heats), SX(0))
    box = _make_box_of_z(problem)
    ranges = np.diff(box)[:, 0]
    poses = [out.expressions[out.rows[k][0]] for k in out.pose_rows]
    return PowerForm(
        to_z=to_z,
        box=box,
        function=ca.Function("power", [z], [ca.cse(ca.vertcat(*out.expressions))]),
        rows=PowerRows(
            limits=np.array(out.rows),
            terms=np.array(out.terms),
            heats=np.array(out.heats),
            duration=len(box) - 1,
            ranges=np.where(ranges > 0.0, ranges, 1.0),  # a variable with equal bounds is never cut
        ),
        poses=ca.Function("poses", [z], [ca.cse(ca.vertcat(*poses))]),
        pose_rows=np.array(out.pose_rows, dtype=np.int32),
        metrics=ca.Function("metrics", [z], list(metrics.values()), ["z"], list(metrics)),
    )


def _add_pose_rows(out: _Outputs, robot: Robot, values: Mapping[str, float], now: PowerInstant) -> None:
    """Add rows of a leg's pose: reach, the knee's angle, and the roll at hip and ankle."""

    def limits(joint: str) -> tuple[float, float]:
        return values[f"{joint}_rad.lower"], values[f"{joint}_rad.upper"]

    for side, squared in now.reaches.items():
        leg = measure_leg(robot, side)
        low, high = limits(f"{side}KneePitch")
        cosines = math.cos(min(high, math.pi)), math.cos(min(max(low, 0.0), math.pi))
        margin = 1.0 - values["reach_margin"]
        near, far = (
            leg.thigh_m**2 + leg.tibia_m**2 + 2 * leg.thigh_m * leg.tibia_m * cosine
            for cosine in (max(-margin, cosines[0]), min(margin, cosines[1]))
        )
        out.add_row(squared, near, far, pose=True)
        across, down = now.sideways[side]
        hip, ankle = limits(f"{side}HipRoll"), limits(f"{side}AnkleRoll")
        least, most = max(hip[0], -ankle[1]), min(hip[1], -ankle[0])
        if least > -STEEPEST:
            out.add_row(across - math.tan(least - ANGLE_SLACK) * down, lower=0.0, pose=True)
        if most < STEEPEST:
            out.add_row(across - math.tan(most + ANGLE_SLACK) * down, upper=0.0, pose=True)
