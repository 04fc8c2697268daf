"""The 12-joint walk: stability margin against step length (Goswami, Vadakkepat, Phung 2008, section 5)."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Assembly, Constraint, Display, GaitProblem, Grid, Objective, Point, SolverHints, maker
from nlp_gait.formulation.assembly import RowsOverTime, Variable, make_parameters
from nlp_gait.gaits.walk12 import walk12_model
from nlp_gait.gaits.walk12.walk12_steps import compute_steps_at, make_skeleton
from nlp_gait.symbolic.nonsmooth import Nonsmooth

Horizon = Literal["step", "1s"]
# Rule for the integral (9): Gauss-Legendre on each panel of two intervals, Simpson's on the intervals, or the paper's Runge-Kutta
# method of fourth order with 10,000 steps, 0.0001 s each if T = 1 s. For an integral over time that is Simpson's rule.
Quadrature = Literal["gauss", "simpson", "runge-kutta"]

F1MAX = 442.522  # the paper's largest f1, section 7 [1/(m^2 s)]
F2MAX = 0.13  # [m]
PRINTED_STEPS = 10_000
# Nodes of Gauss's rule over a step, and the fewest on a panel. A nearly straight leg makes the integrand spike: over all gaits
# that reach, f is within 2e-7, by Simpson's rule on 20 intervals within 9e-3.
GAUSS_NODES, FEWEST_NODES = 160, 3
LARGEST_TURN = math.radians(8.0)  # section 5.4

VARIABLES = (  # (eq. 7)
    Variable(name="step_length_m", unit="m", lower=0.05, upper=0.13, description="s, path of the swing foot"),
    Variable(name="frontal_shift_m", unit="m", lower=0.001, upper=0.13, description="n, sideways motion of the hip"),
    Variable(name="foot_lift_m", unit="m", lower=0.001, upper=0.13, description="H, greatest height of the swing foot"),
    Variable(name="bending_height_m", unit="m", lower=0.001, upper=0.13, description="h, hip below a stretched leg"),
)

TURN = "K, yaw of the swing leg: each step turns by it; Q is that of the first step, right leg swinging"
PARAMETERS = make_parameters(
    ("lambda", "1", 0.15, "weight of stability against step length (eq. 11)", 0.0, 1.0),
    ("step_time_s", "s", 1.0, "T, time of one step", 0.01, math.inf),
    ("f1max", "1/(m^2 s)", F1MAX, "f1 that counts as 1 (eq. 11)", 1e-6, math.inf),
    ("f2max_m", "m", F2MAX, "step length that counts as 1", 1e-6, math.inf),
    ("reach_margin_rad", "rad", 0.05, "kappa, least angle of a knee", 0.0, 1.0),
    ("turn_rad", "rad", 0.0, TURN, 0.0, LARGEST_TURN),
)


@maker
def walk12(
    *, intervals: int = 20, horizon: Horizon = "step", zmp: walk12_model.Zmp = "exact", quadrature: Quadrature = "gauss"
) -> GaitProblem:
    """Return the gait problem of the 12-joint biped: maximise lambda f1 / f1max + (1 - lambda) s / f2max.

    Args:
        intervals: of a step, whose ends are the instants of the metrics and, every second one, of the reach; even.
        horizon: Q over one step, as printed in (9), or over one second of walking, as Table IV implies.
        zmp: reading of the zero-moment point, see ``walk12_model.Zmp``.
        quadrature: of Q: Gauss's rule on 160 nodes, Simpson's on the intervals, or the paper's 10,000 Runge-Kutta steps.

    Source:
        Goswami, Vadakkepat, Phung (2008), section 5.
    """
    if intervals < 2 or intervals % 2:
        raise InputError(f"intervals must be an even whole number >= 2 (panels of two), got {intervals!r}")
    robot = walk12_model.load_point_mass_biped()
    walk = Walk12(intervals=intervals, horizon=horizon, zmp=zmp, quadrature=quadrature, robot=robot)
    means = ("Q_m2s",) if horizon == "step" else ()
    return GaitProblem(
        name="walk12",
        title="12-joint walk: stability margin against step length",
        variables=VARIABLES,
        own_parameters=PARAMETERS,
        objective=Objective(name="f", unit="1", sense="maximise"),
        assemble=walk.assemble,
        grid=Grid(intervals=intervals, refined_by="intervals"),
        display=Display(
            motion=partial(compute_steps_at, robot=robot, intervals=intervals, zmp=zmp),
            skeleton=partial(make_skeleton, robot),
        ),
        rows_over_time=(
            RowsOverTime(
                assemble=walk.assemble_over_time, times=lambda values: (0.0, values["step_time_s"]), means=means
            ),
        ),
        # All of 640 random starts converge; with the exact Hessian, 5 fail.
        hints=SolverHints(hessian="limited-memory"),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Walk12:
    """One step in a reading of the paper, see ``walk12``."""

    intervals: int
    horizon: Horizon
    zmp: walk12_model.Zmp
    quadrature: Quadrature
    robot: walk12_model.PointMassBiped

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return the objective, the reach at the ends of Simpson's panels, and the metrics."""
        T = point["step_time_s"]
        s = point["step_length_m"]
        zmp_at = _make_zmp_function(self.robot, ops, self.zmp)
        phases, weights = make_rule(self.quadrature, self.intervals)
        places = _sample_zmp(zmp_at, point, phases)
        Q = T * ca.sum1(places**2) @ weights  # (eq. 9)
        if self.horizon == "1s":
            steps = ca.floor(1 / T)
            begun = 1 / T - steps  # share of the last step within the second
            Q = steps * Q + begun * T * ca.sum1(_sample_zmp(zmp_at, point, begun * phases) ** 2) @ weights
        if self.quadrature != "simpson":
            places = _sample_zmp(zmp_at, point, DM(np.linspace(0.0, 1.0, self.intervals + 1)).T)
        q = SX.sym("q")
        f1 = ops.call(ca.Function("f1", [q], [1 / q]), Q)  # (eq. 10)
        f = point["lambda"] * f1 / point["f1max"] + (1 - point["lambda"]) * s / point["f2max_m"]  # (eq. 11)
        metrics = {"f": f, "f1_per_m2s": f1, "Q_m2s": Q, "hip_speed_m_s": s / (2 * T)}
        panels = self.intervals // 2  # of Simpson's rule, at whose ends the knees bend
        names = [f"{k / panels:g} T" for k in range(panels + 1)]
        reach = _limit_reach(point, self.robot, DM(np.linspace(0.0, 1.0, panels + 1)).T, names)
        metrics |= _measure_stability(places, self.robot)
        return Assembly(objective=f, constraints=(reach,), metrics=metrics)

    def assemble_over_time(self, point: Point, phases: MX, ops: Nonsmooth) -> Assembly:
        """Return the reach and the integrand's mean at phases (1, k)."""
        places = _sample_zmp(_make_zmp_function(self.robot, ops, self.zmp), point, phases)
        Q = point["step_time_s"] * ca.sum1(ca.sum2(places**2)) / phases.shape[1]
        reach = _limit_reach(point, self.robot, phases, [""] * phases.shape[1])
        metrics = {"Q_m2s": Q} if self.horizon == "step" else {}
        return Assembly(objective=MX(0), constraints=(reach,), metrics=metrics)


