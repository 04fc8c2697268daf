"""Objective and constraints of ``stairs-ideal``."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Array, Assembly, Constraint, Point
from nlp_gait.formulation.blocks import Layout
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs.planar_biped import MOVING, StanceLoads
from nlp_gait.gaits.stairs.planned_motion import Stair, stair_height
from nlp_gait.gaits.stairs.stair import SETBACK, grip, knee_limits, read_stair, rows, stance_load, stance_zmp
from nlp_gait.symbolic.nonsmooth import Nonsmooth

EDGE_WIDTH = 0.012  # of the sigmoid that replaces an edge of the stair [m]
AXES = ("x", "z")
Ends = Literal["rest", "moving"]


@dataclass(frozen=True, kw_only=True, eq=False)
class IdealModel:
    """Mathematics of one step."""

    layout: Layout  # of the variables
    intervals: int  # N, equal parts of the step
    sole_off: int  # number of intervals with load on the rear sole
    toe_off: int  # number of intervals with load on the rear toe: the double support
    ends: Ends

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return objective and constraints; everything is smooth."""
        x = self.layout.split(point)
        step = point["step_time_s"] / self.intervals
        torque, stance, pressure = self._loads(x)
        effort = point["torque_weight"] * ca.sumsqr(torque)
        effort += point["acceleration_weight"] * ca.sumsqr(x["acceleration"])
        rate = DM(biped.JOINT_RATES) @ (x["rate"][:, 1:] + x["rate"][:, :-1]) / 2
        return Assembly(
            objective=step * effort,
            constraints=(
                *self._motion(x, step),
                *self._feet(x, point),
                grip("friction_toe", x["toe_force"], point["friction"]),
                grip("friction_sole", x["sole_force"], point["friction"]),
                grip("friction_stance", stance, point["stance_friction"]),
                stance_load(point, stance),
                stance_zmp(point, pressure),
                knee_limits("knee", x["angle"]),
            ),
            indexes={
                "energy_J": step * ca.sum1(ca.fabs(ca.vec(torque * rate))),
                "peak_torque_Nm": ca.norm_inf(ca.vec(torque)),
                "torso_pitch_rad": x["angle"][MOVING.index("UH"), 0],
            },
        )

    def loads_at(self, values: Mapping[str, Array]) -> StanceLoads[Array]:
        """Compute torques, stance force and its centre of pressure from numbers; columns are intervals."""
        symbolic = self._loads({name: MX(DM(value)) for name, value in values.items()})
        return StanceLoads(*(np.array(ca.evalf(part)) for part in symbolic))

    def _loads(self, x: Mapping[str, MX]) -> StanceLoads[MX]:
        n = self.intervals
        toe, sole = (ca.horzcat(x[force], MX(2, n - x[force].shape[1])) for force in ("toe_force", "sole_force"))
        at_intervals = biped.make_loads("T", "S").map(n)
        return StanceLoads(*at_intervals(x["angle"][:, :n], x["rate"][:, :n], x["acceleration"], toe, sole))

    @cached_property
    def _instant(self) -> ca.Function:
        """Swing toe, sole, ankle and hip (2,) from the stance ankle, and heights (3,) of the first three above the stair [m]."""
        q, size = SX.sym("q", len(MOVING)), SX.sym("size", 2)
        found = biped.points(biped.link_angles(q), SX(2, 1))
        toe, sole, ankle, hip = (found[name] for name in "TSAH")
        stair = Stair(size[0], size[1])
        heights = [p[1] - stair_height(p[0], stair, SETBACK, EDGE_WIDTH) for p in (toe, sole, ankle)]
        return ca.Function("places", [q, size], ca.cse([toe, sole, ankle, hip, ca.vertcat(*heights)]))

    def _motion(self, x: Mapping[str, MX], step: MX) -> tuple[Constraint, ...]:
        """Return rows of the quantised dynamics (eqs. 44, 45), rest at both ends if required, and a still torso."""
        n = self.intervals
        q, v, a = x["angle"], x["rate"], x["acceleration"]
        rates = v[:, 1:] - v[:, :n] - a * step  # (eq. 44)
        angles = q[:, 1:] - q[:, :n] - v[:, :n] * step - 0.5 * a * step**2  # (eq. 45)
        steps = range(1, n + 1)
        torso = v[MOVING.index("UH"), 1:n]
        rest = _equal("rest", v[:, [0, n]], MOVING, (0, n), "rad/s", 1.0)
        still = _equal("torso_starts_still", v[MOVING.index("UH"), 0], ("UH",), (0,), "rad/s", 1.0)
        return (
            _equal("rate_continuity", rates, MOVING, steps, "rad/s", 1.0),
            _equal("angle_continuity", angles, MOVING, steps, "rad", 0.1),
            rest if self.ends == "rest" else still,
            _equal("torso_still", torso, ("UH",), range(1, n), "rad/s", 1.0),
        )

    def _feet(self, x: Mapping[str, MX], point: Point) -> tuple[Constraint, ...]:
        """Return rows of the swing foot's positions and of its height above the stair; one that moves lands on its toe."""
        n, lift = self.intervals, self.toe_off
        stair = read_stair(point)
        size = ca.vertcat(stair.tread, stair.rise)
        q = x["angle"]
        swing_toe, _, ankle, hip, heights = self._instant.map(n + 1)(q, ca.repmat(size, 1, n + 1))
        flat = q[[MOVING.index("AS"), MOVING.index("ST")], :]
        toe = swing_toe[:, 1 : lift + 1] - ca.repmat(ca.vertcat(biped.toe_foot_biped().foot_m, 0) - size, 1, lift)
        ends = ca.horzcat(ankle[:, 0] + size, ankle[:, n] - size)
        flat_at = [0, n]
        if self.ends == "moving":
            ends[:, 1] = swing_toe[:, n] - ca.vertcat(biped.toe_foot_biped().foot_m, 0) - size
            flat_at = [0]
        advance = hip[:, n] - hip[:, 0] - size
        in_support, in_swing = range(lift), range(lift + 1, n + 1)

        def above(name: str, heights: MX, points: tuple[str, ...], instants: range) -> Constraint:
            return rows(name, heights, points, "m", 0.01, lower=point["clearance_m"], columns=instants)

        return (
            _equal("toe_stands", toe, AXES, range(1, lift + 1), "m", 0.01),
            _equal("toe_flat", flat[1, 1 : self.sole_off + 1], ("ST",), range(1, self.sole_off + 1), "rad", 0.1),
            _equal("foot_flat", flat[:, flat_at], ("AS", "ST"), tuple(flat_at), "rad", 0.1),
            _equal("ankle_on_step", ends, AXES, (0, n), "m", 0.01),
            _equal("hip_advance", advance, AXES, (n,), "m", 0.01),
            above("clearance_in_support", heights[1:, :lift], ("sole", "ankle"), in_support),
            above("clearance_in_swing", heights[:, lift + 1 :], ("toe", "sole", "ankle"), in_swing),
        )


def _equal(
    name: str, value: MX, of: tuple[str, ...], columns: range | tuple[int, ...], unit: str, scale: float
) -> Constraint:
    """Return rows value == 0."""
    return rows(name, value, of, unit, scale, lower=0.0, upper=0.0, columns=columns)
