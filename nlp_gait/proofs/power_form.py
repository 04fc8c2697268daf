"""NAO's phases as functions whose bounds over boxes are narrow: least mean power in other variables, from world-frame formulas.

In place of the hip's velocities at both ends stand half sums and half differences of w = v T, so that the geometry does not
depend on the time T; a torque is then what gravity asks for and 1 / T^2 times what the motion in unit time does. Every x has its
z, with rows |w| <= v T in place of the velocities' bounds. The pitch of hip and ankle has no rows here: a bound that holds with
fewer limits holds with all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.gaits.biped.double_support import Division
from nlp_gait.gaits.biped.parts import SCALES
from nlp_gait.gaits.nao.body import nao
from nlp_gait.gaits.nao.legs import leg_geometry
from nlp_gait.proofs.power_instants import (
    PAIRS,
    PowerInstant,
    PowerPhase,
    double_support_phase,
    single_support_phase,
)
from nlp_gait.proofs.quadratic import Bounded, PowerRows, QuadraticFunction
from nlp_gait.robots import Robot

# Options that the form knows; every other one must have one of these values.
ALLOWED: Mapping[str, tuple[object, ...]] = {
    "derivatives": ("analytic",),
    "samples_per_interval": (0, 1),
    "trajectory": ("cubic",),
    "objective": ("power",),
    "motors": ("",),
    "torso_share": ("printed", "lever"),
}
# By which form and exact functions, both in double precision, may differ; and the widening of every bound that makes up for it.
AGREEMENT, WIDENING = 1e-11, 1e-9
# Below this angle a tangent grows with it; and more than an angle may break its limits by [rad].
STEEPEST, ANGLE_SLACK = 1.5, 1e-5
POINTS, TRIES, SEED = 10, 10_000, 5


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerForm:
    """A problem of least mean power as a function of z.

    Attributes:
        function: of z to all outputs.
        early: of z to the rows that cost little.
        early_lower: their bounds.
        early_upper: likewise.
        rows: which of them are what.
        root: (n, 2) box that holds the z of every x within its bounds.
    """

    function: QuadraticFunction
    early: QuadraticFunction
    early_lower: Array
    early_upper: Array
    rows: PowerRows
    root: Array

    def assess(self, boxes: Array, target: float) -> Bounded:
        """What is left of boxes (P, n, 2) of z when no cost of the target or more is of interest."""
        inner, left = self.early.contract(boxes, self.early_lower, self.early_upper)
        found = self.function.assess(inner[left], target, self.rows)
        cut, lowest = np.zeros(len(boxes), np.int32), np.full(len(boxes), np.inf)
        inner[left], cut[left], lowest[left] = found.boxes, found.cut, found.lowest
        left[left] = found.left
        return Bounded(inner, left, lowest, cut)


def has_power_form(problem: GaitProblem) -> bool:
    """Whether ``power_form`` knows the problem."""
    known = problem.name in ("nao-dsp", "nao-ssp") and problem.loaded_as in (None, "", problem.name)
    return known and all(problem.options.get(name, values[0]) in values for name, values in ALLOWED.items())


def power_form(problem: GaitProblem) -> PowerForm:
    """The form of NAO's single or double support, checked against the exact functions at random points.

    Raises:
        InputError: the problem is another one, or both differ.
        CompilerError: there is no compiler, or it fails.
    """
    if not has_power_form(problem):
        raise InputError(f"problem {problem.name!r} with its options has no form for bounds of its power")
    values = dict(zip((parameter.name for parameter in problem.parameters), problem.p.tolist(), strict=True))
    robot = nao(str(problem.options["robot"]), bool(problem.options["rotational_inertia"]))
    cosine = (1.0 - values["reach_margin"]) + FEASIBILITY_TOLERANCE + WIDENING
    step = float(problem.options["step_length_m"])
    if problem.name == "nao-dsp":
        rule: Division = "lever" if problem.options["torso_share"] == "lever" else "printed"
        gait = double_support_phase(robot, step, rule, cosine)
    else:
        gait = single_support_phase(robot, step, cosine)
    parts = _assembled(problem, values, robot, gait)
    _check(problem, parts)
    out = parts.outputs
    row, lower, upper = (np.array(column) for column in zip(*out.rows, strict=True))
    power, torque, rate, weight = (np.array(column) for column in zip(*out.terms, strict=True))
    heat, loss = (np.array(column) for column in zip(*out.heats, strict=True))
    root = root_box(problem)
    widths = np.diff(root)[:, 0]
    rows = PowerRows(
        row=row.astype(np.int32),
        lower=lower,
        upper=upper,
        power=power.astype(np.int32),
        torque=torque.astype(np.int32),
        rate=rate.astype(np.int32),
        weight=weight,
        heat=heat.astype(np.int32),
        loss=loss,
        duration=len(problem.names) - 1,
        ranges=np.where(widths > 0.0, widths, 1.0),  # a variable with equal bounds is never cut
    )
    early = QuadraticFunction(
        ca.Function("poses", [out.z], [ca.cse(ca.vertcat(*(out.expressions[out.rows[k][0]] for k in out.early)))])
    )
    return PowerForm(
        function=QuadraticFunction(parts.function),
        early=early,
        early_lower=lower[out.early],
        early_upper=upper[out.early],
        rows=rows,
        root=root,
    )


def to_z(x: Array) -> Array:
    """z (..., n) of x (..., n)."""
    z, time = np.array(x, dtype=float), x[..., -1]
    for k in PAIRS:
        a, b = x[..., k] * time, x[..., k + 1] * time
        z[..., k], z[..., k + 1] = (a + b) / 2, (a - b) / 2
    return z


def root_box(problem: GaitProblem) -> Array:
    """(n, 2) box around the z of all x within their bounds."""
    lower, upper = problem.lower, problem.upper
    root = np.stack([lower, upper], axis=-1)
    times = root[-1]
    for k in PAIRS:
        ends = [np.multiply.outer(root[j], times).ravel() for j in (k, k + 1)]
        (a, b), (c, d) = ((part.min(), part.max()) for part in ends)
        wide = np.array([-1.0, 1.0]) * 1e-12 * max(abs(a), abs(b), abs(c), abs(d))
        root[k], root[k + 1] = np.array([a + c, b + d]) / 2 + wide, np.array([a - d, b - c]) / 2 + wide
    return root


class _Outputs:
    """Outputs of a function, in the making, and what they are."""

    def __init__(self, z: SX) -> None:
        self.z = z
        self.expressions: list[SX] = []
        self.rows: list[tuple[int, float, float]] = []
        self.terms: list[tuple[int, int, int, float]] = []
        self.heats: list[tuple[int, float]] = []
        self.early: list[int] = []

    def add(self, expression: SX) -> int:
        self.expressions.append(expression)
        return len(self.expressions) - 1

    def row(
        self,
        expression: SX,
        lower: float = -np.inf,
        upper: float = np.inf,
        scale: float = 1.0,
        early: bool = False,
    ) -> None:
        """Widened by what the judge allows, and by the difference of both formulas; ``early``: cheap, and looked at first."""
        slack = scale * FEASIBILITY_TOLERANCE * (1.0 + WIDENING) + WIDENING
        number = self.add(expression)
        self.rows.append((number, lower - slack, upper + slack))
        if early:
            self.early.append(len(self.rows) - 1)


def _poses(out: _Outputs, robot: Robot, values: Mapping[str, float], now: PowerInstant) -> None:
    """Rows of what a leg's pose alone says: reach, the knee's angle, and the roll at hip and ankle."""
    for side, squared in now.reaches.items():
        leg = leg_geometry(robot, side)
        low, high = _limits(values, f"{side}KneePitch")
        cosines = math.cos(min(high, math.pi)), math.cos(min(max(low, 0.0), math.pi))
        margin = 1.0 - values["reach_margin"]
        near, far = (
            leg.thigh_m**2 + leg.tibia_m**2 + 2 * leg.thigh_m * leg.tibia_m * cosine
            for cosine in (max(-margin, cosines[0]), min(margin, cosines[1]))
        )
        out.row(squared, near, far, early=True)
        across, down = now.sideways[side]
        hip, ankle = _limits(values, f"{side}HipRoll"), _limits(values, f"{side}AnkleRoll")
        least, most = max(hip[0], -ankle[1]), min(hip[1], -ankle[0])
        if least > -STEEPEST:
            out.row(across - math.tan(least - ANGLE_SLACK) * down, lower=0.0, early=True)
        if most < STEEPEST:
            out.row(across - math.tan(most + ANGLE_SLACK) * down, upper=0.0, early=True)


def _limits(values: Mapping[str, float], joint: str) -> tuple[float, float]:
    """Of an angle [rad]."""
    return values[f"{joint}_rad.lower"], values[f"{joint}_rad.upper"]


class _Assembled(NamedTuple):
    """Outputs, and figures by the names that the exact functions give them."""

    outputs: _Outputs
    figures: dict[str, SX]

    @property
    def function(self) -> ca.Function:
        """Of z to the outputs."""
        return ca.Function("power", [self.outputs.z], [ca.cse(ca.vertcat(*self.outputs.expressions))])


def _assembled(problem: GaitProblem, values: Mapping[str, float], robot: Robot, gait: PowerPhase) -> _Assembled:
    z = SX.sym("z", len(problem.names))
    out = _Outputs(z)
    assert problem.grid is not None  # phases have one; for the type checker
    intervals = problem.grid.parts
    before: dict[str, SX] = {}
    margins: dict[str, list[SX]] = {"x": [], "y": []}
    changes: list[SX] = []
    for k in range(intervals + 1):
        now = gait.instant(z, k / intervals)
        weight = (1.0 if 0 < k < intervals else 0.5) / intervals
        out.heats += [(out.add(tau**2), weight * values["heat_loss_W_per_Nm2"]) for tau in now.torques.values()]
        for name, rate in now.rates.items():
            tau = now.torques[name]
            out.terms.append((out.add(tau * rate), out.add(tau), out.add(rate), weight))
        limit = values["torque_change_limit_Nm"]
        for name, tau in before.items():
            changes.append(now.torques[name] - tau)
            out.row(changes[-1], -limit, limit)
        before = now.torques
        _poses(out, robot, values, now)
        for axis, at, (low, high) in zip("xy", ca.vertsplit(now.zmp), gait.sides, strict=True):
            least = values[f"dbm_{axis}_min_limit_m"]
            out.row(at, low + least, high - least, SCALES["m"])
            margins[axis].append(gait.margins[axis](at))
    means = {axis: sum(margins[axis], SX(0)) / (intervals + 1) for axis in "xy"}
    for axis, mean in means.items():
        out.row(mean, values[f"dbm_{axis}_mean_limit_m"], scale=SCALES["m"])
    for k in PAIRS:
        for i, w in ((k, z[k] + z[k + 1]), (k + 1, z[k] - z[k + 1])):
            out.row(w - problem.upper[i] * z[-1], upper=0.0, early=True)
            out.row(w - problem.lower[i] * z[-1], lower=0.0, early=True)
    figures = {f"dbm_{axis}_mean_m": mean for axis, mean in means.items()}
    figures["torque_change_Nm"] = ca.mmax(ca.fabs(ca.vertcat(*changes)))
    power = sum((weight * ca.fabs(out.expressions[term]) for term, _, _, weight in out.terms), SX(0))
    figures["power_W"] = power / z[-1] + sum((loss * out.expressions[heat] for heat, loss in out.heats), SX(0))
    return _Assembled(out, figures)


def _check(problem: GaitProblem, parts: _Assembled) -> None:
    """Hold the form against the exact functions at random points within reach.

    Raises:
        InputError: they differ by more than rounding.
    """
    model, rng = build_exact_model(problem), np.random.default_rng(SEED)
    function = ca.Function("figures", [parts.outputs.z], list(parts.figures.values()))
    reached = [k for k, name in enumerate(model.row_names) if name.startswith("reach[")]
    seen = 0
    for _ in range(TRIES):
        x = rng.uniform(problem.lower, problem.upper)
        expected = model.at(x, problem.p)
        if (np.maximum(expected.lower - expected.g, expected.g - expected.upper)[reached] > 0.0).any():
            continue
        for name, value in zip(parts.figures, function.call([to_z(x)]), strict=True):
            exact = expected.indexes[name]
            if not abs(float(value) - exact) <= AGREEMENT * (1.0 + abs(exact)):
                raise InputError(
                    f"problem {problem.name!r}: its form for bounds has {name} {float(value)} where the exact functions have "
                    f"{exact}; with these options there is no proof"
                )
        seen += 1
        if seen == POINTS:
            return
    raise InputError(f"problem {problem.name!r}: of {TRIES} random points none is within reach of the legs")
