"""Tracking a planned step with a PD controller: gains and torso pitch of least cost (the paper's use of ant colonies)."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import (
    Array,
    Assembly,
    Columns,
    Display,
    GaitProblem,
    NumericPoint,
    Objective,
    Point,
    Signals,
    SolverHints,
    Variable,
    maker,
    parameters,
)
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.closed_loop import QUANTUM, ClosedLoop, InverseKinematics, N, Rollout, Scheme
from nlp_gait.gaits.stairs.display import StepMotion, make_driven_step, simulation_model, skeleton
from nlp_gait.gaits.stairs.planar_biped import LINKS
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

Gains = Literal["scalar", "per-link"]

# Plan of least energy for case 2 of Table IV: the optimum of stairs-plan.
PLAN = {
    "hip_height_m": 0.6926,
    "hip_start_m": 0.0918,
    "zmp_start_m": 0.2434,
    "zmp_end_m": 0.0923,
    "end_rate_rad_s": 0.709,
    "t1_s": 0.5763,
    "t2_s": 0.7783,
    "t_bc_s": 1.3287,
    "foot_pitch_rad": 0.3169,
}
TORSO_PITCH = "torso_pitch_rad"
# Start points are normally distributed, in units of the ranges, around gains and a torso pitch with which the robot stays near
# its plan: a rollout of a falling robot has no useful gradient.
PLAUSIBLE_GAIN, PLAUSIBLE_TORSO = 60.0, 1.4
SCATTER = 0.05
LARGEST_STATE = 1e3  # a rollout beyond this [rad, rad/s] has diverged

PARAMETERS = (
    *stair.STAIR_PARAMETERS,
    *parameters(
        *(
            (v.name, v.unit, PLAN[v.name], v.description, v.minimum, v.maximum)
            for v in stair.GOVERNING_VARIABLES
            if v.name != TORSO_PITCH
        )
    ),
    *stair.GIVEN_PARAMETERS,
    *parameters(
        stair.REACH_MARGIN,
        ("tracking_tolerance_rad", "rad", 0.1, "largest error of a link angle at any time", 0.0, inf),
        ("zmp_weight", "1/m", 100.0, "cost of the mean distance of the ZMP from the supporting polygon", 0.0, inf),
        ("gravity_compensation", "1", 1.0, "share of gravity that the controller compensates; 0 as printed", 0.0, 1.0),
        ("disturbance_Nm", "N m", 1 / 70, "amplitude of the disturbance sin(2 t) on every link", -inf, inf),
        ("ground_stiffness_N_m", "N/m", 5e4, "k_s of a contact", 0.0, inf),
        ("ground_damping_N_s_m", "N s/m", 500.0, "k_d of a contact", 0.0, inf),
        ("friction", "1", 0.6, "mu of a contact", 0.0, inf),
    ),
)


@maker
def stairs_track(
    *,
    gains: Gains = "scalar",
    scheme: Scheme = "implicit",
    inverse_kinematics: InverseKinematics = "closed-form",
    duration_s: float = 3.5,
) -> GaitProblem:
    """Return the closed loop over one planned step, with the stance ankle as base.

    The plan is given by parameters; its torso pitch is a variable.

    Args:
        gains: one K_p and K_d for all links as in the paper, or one for each link.
        scheme: of the quantised dynamics: linearly implicit, or explicit as printed, which diverges at all but tiny gains.
        inverse_kinematics: desired angles of the legs in closed form, or by the paper's network, trained online at every
            quantum's pose within each evaluation (which makes one many times slower).
        duration_s: of the rollout, in whole quanta of 0.01 s, at most 60 s.

    Source:
        Bhardwaj et al., sections VII to X.
    """
    if not QUANTUM <= duration_s <= 60.0:
        raise InputError(f"duration_s must be within [{QUANTUM}, 60], got {duration_s}")
    suffixes = [""] if gains == "scalar" else [f"_{link}" for link in LINKS]
    quanta = round(duration_s / QUANTUM)
    loop = ClosedLoop(quanta=quanta, scheme=scheme, gains=len(suffixes), inverse_kinematics=inverse_kinematics)
    limits = {"lower": 0.0, "upper": 100.0, "minimum": 0.0, "maximum": 1e4}
    variables = (
        *(
            Variable(name=name + suffix, unit=unit, description=f"{symbol} of {suffix[1:] or 'all links'}", **limits)
            for name, unit, symbol in (("kp", "N m/rad", "K_p"), ("kd", "N m s/rad", "K_d"))
            for suffix in suffixes
        ),
        *(v for v in stair.GOVERNING_VARIABLES if v.name == TORSO_PITCH),
    )

    def rollout(point: Point, ops: Nonsmooth) -> Rollout:
        return loop.rollout(point, ca.vertcat(*(stair.clip_to_range(point, variable) for variable in variables)), ops)

    def start(_: Mapping[str, float], rng: np.random.Generator) -> Array:
        gains_about = np.full(2 * len(suffixes), PLAUSIBLE_GAIN)
        ranges = np.array([variable.upper - variable.lower for variable in variables])
        return np.append(gains_about, PLAUSIBLE_TORSO) + SCATTER * ranges * rng.standard_normal(len(variables))

    def motion(at: NumericPoint) -> Signals:
        desired, state, torque, zmp = (np.array(ca.evalf(part)).T for part in rollout(at, Exact()))
        return Signals(
            joints=LINKS,
            arrays={
                "t": np.linspace(QUANTUM, loop.quanta * QUANTUM, loop.quanta),
                "q": state[:, :N],
                "qd": state[:, N:],
                "q_desired": desired[:, :N],
                "qd_desired": desired[:, N:],
                "tau": torque,
                "zmp": zmp[:, 0],
            },
            columns={
                "zmp": stair.COLUMNS["zmp"],
                "q_desired": Columns(unit="rad", labels=LINKS),
                "qd_desired": Columns(unit="rad/s", labels=LINKS),
            },
        )

    def step_motion(at: NumericPoint) -> StepMotion:
        arrays = motion(at).arrays
        state = np.hstack([arrays["q"], arrays["qd"]])
        return make_driven_step(arrays["t"], state, arrays["tau"], arrays["zmp"], float(at["t2_s"]))

    return GaitProblem(
        name="stairs-track",
        title="Stairs, tracked step: PD gains and torso pitch of least cost",
        variables=variables,
        own_parameters=PARAMETERS,
        objective=Objective(name="cost", unit="1"),
        assemble=lambda point, ops: _assemble(point, rollout(point, ops), ops),
        display=Display(motion=motion, skeleton=skeleton, simulation_model=simulation_model(step_motion)),
        hints=SolverHints(start=start, starts=1, amplifies_rounding=True),
    )


def _assemble(point: Point, loop: Rollout, ops: Nonsmooth) -> Assembly:
    """Return the mean of (53) over all quanta, with a penalty for the ZMP outside the support polygon."""
    quanta = loop.state.shape[1]
    errors = loop.state - loop.desired
    power = loop.torque * loop.state[N:, :]
    below, above = _zmp_violations(point, loop.zmp)
    most, instants = point["tracking_tolerance_rad"], range(1, quanta + 1)
    tracked = stair.rows("tracking", errors[:N, :], LINKS, "rad", 0.1, lower=-most, upper=most, columns=instants)
    exact = Exact()
    tracking, effort = (ca.sum1(ops.abs(ca.vec(part))) / quanta for part in (errors, power))
    outside = ca.sum1(_positive(below, ops) + _positive(above, ops)) / quanta
    finite = exact.abs(ca.sum1(loop.state)) < LARGEST_STATE
    return Assembly(
        objective=tracking + effort + point["zmp_weight"] * outside,
        constraints=(tracked,),
        indexes={
            "tracking_cost": ca.sum1(exact.abs(ca.vec(errors))) / quanta,
            "energy_J": ca.sum1(exact.abs(ca.vec(power))) * QUANTUM,
            "largest_error_rad": exact.largest(ca.vec(errors[:N, :])),
            "peak_torque_Nm": exact.largest(ca.vec(loop.torque)),
            "zmp_margin_min_m": -ca.mmax(ca.fmax(below, above)),
            "quanta_before_divergence": ca.sum2(finite),
        },
    )


def _zmp_violations(point: Point, zmp: MX) -> tuple[MX, MX]:
    """Return distances of the ZMP behind and ahead of the support polygon, (m, 1) each [m]; negative inside.

    The polygon reaches from the rear toe in double support, and from the stance ankle in single support, to the stance toe.
    """
    foot = toe_foot_biped().foot_m
    times = DM(np.arange(1, zmp.shape[1] + 1) * QUANTUM)
    rear = (times < point["t2_s"]) * (foot - point["stair_length_m"] / 2)
    return rear - zmp.T, zmp.T - foot


def _positive(v: MX, ops: Nonsmooth) -> MX:
    """Elementwise max(v, 0)."""
    return (v + ops.abs(v)) / 2
