"""Temporal quantised Lagrange dynamics under a PD controller: one quantum of time, as printed and linearly implicit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.symbolic.contact import Contact, Equations, Ground, implicit_equations
from nlp_gait.symbolic.dynamics import EquationsOfMotion

# A link that turns by a radian within a quantum is not resolved: there this power of its turn brakes it as much as its inertia.
# At the rates of a gait, a tenth of that, the brake is 1e-8 of the inertia.
BRAKE_POWER = 8


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


def explicit_quantum(
    motion: EquationsOfMotion,
    state: QuantisedState,
    control: Controller,
    desired: QuantisedState,
    contacts: Sequence[Contact],
    ground: Ground,
    disturbance: SX,
) -> Equations:
    """Return the equations of the acceleration as printed: controller and contacts act on the state at the start of the quantum.

    It is stable only for K_d below twice the least inertia over dt: 0.018 N m s/rad at the toe and dt = 0.01 s.

    Source:
        Bhardwaj et al., eqs. (33)-(35), (46)-(52); ``desired`` at the start of the quantum, friction against the slip.
    """
    torque = controller_torque(control, desired, state, motion.G) + disturbance
    force = control.joints.T @ torque - motion.C @ state.v - motion.G
    for contact in contacts:
        rate, slip = contact.velocity(state.v)
        pressed = (contact.height <= 0) * (-ground.stiffness * contact.height - ground.damping * rate)  # (eq. 33)
        force += pressed * (contact.normal - ground.friction * ca.sign(slip) * contact.tangent)  # (eqs. 34, 35)
    return Equations(motion.M, force)
