"""Tracking a planned step with a PD controller: gains and torso pitch of least cost (the paper's use of ant colonies)."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Assembly, Columns, Display, GaitProblem, Objective, Signals, SolverHints, maker
from nlp_gait.formulation.assembly import NumericPoint, Point, Variable, make_parameters
from nlp_gait.gaits.stairs import closed_loop, stair
from nlp_gait.gaits.stairs.display import StepMotion, make_driven_step, make_simulation_model, make_skeleton
from nlp_gait.gaits.stairs.planar_biped import LINKS, load_toe_foot_biped
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

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
# Start points are normally distributed around gains and a torso pitch with which the robot stays near its plan: a rollout of a
# falling robot has no useful gradient. The deviation is relative.
PLAUSIBLE_GAIN, PLAUSIBLE_TORSO = 60.0, 1.4
SCATTER = 0.05
# The cost falls with both gains, by less than a hundredth from here to a hundredth of this: the bound does not decide the cost.
LARGEST_GAIN = 1e4

PLANNED = [variable for variable in stair.GOVERNING_VARIABLES if variable.name != TORSO_PITCH]
PARAMETERS = (
    *stair.STAIR_PARAMETERS,
    *make_parameters(*((v.name, v.unit, PLAN[v.name], v.description, v.minimum, v.maximum) for v in PLANNED)),
    *stair.GIVEN_PARAMETERS,
    *make_parameters(
        stair.REACH_MARGIN,
        ("tracking_tolerance_rad", "rad", 0.1, "largest error of a link angle at any time", 0.0, inf),
        ("zmp_weight", "1/m", 100.0, "worth of the ZMP margin", 0.0, inf),
        ("spin_in_zmp", "1", 1.0, "share of the links' own angular momentum in the ZMP; 0 as printed", 0.0, 1.0),
        ("slope_in_single_support", "1", 0.0, "share of the virtual slope there; 1 as printed", 0.0, 1.0),
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
    inverse_kinematics: closed_loop.InverseKinematics = "closed-form",
    coordinates: closed_loop.Coordinates = "joint",
    rates: closed_loop.Rates = "exact",
    base: closed_loop.Base = "stance-foot",
    tracking_limit: bool = True,
    duration_s: float = 3.5,
) -> GaitProblem:
    """Return the closed loop over one planned step.

    The plan is given by parameters; its torso pitch is a variable. The dynamics are linearly implicit: explicit, as printed, they
    diverge.

    Args:
        inverse_kinematics: desired angles of the legs in closed form, or by the paper's network, trained online at every
            quantum's pose within each evaluation (which makes one many times slower).
        coordinates: what the controller measures and drives, and the disturbance acts on: joint angles and torques, and those of
            the stance sole, which stands on the ground; or as printed, where only the knees are joints (27), (28) and other
            angles are those of links.
        rates: desired rates of the angles: exact, or as printed by differences over a quantum.
        base: stance foot, pinned at its ankle, with five contacts; or as printed the hip, on
            its planned curve, with six.
        tracking_limit: whether errors of the controlled angles are limited, which the paper does not do.
        duration_s: of the rollout, in whole quanta of 0.01 s, at most 60 s.

    Source:
        Bhardwaj et al., sections VII to X.
    """
    if not closed_loop.QUANTUM <= duration_s <= 60.0:
        raise InputError(f"duration_s must be within [{closed_loop.QUANTUM}, 60], got {duration_s}")
    loop = closed_loop.ClosedLoop(
        quanta=round(duration_s / closed_loop.QUANTUM),
        inverse_kinematics=inverse_kinematics,
        coordinates=coordinates,
        rates=rates,
        base=base,
    )
    limits = {"lower": 0.0, "upper": LARGEST_GAIN, "minimum": 0.0, "maximum": 1e6}
    variables = (
        *(
            Variable(name=name, unit=unit, description=f"{symbol} of all joints", **limits)
            for name, unit, symbol in (("kp", "N m/rad", "K_p"), ("kd", "N m s/rad", "K_d"))
        ),
        *(v for v in stair.GOVERNING_VARIABLES if v.name == TORSO_PITCH),
    )
    tracked = TrackedStep(loop=loop, variables=variables, tracking_limit=tracking_limit)
    model = make_simulation_model(tracked.move)
    return GaitProblem(
        name="stairs-track",
        title="Stairs, tracked step: PD gains and torso pitch of least cost",
        variables=variables,
        own_parameters=PARAMETERS,
        objective=Objective(name="cost", unit="1"),
        assemble=tracked.assemble,
        display=Display(motion=tracked.compute_signals, skeleton=make_skeleton, simulation_model=model),
        hints=SolverHints(start=tracked.start, starts=1, amplifies_rounding=True),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackedStep:
    """A planned step in the closed loop."""

    loop: closed_loop.ClosedLoop
    variables: tuple[Variable, ...]  # gains, then the torso's pitch
    tracking_limit: bool  # whether errors of the controlled angles are limited

    @property
    def angles(self) -> tuple[str, ...]:
        """Names of the controlled angles."""
        return tuple(closed_loop.ANGLES[self.loop.coordinates])

    def start(self, _: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Draw a start point (n,)."""
        about = np.array([PLAUSIBLE_GAIN, PLAUSIBLE_GAIN, PLAUSIBLE_TORSO])
        return about * (1 + SCATTER * rng.standard_normal(len(self.variables)))

    def roll_out(self, point: Point, ops: Nonsmooth) -> closed_loop.Rollout:
        """Return the closed loop with the gains and the pitch of a point."""
        x = ca.vertcat(*(stair.clip_to_range(point, variable) for variable in self.variables))
        return self.loop.rollout(point, x, ops)

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return the mean of (53) over all quanta with the worth of the ZMP margin, and the limits of both."""
        loop, rollout, exact = self.loop, self.roll_out(point, ops), Exact()
        quanta, zmp = loop.quanta, rollout.zmp.T
        errors = ca.diagcat(loop.joints, loop.joints) @ (rollout.state - rollout.desired)
        power = rollout.torque * (loop.joints @ rollout.state[closed_loop.N :, :])
        rear, front = compute_support(point, loop)
        tracking, effort = (ca.sum1(ops.abs(ca.vec(values))) / quanta for values in (errors, power))
        instants = range(1, quanta + 1)
        constraints = [  # (Algorithm 3)
            stair.make_rows("zmp", rollout.zmp, ("x",), "m", 0.01, lower=rear, upper=front, columns=instants)
        ]
        if self.tracking_limit:
            most, limited = point["tracking_tolerance_rad"], errors[: closed_loop.N, :]
            row = stair.make_rows(
                "tracking", limited, self.angles, "rad", 0.1, lower=-most, upper=most, columns=instants
            )
            constraints.append(row)
        return Assembly(
            objective=tracking + effort + point["zmp_weight"] * -_compute_margin(zmp, rear, front, ops),
            constraints=tuple(constraints),
            metrics={
                "controller_cost": ca.sum1(exact.abs(ca.vertcat(ca.vec(errors), ca.vec(power)))) / quanta,
                "tracking_cost": ca.sum1(exact.abs(ca.vec(errors))) / quanta,
                "energy_J": ca.sum1(exact.abs(ca.vec(power))) * closed_loop.QUANTUM,
                "largest_error_rad": exact.largest(ca.vec(errors[: closed_loop.N, :])),
                "peak_torque_Nm": exact.largest(ca.vec(rollout.torque)),
                "zmp_margin_min_m": _compute_margin(zmp, rear, front, exact),
            },
        )

    def compute_signals(self, point: NumericPoint) -> Signals:
        """Return time histories at a point of numbers."""
        loop, rollout = self.loop, self.roll_out(point, Exact())
        histories = (*rollout[:4], loop.find_stance_ankle(rollout))
        desired, state, torque, zmp, stance_ankle = (np.array(ca.evalf(history)).T for history in histories)
        joints = loop.joints.full().T
        (q, qd), (q_desired, qd_desired) = (np.split(history, 2, axis=1) for history in (state, desired))
        links = {"q": q, "qd": qd, "q_desired": q_desired, "qd_desired": qd_desired}
        t = np.linspace(closed_loop.QUANTUM, loop.quanta * closed_loop.QUANTUM, loop.quanta)
        arrays = {"t": t, **{name: value @ joints for name, value in links.items()}, "link_q": q, "link_qd": qd}
        arrays |= {"tau": torque, "zmp": zmp[:, 0], "stance_ankle": stance_ankle}
        columns = {name: stair.COLUMNS[name] for name in ("zmp", "stance_ankle")}
        for kind, labels in (("{}_desired", self.angles), ("link_{}", LINKS)):
            columns |= {kind.format("q"): Columns(unit="rad", labels=labels)}
            columns |= {kind.format("qd"): Columns(unit="rad/s", labels=labels)}
        return Signals(joints=self.angles, arrays=arrays, columns=columns)

    def move(self, point: NumericPoint) -> StepMotion:
        """Return the motion of the robot that the engine simulates."""
        arrays = self.compute_signals(point).arrays
        state = np.hstack([arrays["link_q"], arrays["link_qd"]])
        on_links = arrays["tau"] @ self.loop.joints.full()
        desired = np.hstack([arrays[name] for name in ("q_desired", "qd_desired")])
        followed = np.hstack([half @ np.linalg.inv(self.loop.joints.full().T) for half in np.split(desired, 2, axis=1)])
        step = make_driven_step(arrays["t"], state, on_links, arrays["zmp"], float(point["t2_s"]))
        return step._replace(desired=followed)


def compute_support(point: Point, loop: closed_loop.ClosedLoop) -> tuple[MX, MX]:
    """Return the rear and front end of the support polygon at the end of each quantum, (m, 1) ahead of the stance ankle [m].

    The polygon reaches from the rear toe in double support, and from the stance ankle in single support, to the stance toe.
    """
    foot = load_toe_foot_biped().foot_m
    times = DM(np.arange(1, loop.quanta + 1) * closed_loop.QUANTUM)
    behind = foot - point["stair_length_m"] / 2
    return (times < point["t2_s"]) * behind, MX(DM([foot] * loop.quanta))


def _compute_margin(zmp: MX, rear: MX, front: MX, ops: Nonsmooth) -> MX:
    """Return the least distance of the ZMP (m, 1) from the ends of the support polygon [m]; negative outside."""
    off, half = zmp - (front + rear) / 2, (front - rear) / 2
    widest = half[0]  # the polygon never grows
    return widest - ops.largest(ca.vertcat(widest - half + off, widest - half - off))
