"""Temporal quantised Lagrange dynamics under a PD controller: one quantum of time, linearly implicit.

Contacts are springs and dampers with Coulomb friction; implicit, they are stable at every stiffness and gain.
"""

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.symbolic.dynamics import EquationsOfMotion

# A link that turns by a radian within a quantum is not resolved: there this power of its turn brakes it as much as its inertia.
# At the rates of a gait, a tenth of that, the brake is 1e-8 of the inertia.
BRAKE_POWER = 8


# A contact fades in over this height [m], and out again as its force falls below this one [N]: no branch, no jump.
FADE_HEIGHT, FADE_FORCE = 2e-4, 1.0
# Springs yield beyond this depth [m]: a point far below the ground came through a riser, and must not be accelerated upwards.
YIELD_DEPTH = 0.02
# A slower contact sticks: it creeps at this speed times the ratio of its load to the friction limit [m/s].
CREEP_SPEED = 5e-3


class Ground(NamedTuple):
    """Spring and damper below a contact, and friction: k_s [N/m], k_d [N s/m], mu."""

    stiffness: SX
    damping: SX
    friction: SX


class Contact(NamedTuple):
    """A point that may touch the ground."""

    height: SX  #: above the ground [m]
    normal: SX  #: (n,) derivative of the height by the coordinates
    tangent: SX  #: (n,) derivative of the forward position by the coordinates
    drift: SX = SX(2, 1)  #: (2,) velocity at rest, of a base that moves: up from the ground, and forward [m/s]

    def velocity(self, rates: SX) -> tuple[SX, SX]:
        """Return the speeds up from the ground and forward, at rates (n,) of the coordinates."""
        return ca.dot(self.normal, rates) + self.drift[0], ca.dot(self.tangent, rates) + self.drift[1]


class Equations(NamedTuple):
    """mass @ acceleration = force, (n, n) and (n,); the symmetric part of the mass is positive definite."""

    mass: SX
    force: SX


def implicit_equations(
    motion: Equations, velocity: SX, contacts: Sequence[Contact], ground: Ground, quantum: SX | float
) -> Equations:
    """Return the equations of the acceleration over one quantum of time dt [s], with the contact forces at its end.

    Spring, damper and friction act at the position and velocity (n,) at the end of the quantum, so none of them can overshoot. A
    first pass without friction finds which contacts press, a second one adds friction and releases those that would pull. The
    given motion has no contacts; its mass includes the terms of other implicit forces.

    Source:
        Bhardwaj et al., eqs. (33)-(35), (44)-(46), at the quantum's end; as printed, stable for k dt / 2 < c < 2 m / dt only.
    """
    mass, force = motion
    k, c, mu = ground
    stiff = k * quantum**2 / 2 + c * quantum  # force that one unit of normal acceleration takes away
    rates, slips = ([contact.velocity(velocity)[i] for contact in contacts] for i in range(2))
    ahead = [contact.height + quantum * rate for contact, rate in zip(contacts, rates, strict=True)]
    depths = [YIELD_DEPTH * ca.tanh(-height / YIELD_DEPTH) for height in ahead]
    free = [k * depth - c * rate for depth, rate in zip(depths, rates, strict=True)]  # (eq. 33)
    touching = [(1 - ca.tanh(height / FADE_HEIGHT)) / 2 for height in ahead]

    pressing, pressed_by = _add_normal_forces(motion, contacts, touching, free, stiff)
    solved = solve_definite(pressing, ca.horzcat(pressed_by, *(contact.tangent for contact in contacts)))
    first, yields = solved[:, 0], ca.horzsplit(solved[:, 1:])
    shares, grips = [], []
    for contact, touch, push, slip, give in zip(contacts, touching, free, slips, yields, strict=True):
        pressed = touch * (push - stiff * ca.dot(contact.normal, first))
        keeps = (1 + ca.tanh(pressed / FADE_FORCE)) / 2
        limit = mu * keeps * pressed  # (eq. 34)
        speed = ca.sqrt((slip + quantum * ca.dot(contact.tangent, first)) ** 2 + CREEP_SPEED**2)
        left = speed - quantum * ca.dot(contact.tangent, give) * limit  # after a quantum at the friction limit
        shares.append(touch * keeps)
        grips.append(limit / (CREEP_SPEED + (left + ca.sqrt(left**2 + CREEP_SPEED**2)) / 2))

    for contact, grip, slip in zip(contacts, grips, slips, strict=True):
        mass = mass + grip * quantum * contact.tangent @ contact.tangent.T
        force = force - grip * slip * contact.tangent
    return _add_normal_forces(Equations(mass, force), contacts, shares, free, stiff)


