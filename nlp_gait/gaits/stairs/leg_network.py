"""The paper's inverse kinematics: a small network trained online, pose after pose, on the error of its own ankle.

Source:
    Bhardwaj et al., section VI, Algorithm 1 and eqs. (27)-(30).
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import LINKS, get_rod

LEAST_KNEE_SINE = 1e-3


def compute_leg_vector(angles: SX, thigh: float, shank: float) -> SX:
    """Return (2,) from hip to ankle, forward and up [m]; angles (2,) of thigh and shank are clockwise from forward [rad]."""
    forward = thigh * ca.cos(angles[0]) + shank * ca.cos(angles[1])  # (eq. 27)
    return ca.vertcat(forward, -thigh * ca.sin(angles[0]) - shank * ca.sin(angles[1]))  # (eq. 28)


def compute_leg_rates(angles: SX, velocity: SX, thigh: float, shank: float) -> SX:
    """Return (2,) rates of thigh and shank [rad/s] for an ankle's velocity (2,) from the hip [m/s], damped at a straight knee."""
    (a, b), (c, d) = (
        ca.vertsplit(row) for row in ca.horzsplit(ca.jacobian(compute_leg_vector(angles, thigh, shank), angles).T)
    )
    determinant = a * d - b * c
    damped = determinant / (determinant**2 + (LEAST_KNEE_SINE * thigh * shank) ** 2)
    return damped * ca.vertcat(d * velocity[0] - b * velocity[1], a * velocity[1] - c * velocity[0])


def compute_network_error(weights: SX, target: SX, thigh: float, shank: float) -> tuple[SX, SX]:
    """Return angles (2,) of thigh and shank [rad] by one hidden layer, and the ankle's squared distance from a target (2,).

    The weights (4 h,) of h hidden nodes are those of the inputs (h, 2), then those of the outputs (2, h), by columns.
    """
    nodes = weights.shape[0] // 4
    inner, outer = ca.reshape(weights[: 2 * nodes], nodes, 2), ca.reshape(weights[2 * nodes :], 2, nodes)
    hip, knee = ca.vertsplit(outer @ (1 / (1 + ca.exp(-(inner @ target)))))
    angles = ca.vertcat(hip, hip + knee)
    return angles, ca.sumsqr(compute_leg_vector(angles, thigh, shank) - target)  # (eq. 29)


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkSettings:
    """Hyperparameters of the network, by default those of Table II, with which a pose in sixteen converges."""

    hidden: int = 10  # nodes of the hidden layer
    rate: float = 1e-4  # of the gradient steps (30)
    iterations: int = 5000  # most steps for one pose
    tolerance_m2: float = 1e-6  # squared distance of the ankle at which the training of a pose ends [m^2]
    seed: int = 0  # of the first weights

    @property
    def first_weights(self) -> Array:
        """Normally distributed weights (4 h,) for ``compute_network_error``."""
        rng = np.random.default_rng(self.seed)
        inner, outer = rng.standard_normal((self.hidden, 2)), rng.standard_normal((2, self.hidden))
        return np.concatenate([inner.ravel(order="F"), outer.ravel(order="F")])


# Gradient steps at a rate with which every pose of the three planned steps converges within 40 of them; the printed 5,000 at
# the printed rate (Table II) take a minute for each rollout, as all of them are evaluated.
ONLINE = NetworkSettings(rate=0.3, iterations=100)
PRINTED = NetworkSettings()
LEGS = (("HK", "KA"), ("HK'", "K'A'"))


def solve_legs_by_network(desired: MX, settings: NetworkSettings) -> MX:
    """Replace desired angles and rates (18, m) of thighs and shanks along a path by those of the network.

    The network learns the ankle's position relative to the hip; rates follow by differentiating its forward kinematics. It
    is trained again, pose after pose, in every evaluation: the paper trains online.
    """
    columns = desired.shape[1]
    rows = ca.vertsplit(desired)
    for thigh, shank in LEGS:
        lengths = get_rod(thigh).length_m, get_rod(shank).length_m
        places = [LINKS.index(thigh), LINKS.index(shank)]  # of angles, then of rates
        places += [len(LINKS) + i for i in places]
        q, v, velocity = SX.sym("q", 2), SX.sym("v", 2), SX.sym("velocity", 2)
        reached = compute_leg_vector(q, *lengths)
        follow = ca.Function("follow", [q, v], [reached, ca.jtimes(reached, q, v)]).map(columns)
        rates = ca.Function("rates", [q, velocity], [compute_leg_rates(q, velocity, *lengths)]).map(columns)
        targets, velocities = follow(
            ca.vertcat(*(rows[i] for i in places[:2])), ca.vertcat(*(rows[i] for i in places[2:]))
        )
        angles, _, _ = make_training_path(settings, *lengths, columns)(DM(settings.first_weights), targets)
        for i, row in zip(places, ca.vertsplit(ca.vertcat(angles, rates(angles, velocities))), strict=True):
            rows[i] = row
    return ca.vertcat(*rows)


def make_training_path(settings: NetworkSettings, thigh: float, shank: float, poses: int) -> ca.Function:
    """Return the function (weights (4 h,), targets (2, m)) to the angles (2, m) [rad] of a leg along a path of m poses.

    Its other outputs are the ankle's squared distance from its target (1, m) and the number of steps taken (1, m). Each pose
    starts from the weights of the last one and is trained by gradient steps until the ankle is near (Algorithm 1).
    """
    count = 4 * settings.hidden
    weights, target, taken = SX.sym("weights", count), SX.sym("target", 2), SX.sym("taken")
    angles, error = compute_network_error(weights, target, thigh, shank)
    far = error > settings.tolerance_m2
    trained = weights - settings.rate * far * ca.gradient(error, weights)  # (eq. 30)
    step = ca.Function("step", [ca.vertcat(weights, taken), target], [ca.cse(ca.vertcat(trained, taken + far))])
    answer = ca.Function("answer", [weights, target], [angles, error])

    first, aim = MX.sym("first", count), MX.sym("aim", 2)
    end = step.fold(settings.iterations)(ca.vertcat(first, 0), ca.repmat(aim, 1, settings.iterations))
    learned, steps = ca.vertsplit(end, [0, count, count + 1])
    pose = ca.Function("pose", [first, aim], [learned, *answer(learned, aim), steps])
    targets = MX.sym("targets", 2, poses)
    _, *outputs = pose.mapaccum(poses)(first, targets)
    # Trained for given poses: nothing is ever differentiated with respect to them.
    return ca.Function("path", [first, targets], outputs, {"is_diff_in": [False, False]})
