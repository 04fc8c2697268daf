"""Five functions that are not gaits, each for CasADi and, over a module such as NumPy, for all rows of a batch at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

VARIABLES, STEPS, SAMPLES, HIDDEN = 20, 40, 50, 32
RNG = np.random.default_rng(0)
# Six revolute joints: twist and offset of the next axis, mass, centre and inertia of the link, of the size of a small robot arm.
TWISTS = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
OFFSETS = ((0.0, 0.0, 0.1), (0.4, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 0.1), (0.0, 0.0, 0.1), (0.0, 0.0, 0.1))
MASSES = (3.7, 8.4, 2.3, 1.2, 1.2, 0.2)
CENTRES = ((0.0, -0.03, 0.0), (0.2, 0.0, 0.1), (0.2, 0.0, 0.02), (0.0, 0.0, 0.01), (0.0, 0.0, 0.01), (0.0, 0.0, -0.02))
INERTIAS = (
    (0.01, 0.01, 0.01),
    (0.02, 0.2, 0.2),
    (0.01, 0.05, 0.05),
    (2e-3, 2e-3, 2e-3),
    (2e-3, 2e-3, 2e-3),
    (1e-4, 1e-4, 2e-4),
)
WEIGHTS = [RNG.normal(0.0, 0.4, size) for size in ((HIDDEN, 8), (HIDDEN, HIDDEN), (1, HIDDEN))]
TIMES = np.linspace(0.0, 5.0, SAMPLES)
DATA = 2.0 * np.exp(-0.7 * TIMES) + np.exp(-2.5 * TIMES) + RNG.normal(0.0, 0.01, SAMPLES)


@dataclass(frozen=True, kw_only=True)
class PlainFunction:
    """One of the functions, of one vector."""

    name: str
    function: ca.Function  #: (n,) to (m,)
    vectorised: Callable[[Any, Any], Any]  #: module such as numpy, and X (P, n), to (P, m)
    lower: float  #: of all entries of x
    upper: float


def plain_functions() -> list[PlainFunction]:
    """Return the functions: SX and MX, with and without a loop."""
    x, u, state, w = ca.SX.sym("x", VARIABLES), ca.SX.sym("u", STEPS), ca.SX.sym("state", 18), ca.MX.sym("w", 8)
    rate, t, y, rates = ca.SX.sym("rate", 4), ca.SX.sym("t"), ca.SX.sym("y"), ca.MX.sym("rates", 4)
    error = ca.Function("error", [rate, t, y], [_decay(ca, rate.elements(), t, y)]).map(SAMPLES)
    errors = error(ca.repmat(rates, 1, SAMPLES), TIMES[None], DATA[None])
    first, second, third = WEIGHTS
    network = third @ ca.tanh(second @ ca.tanh(first @ w))
    columns = {
        "rosenbrock": lambda xp, X: _rosenbrock(_columns(X)),
        "cart-pole": lambda xp, X: _cart_pole(xp, _columns(X)),
        "arm torques": lambda xp, X: xp.stack(
            _torques(xp, _columns(X), _apply if xp is np else _apply_at_once), axis=1
        ),
        "network": lambda xp, X: xp.tanh(xp.tanh(X @ first.T) @ second.T) @ third.T,
        "decay fit": lambda xp, X: (_decay(xp, [X[:, i, None] for i in range(4)], TIMES, DATA)).sum(axis=1),
    }
    functions = {
        "rosenbrock": (ca.Function("rosenbrock", [x], [_rosenbrock(x.elements())]), -2.0, 2.0),
        "cart-pole": (ca.Function("cart_pole", [u], [_cart_pole(ca, u.elements())]), -10.0, 10.0),
        "arm torques": (ca.Function("arm", [state], [ca.vertcat(*_torques(ca, state.elements(), _apply))]), -2.0, 2.0),
        "network": (ca.Function("network", [w], [network]), -2.0, 2.0),
        "decay fit": (ca.Function("fit", [rates], [ca.sum2(errors)]), 0.0, 3.0),
    }
    return [
        PlainFunction(name=name, function=function, vectorised=columns[name], lower=lower, upper=upper)
        for name, (function, lower, upper) in functions.items()
    ]


def _columns(X: Any) -> list[Any]:
    return [X[:, i] for i in range(X.shape[1])]


def _rosenbrock(x: list[Any]) -> Any:
    """Sum of 100 (x[i+1] - x[i]^2)^2 + (1 - x[i])^2."""
    return sum(100.0 * (b - a * a) ** 2 + (1.0 - a) ** 2 for a, b in zip(x, x[1:], strict=False))


def _cart_pole(xp: Any, forces: list[Any]) -> Any:
    """Cost of a rollout of a cart (1 kg) with a pole (0.1 kg, half length 0.5 m) from rest, semi-implicit Euler, 20 ms."""
    position, angle, speed, rate, cost = 0.0, 0.1 + 0.0 * forces[0], 0.0, 0.0, 0.0
    for force in forces:
        s, c = xp.sin(angle), xp.cos(angle)
        push = (force + 0.05 * rate * rate * s) / 1.1
        turn = (9.81 * s - c * push) / (0.5 * (4.0 / 3.0 - 0.1 * c * c / 1.1))
        speed = speed + 0.02 * (push - 0.05 * turn * c / 1.1)
        rate = rate + 0.02 * turn
        position = position + 0.02 * speed
        angle = angle + 0.02 * rate
        cost = cost + position * position + 10.0 * angle * angle + 1e-3 * force * force
    return cost


def _torques(xp: Any, state: list[Any], apply: Callable[..., list[Any]]) -> list[Any]:
    """Torques of a six-joint arm from angles, speeds and accelerations, by the recursive Newton-Euler algorithm."""
    q, qd, qdd = state[:6], state[6:12], state[12:]
    turns, omega, alpha, acceleration = [], [0.0] * 3, [0.0] * 3, [0.0, 0.0, 9.81]
    loads = []
    for i in range(6):
        turn = _rotation(xp, q[i], TWISTS[i])
        turns.append(turn)
        before = omega, alpha
        omega, alpha = apply(xp, turn, omega), apply(xp, turn, alpha)
        alpha = [alpha[0] + omega[1] * qd[i], alpha[1] - omega[0] * qd[i], alpha[2] + qdd[i]]
        omega = [omega[0], omega[1], omega[2] + qd[i]]
        acceleration = apply(xp, turn, _add(acceleration, _carried(*before, OFFSETS[i])))
        centre = _add(acceleration, _carried(omega, alpha, CENTRES[i]))
        force = [MASSES[i] * a for a in centre]
        momentum = [j * w for j, w in zip(INERTIAS[i], omega, strict=True)]
        moment = _add([j * a for j, a in zip(INERTIAS[i], alpha, strict=True)], _cross(omega, momentum))
        loads.append((force, _add(moment, _cross(CENTRES[i], force))))
    torques, force, moment = [], [0.0] * 3, [0.0] * 3
    for i in reversed(range(6)):
        force, moment = _add(loads[i][0], force), _add(loads[i][1], moment)
        torques.append(moment[2])
        back = list(zip(*turns[i], strict=True))
        force, moment = apply(xp, back, force), apply(xp, back, moment)
        moment = _add(moment, _cross(OFFSETS[i], force))
    return torques[::-1]


def _rotation(xp: Any, angle: Any, twist: float) -> list[list[Any]]:
    """Return the matrix from the coordinates of a link to those of the next one: twist about x, then angle about z."""
    s, c, st, ct = xp.sin(angle), xp.cos(angle), float(np.sin(twist)), float(np.cos(twist))
    return [[c, s * ct, s * st], [-s, c * ct, c * st], [0.0, -st, ct]]


def _apply(xp: Any, matrix: Any, v: Any) -> list[Any]:
    return [row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in matrix]


def _apply_at_once(xp: Any, matrix: Any, v: Any) -> list[Any]:
    """The same by one product, without which XLA joins all joints into one loop that takes a thousand times as long."""
    rows = len(xp.asarray(matrix[0][0]))
    entries = [xp.broadcast_to(xp.asarray(entry, float), (rows,)) for line in matrix for entry in line]
    vector = [xp.broadcast_to(xp.asarray(entry, float), (rows,)) for entry in v]
    product = xp.einsum("pij,pj->pi", xp.stack(entries, -1).reshape(rows, 3, 3), xp.stack(vector, -1))
    return [product[:, i] for i in range(3)]


def _add(a: Any, b: Any) -> list[Any]:
    return [x + y for x, y in zip(a, b, strict=True)]


def _cross(a: Any, b: Any) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _carried(omega: Any, alpha: Any, place: Any) -> list[Any]:
    return _add(_cross(alpha, place), _cross(omega, _cross(omega, place)))


def _decay(xp: Any, rates: list[Any], t: Any, y: Any) -> Any:
    """Squared error of the sum of two exponentials at a time."""
    return (rates[0] * xp.exp(-rates[1] * t) + rates[2] * xp.exp(-rates[3] * t) - y) ** 2
