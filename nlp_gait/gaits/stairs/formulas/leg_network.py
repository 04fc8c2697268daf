"""The paper's inverse kinematics as a formula: a small network, trained online on the error of its own ankle."""

from __future__ import annotations

import casadi as ca
from casadi import SX

LEAST_KNEE_SINE = 1e-3


def leg_vector(angles: SX, thigh: float, shank: float) -> SX:
    """(2,) from hip to ankle, forward and up [m], of absolute angles (2,) of thigh and shank, clockwise from forward [rad].

    Source:
        Bhardwaj et al., eqs. (27), (28).
    """
    return ca.vertcat(
        thigh * ca.cos(angles[0]) + shank * ca.cos(angles[1]),
        -thigh * ca.sin(angles[0]) - shank * ca.sin(angles[1]),
    )


def leg_rates(angles: SX, velocity: SX, thigh: float, shank: float) -> SX:
    """(2,) rates of thigh and shank [rad/s] at which the ankle has a velocity (2,) from the hip [m/s].

    Damped where the knee is straight or folded within a thousandth of a radian, so that they are always finite.

    Source:
        Bhardwaj et al., eqs. (27), (28), differentiated by time.
    """
    (a, b), (c, d) = (
        ca.vertsplit(row) for row in ca.horzsplit(ca.jacobian(leg_vector(angles, thigh, shank), angles).T)
    )
    determinant = a * d - b * c
    damped = determinant / (determinant**2 + (LEAST_KNEE_SINE * thigh * shank) ** 2)
    return damped * ca.vertcat(d * velocity[0] - b * velocity[1], a * velocity[1] - c * velocity[0])


def network_error(weights: SX, target: SX, thigh: float, shank: float) -> tuple[SX, SX]:
    """Angles of a leg by one hidden layer of sigmoids, and the squared distance of its ankle from the target [m^2].

    Args:
        weights: (4 h,) of h hidden nodes: those of the inputs (h, 2), then those of the outputs (2, h), by columns.
        target: (2,) from hip to ankle [m].
        thigh: length [m].
        shank: length [m].

    Returns:
        (2,) absolute angles of thigh and shank [rad], and the error.

    Source:
        Bhardwaj et al., section VI and eqs. (27)-(29).
    """
    nodes = weights.shape[0] // 4
    inner, outer = ca.reshape(weights[: 2 * nodes], nodes, 2), ca.reshape(weights[2 * nodes :], 2, nodes)
    hip, knee = ca.vertsplit(outer @ (1 / (1 + ca.exp(-(inner @ target)))))
    angles = ca.vertcat(hip, hip + knee)
    return angles, ca.sumsqr(leg_vector(angles, thigh, shank) - target)  # (eq. 29)


def trained_path(
    nodes: int, thigh: float, shank: float, poses: int, rate: float, iterations: int, tolerance: float
) -> ca.Function:
    """Function (weights (4 h,), targets (2, m)) to the angles (2, m) [rad] of a leg along a path of m poses.

    Each pose starts from the weights of the last one and is trained by gradient steps until its error is small enough.

    Args:
        nodes: h, of the hidden layer.
        thigh: length [m].
        shank: length [m].
        poses: m.
        rate: of learning.
        iterations: most steps for one pose.
        tolerance: squared distance of the ankle that ends the training of a pose [m^2].

    Source:
        Bhardwaj et al., Algorithm 1 and eq. (30).
    """
    weights, target = SX.sym("weights", 4 * nodes), SX.sym("target", 2)
    angles, error = network_error(weights, target, thigh, shank)
    trained = weights - rate * (error > tolerance) * ca.gradient(error, weights)  # (eq. 30)
    step = ca.Function("step", [weights, target], [ca.cse(trained)])
    answer = ca.Function("answer", [weights, target], [angles])

    w, aim = ca.MX.sym("w", 4 * nodes), ca.MX.sym("aim", 2)
    learned = step.fold(iterations)(w, ca.repmat(aim, 1, iterations))
    pose = ca.Function("pose", [w, aim], [learned, answer(learned, aim)])
    first, targets = ca.MX.sym("first", 4 * nodes), ca.MX.sym("targets", 2, poses)
    _, found = pose.mapaccum(poses)(first, targets)
    # Trained for given poses: nothing is ever differentiated with respect to them.
    return ca.Function("path", [first, targets], [found], {"is_diff_in": [False, False]})