def make_rule(quadrature: Quadrature, intervals: int) -> tuple[DM, DM]:
    """Return phases (1, n) and weights (n, 1) of a rule on [0, 1] for an even number of intervals."""
    if quadrature == "gauss":
        panels = intervals // 2
        nodes, weights = np.polynomial.legendre.leggauss(max(FEWEST_NODES, -(-GAUSS_NODES // panels)))
        # Last digits depend on the linear algebra library; the problem must be the same on every machine.
        nodes, weights = np.round(nodes, 14), np.round(weights, 14)
        phases = (np.arange(panels)[:, None] + (nodes + 1) / 2) / panels
        return DM(phases.ravel()).T, DM(np.tile(weights / (2 * panels), panels))
    count = 2 * PRINTED_STEPS if quadrature == "runge-kutta" else intervals
    weights = np.full(count + 1, 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return DM(np.linspace(0.0, 1.0, count + 1)).T, DM(weights / (3 * count))


def _limit_reach(point: Point, robot: walk12_model.PointMassBiped, phases: MX | DM, names: list[str]) -> Constraint:
    """Bend the knees by at least kappa at the given phases: nearly straight legs make the ZMP spike."""
    x, phase = SX.sym("x", len(VARIABLES)), SX.sym("phase")
    cosines = ca.Function("reach", [x, phase], ca.cse([walk12_model.compute_knee_cosines(x, phase, robot)]))
    n = len(names)
    labels = tuple(f"{leg} leg, {name}" for name in names for leg in ("stance", "swing"))
    limit = ca.cos(point["reach_margin_rad"])
    value = ca.vec(cosines.map(n)(ca.repmat(point.x, 1, n), phases))
    return Constraint(
        name="reach", labels=labels, unit="1", scale=1.0, value=value, lower=-limit, upper=limit, over="instant"
    )


def _measure_stability(zmp: MX, robot: walk12_model.PointMassBiped) -> dict[str, MX]:
    """Return margins of the ZMP (2, N + 1) on the sole of the stance foot (eq. 8); the stable share is of the step's time."""
    x, y = zmp[0, :], zmp[1, :]
    half = robot.foot_width_m / 2
    margin = ca.fmin(ca.fmin(x + robot.foot_back_m, robot.foot_front_m - x), ca.fmin(y + half, half - y))
    return {
        "stable_share": (margin >= 0) @ DM(Grid(intervals=zmp.shape[1] - 1).weights),
        "zmp_margin_min_m": ca.mmin(margin),
        "zmp_x_min_m": ca.mmin(x),
        "zmp_x_max_m": ca.mmax(x),
        "zmp_y_min_m": ca.mmin(y),
        "zmp_y_max_m": ca.mmax(y),
    }


def _make_zmp_function(robot: walk12_model.PointMassBiped, ops: Nonsmooth, reading: walk12_model.Zmp) -> ca.Function:
    """Return the function of one sample: (x, T, K, reach margin of a cosine, phase) to the ZMP (2,) from the stance ankle [m]."""
    x = SX.sym("x", len(VARIABLES))
    T, turn, margin, phase = (SX.sym(name) for name in ("T", "K", "margin", "phase"))
    stance, swing = walk12_model.compute_legs(x, phase, T, turn, margin, robot, ops)
    zmp = walk12_model.compute_zmp(stance, swing, robot, reading)
    return ca.Function("zmp", [x, T, turn, margin, phase], ca.cse([zmp]))


def _sample_zmp(zmp_at: ca.Function, point: Point, phases: MX | DM) -> MX:
    """Return (2, n) the ZMP at phases (1, n); mapped, never unrolled."""
    margin = 1 - ca.cos(point["reach_margin_rad"])
    inputs = (point.x, point["step_time_s"], point["turn_rad"], margin)
    n = phases.shape[1]
    return zmp_at.map(n)(*(ca.repmat(value, 1, n) for value in inputs), phases)
