"""The closed loop on stairs: desired angles, one quantum of the nine-link dynamics, and what a quantum costs."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Point
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs.leg_network import ONLINE, solve_legs_by_network
from nlp_gait.gaits.stairs.plan_samples import make_step_symbols
from nlp_gait.gaits.stairs.planned_motion import Stair, compute_stair_height
from nlp_gait.gaits.stairs.stair import EDGE_WIDTH, SETBACK, collect_governing, read_stair
from nlp_gait.symbolic import quantised
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.quantised import Contact, Equations, Ground, QuantisedState, solve_definite

InverseKinematics = Literal["closed-form", "network"]
Rates = Literal["exact", "differences"]
Coordinates = Literal["joint", "printed"]
Base = Literal["stance-foot", "hip"]
QUANTUM = 0.01  # dt [s], (eq. 43)
CONTACTS = ("T", "S", "A", "S'", "T'", "A'")  # points that may touch the ground, all but the base
N = len(biped.LINKS)
# Inputs of a quantum besides the state and the tuned values, with sizes: desired angles and rates, time, tread and rise,
# k_s, k_d and mu, share of gravity, amplitude of the disturbance, the virtual slope, the share of the links' spin in the ZMP, and
# place, velocity and acceleration of a hip that is the base. Nothing is ever differentiated with respect to it.
GIVEN = {
    "aim": 2 * N,
    "time": 1,
    "size": 2,
    "ground": 3,
    "gravity_share": 1,
    "disturbance": 1,
    "slope": 1,
    "spin": 1,
    "hip": 6,
}
TORSO = biped.LINKS.index("UH")
# Controlled angles as sums of link angles, in the order of LINKS: joint angles, and that of the stance sole, whose torque the
# ground gives; as printed, knees are relative to thighs (27), (28), other angles from the forward axis.
ANGLES: Mapping[Coordinates, Mapping[str, Mapping[str, int]]] = {
    "joint": {
        **{name: terms for name, terms in biped.JOINT_ANGLES.items() if name != "toe'"},
        "sole'": {"A'S'": 1},
        "toe'": biped.JOINT_ANGLES["toe'"],
    },
    "printed": {
        "HK": {"HK": 1},
        "knee": biped.JOINT_ANGLES["knee"],
        "HK'": {"HK'": 1},
        "knee'": biped.JOINT_ANGLES["knee'"],
        **{link: {link: 1} for link in biped.LINKS[4:]},
    },
}


def measure_joints(coordinates: Coordinates) -> DM:
    """Return the matrix (9, 9) from link angles to the controlled angles."""
    return DM([[terms.get(link, 0) for link in biped.LINKS] for terms in ANGLES[coordinates].values()])


class Rollout(NamedTuple):
    """The closed loop at the end of every quantum; columns are quanta."""

    desired: MX  # (18, m) desired angles and rates
    state: MX  # (18, m) angles [rad] and rates [rad/s] of the nine links
    torque: MX  # (9, m) torques on the controlled angles [Nm]
    zmp: MX  # (1, m) ahead of the stance ankle, on the virtual slope in double support [m]
    hip: MX  # (6, m) planned place, velocity and acceleration [m, m/s, m/s^2]


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoop:
    """Closed loop over whole quanta of time."""

    quanta: int  # number of steps of the rollout
    inverse_kinematics: InverseKinematics = "closed-form"  # source of the desired angles of both legs
    coordinates: Coordinates = "joint"  # what the controller measures and drives
    rates: Rates = "exact"  # desired ones: derivatives of the plan, or differences of its angles over a quantum
    base: Base = "stance-foot"  # pinned to its step; or the hip, on its planned curve, with six contacts

    @cached_property
    def joints(self) -> DM:
        """(9, 9) from link angles to the controlled angles."""
        return ca.sparsify(measure_joints(self.coordinates))

    @property
    def base_point(self) -> str:
        """The hip, or the stance ankle."""
        return "H" if self.base == "hip" else "A'"

    def locate_base(self, hip: SX) -> tuple[SX, SX, SX]:
        """Return place [m], velocity and acceleration (2,) of the base, from those of the hip (6,) if that is the base."""
        if self.base == "hip":
            return hip[:2], hip[2:4], hip[4:]
        return SX(2, 1), SX(2, 1), SX(2, 1)

    def inputs(self, point: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        """Return desired angles and rates (18, m + 1) of the links at the ends of quanta, and ``GIVEN``."""
        stair = read_stair(point)
        size = ca.vertcat(stair.tread, stair.rise)
        times = np.arange(self.quanta + 1) * QUANTUM
        plan = ca.repmat(ca.vertcat(collect_governing(point), size, point["reach_margin"]), 1, self.quanta + 1)
        planned = _make_desired(ops).map(self.quanta + 1)(DM(times[None, :]), plan)
        desired, place, speed = ca.vertsplit(planned, [0, 2 * N, 2 * N + 2, 2 * N + 4])
        if self.inverse_kinematics == "network":
            desired = solve_legs_by_network(desired, ONLINE)
        if self.rates == "differences":
            differences = (desired[:N, 1:] - desired[:N, :-1]) / QUANTUM
            desired = ca.vertcat(desired[:N, :], ca.horzcat(differences[:, 0], differences))
        contact = ("ground_stiffness_N_m", "ground_damping_N_s_m", "friction")
        constants = ca.vertcat(size, *(point[name] for name in (*contact, "gravity_compensation", "disturbance_Nm")))
        on_slope = ca.fmax(DM(times[None, 1:]) < point["t2_s"], point["slope_in_single_support"])
        given = ca.vertcat(
            desired[:, 1:],
            DM(times[None, :-1]),
            ca.repmat(constants, 1, self.quanta),
            stair.rise / stair.tread * on_slope,
            ca.repmat(point["spin_in_zmp"], 1, self.quanta),
            ca.vertcat(place[:, :-1], speed[:, 1:], (speed[:, 1:] - speed[:, :-1]) / QUANTUM),
        )
        return desired, given

    def rollout(self, point: Point, tuned: MX, ops: Nonsmooth) -> Rollout:
        """Return states, torques and ZMP for tuned K_p, K_d >= 0 and desired torso pitch."""
        desired, given = self.inputs(point, ops)
        inputs = given, ca.repmat(tuned, 1, self.quanta)
        states = ops.rollout(self.step, desired[:, 0], *inputs)
        before = ca.horzcat(desired[:, 0], states[:, :-1])
        torque, zmp = self.outcome.map(self.quanta)(before, states, *inputs)
        return Rollout(desired[:, 1:], states, torque, zmp, given[-6:, :])

    def find_stance_ankle(self, rollout: Rollout) -> MX:
        """Return its place (2, m) in a rollout [m]; with the hip as base to the way of the hip in a quantum."""
        q, hip = SX.sym("q", N), SX.sym("hip", 6)
        ankle = biped.locate_points(q, self.locate_base(hip)[0], self.base_point)["A'"]
        return ca.Function("ankle", [q, hip], [ankle]).map(self.quanta)(rollout.state[:N, :], rollout.hip)

    @cached_property
    def step(self) -> ca.Function:
        """Function of (state (18,), given, tuned) to the state one quantum later."""
        state, inputs, named = self._symbols()
        following = quantised.advance(state, solve_definite(*self._equations(state, named)), QUANTUM)
        return ca.Function(
            "step", [ca.vertcat(*state), *inputs], [ca.cse(ca.vertcat(*following))], {"is_diff_in": [True, False, True]}
        )

    def _equations(self, state: QuantisedState, named: Mapping[str, Any]) -> Equations:
        """Return the equations of the acceleration within one quantum."""
        q, v = state
        place, speed, push = self.locate_base(named["hip"])
        places = biped.locate_points(q, place, self.base_point)
        motion = biped.make_dynamics(q, v, q, self.base_point)
        stair = Stair(named["size"][0], named["size"][1])

        def touch(point: SX) -> Contact:
            height = point[1] - compute_stair_height(point[0], stair, SETBACK, EDGE_WIDTH)
            return Contact(height, ca.jacobian(point[1], q).T, ca.jacobian(point[0], q).T, speed[::-1])

        contacts = [touch(places[name]) for name in CONTACTS if name != self.base_point]
        control, aim, ground = named["control"], named["desired"], Ground(*ca.vertsplit(named["ground"]))
        disturbance = ca.repmat(named["disturbance"] * ca.sin(2 * named["time"]), N, 1)
        if self.base == "hip":  # which accelerates the links
            centres = biped.locate_centres(places)
            momentum = sum((biped.get_rod(link).mass_kg * centre for link, centre in centres.items()), SX(2, 1))
            disturbance -= ca.inv(self.joints).T @ ca.jacobian(momentum, q).T @ push
        return quantised.implicit_quantum(motion, state, control, aim, contacts, ground, disturbance, QUANTUM)

    @cached_property
    def outcome(self) -> ca.Function:
        """Function of (state, next state, given, tuned) to torques (9,) and ZMP, with a quantum's mean acceleration."""
        state, inputs, named = self._symbols()
        following = QuantisedState(SX.sym("q_next", N), SX.sym("v_next", N))
        G = biped.make_dynamics(state.q, state.v, state.q, self.base_point).G
        torque = quantised.controller_torque(named["control"], named["desired"], following, G)

        acceleration = (following.v - state.v) / QUANTUM
        place, _, push = self.locate_base(named["hip"])
        places = biped.locate_points(state.q, place, self.base_point)
        centres = biped.locate_centres(places)
        whole, moment = SX(2, 1), named["spin"] * biped.compute_spin_moment(acceleration)
        for link, centre in centres.items():
            velocity = ca.jtimes(centre, *state)
            total = ca.jtimes(velocity, *state) + ca.jtimes(centre, state.q, acceleration) + push
            force = biped.get_rod(link).mass_kg * (total + ca.vertcat(0, biped.GRAVITY))
            whole, moment = whole + force, moment + biped.compute_moment(centre, force)
        pull, weight = ca.vertsplit(whole)
        least = biped.LEAST_LOAD * biped.load_toe_foot_biped().mass_kg * biped.GRAVITY
        zmp = moment / ca.fmax(weight - named["slope"] * pull, least)  # (eq. 49)
        return ca.Function(
            "outcome",
            [ca.vertcat(*state), ca.vertcat(*following), *inputs],
            ca.cse([torque, zmp]),
            {"is_diff_in": [True, True, False, True]},
        )

    def _symbols(self) -> tuple[QuantisedState, list[SX], dict[str, Any]]:
        """Return the state, the inputs given and tuned, and their parts by name, with controller and desired state."""
        given, tuned = SX.sym("given", sum(GIVEN.values())), SX.sym("tuned", 3)
        ends = [0, *np.cumsum(list(GIVEN.values())).tolist()]
        named: dict[str, Any] = dict(zip(GIVEN, ca.vertsplit(given, ends), strict=True))
        kp, kd, torso = ca.vertsplit(tuned)
        aim = named.pop("aim")
        share = named.pop("gravity_share")
        named["control"] = quantised.Controller(ca.repmat(kp, N, 1), ca.repmat(kd, N, 1), share, self.joints)
        named["desired"] = QuantisedState(ca.vertcat(aim[:TORSO], torso, aim[TORSO + 1 : N]), aim[N:])
        return QuantisedState(SX.sym("q", N), SX.sym("v", N)), [given, tuned], named


def _make_desired(ops: Nonsmooth) -> ca.Function:
    """Return the function of (time, governing parameters, stair, reach margin) to the desired state and the hip's (22,)."""
    (s, passing, *constants), plan, _, step = make_step_symbols(ops)
    given = ca.vertcat(*constants)
    angles = (ca.vertcat(order, SX(2, 1)) for order in step.q[:2])
    pose = ca.Function("pose", [s, passing, given], [*angles, step.hip.position, step.hip.velocity])
    time = SX.sym("time")
    starts = ca.vertcat(0, ca.cumsum(plan.durations)[:3])
    passed = (time - starts) / plan.durations
    shares = ca.fmin(ca.fmax(passed, 0), 1)
    now = (passed >= 0) * ca.vertcat(passed[:3] < 1, 1)
    return ca.Function("desired", [time, given], [ca.cse(ca.vertcat(*pose(shares, now, given)))])