def _add_normal_forces(
    motion: Equations, contacts: Sequence[Contact], shares: Sequence[SX], free: Sequence[SX], stiff: SX
) -> Equations:
    mass, force = motion  # (eq. 35)
    for contact, share, push in zip(contacts, shares, free, strict=True):
        mass = mass + share * stiff * contact.normal @ contact.normal.T
        force = force + share * push * contact.normal
    return Equations(mass, force)


def solve_definite(A: SX, B: SX) -> SX:
    """Solve A X = B (n, m) by elimination without pivoting, hence without branches.

    The symmetric part of A (n, n) must be positive definite; A need not be symmetric.
    """
    n = A.shape[0]
    rows = [ca.horzcat(A[i, :], B[i, :]) for i in range(n)]
    for k in range(n):
        for i in range(k + 1, n):
            rows[i] = rows[i] - rows[i][k] / rows[k][k] * rows[k]
    solution = [row[n:] for row in rows]
    for i in reversed(range(n)):
        solved = sum((rows[i][k] * solution[k] for k in range(i + 1, n)), SX(1, B.shape[1]))
        solution[i] = (rows[i][n:] - solved) / rows[i][i]
    return ca.vertcat(*solution)


class Controller(NamedTuple):
    """PD controller with partial compensation of gravity."""

    proportional: SX  #: (n,) K_p [N m/rad]
    derivative: SX  #: (n,) K_d [N m s/rad]
    gravity_share: SX  #: compensated share of gravity; 0 as printed
    joints: DM  #: (n, n) derivative of the controlled angles by the coordinates; invertible


class QuantisedState(NamedTuple):
    """Coordinates and rates, (n,) each."""

    q: SX
    v: SX


def advance(state: QuantisedState, acceleration: SX, quantum: float) -> QuantisedState:
    """Return the state one quantum of time later (eqs. 44, 45)."""
    q, v = state
    return QuantisedState(q + v * quantum + acceleration * quantum**2 / 2, v + acceleration * quantum)


def controller_torque(control: Controller, desired: QuantisedState, state: QuantisedState, gravity: SX) -> SX:
    """Return the torques (n,) on the controlled angles (eqs. 50-52), with the compensated share of gravity."""
    e, rate = (control.joints @ (aim - now) for aim, now in zip(desired, state, strict=True))
    balance = ca.sparsify(ca.inv(control.joints)).T @ gravity
    return control.proportional * e + control.derivative * rate + control.gravity_share * balance


def implicit_quantum(
    motion: EquationsOfMotion,
    state: QuantisedState,
    control: Controller,
    desired: QuantisedState,
    contacts: Sequence[Contact],
    ground: Ground,
    disturbance: SX,
    quantum: float,
) -> Equations:
    """Return the equations of the acceleration with all velocity-dependent forces at the end of the quantum.

    They are finite at every gain. The Coriolis matrix multiplies the rates at the end, too: as dM/dt - 2 C is skew, a free motion
    then loses kinetic energy to first order in the quantum, while links turn by less than a radian in a quantum. In a robot that
    collapses without damping, toes turn ten times faster, which a step of this length cannot resolve: such links are braked.
    ``desired`` is at the end of the quantum dt [s], ``disturbance`` (n,) torques on the controlled angles.

    Source:
        Bhardwaj et al., eqs. (46)-(52), taken at the end of the quantum.
    """
    coasting = advance(state, SX(state.q.shape[0], 1), quantum)
    stiffness = control.derivative * quantum + control.proportional * quantum**2 / 2
    torque = controller_torque(control, desired, coasting, motion.G) + disturbance
    force = control.joints.T @ torque - motion.C @ state.v - motion.G
    brake = ca.diag(motion.M) * (quantum * state.v) ** BRAKE_POWER
    held = control.joints.T @ ca.diag(stiffness) @ control.joints
    mass = motion.M + quantum * motion.C + held + ca.diag(brake)
    return implicit_equations(Equations(mass, force - brake * state.v / quantum), state.v, contacts, ground, quantum)
