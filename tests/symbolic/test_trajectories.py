"""Boundary conditions and derivatives of the trajectories."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.symbolic.trajectories import Motion, constant_motion, map_motion, parabola_lift, stack

# Positions, velocities and times of order one in double precision.
TOLERANCE = 1e-10


def test_what_stands_still_has_no_derivatives_and_costs_nothing() -> None:
    motion = stack(constant_motion(1.5), constant_motion(-2.0))
    assert [float(v) for v in ca.vertsplit(motion.position)] == [1.5, -2.0]
    assert motion.velocity.is_zero()
    assert motion.acceleration.is_zero()


def test_a_function_of_a_motion_by_the_chain_rule() -> None:
    """F = (a^2 b, sin b) at a = 2 + 3 t + 5 t^2 and b = 1 - t + t^2 / 2, at t = 0."""
    motion = Motion(SX([2.0, 1.0]), SX([3.0, -1.0]), SX([10.0, 1.0]))
    position, velocity, acceleration = (
        [float(v) for v in ca.vertsplit(part)]
        for part in map_motion(lambda q: ca.vertcat(q[0] ** 2 * q[1], ca.sin(q[1])), motion)
    )
    sin, cos = np.sin(1.0), np.cos(1.0)
    assert position == pytest.approx([4.0, sin])
    assert velocity == pytest.approx([2 * 2 * 3 * 1 + 4 * -1, -cos])
    # a^2 b: 2 (a'^2 + a a'') b + 4 a a' b' + a^2 b''
    assert acceleration == pytest.approx([2 * (9 + 20) * 1 + 4 * 2 * 3 * -1 + 4 * 1, cos - sin])


def test_a_path_off_the_origin_is_lifted_between_its_own_ends() -> None:
    """From 1 to 3, at 1.5 with rate 2 and bend 4: offset -1/2, rate 2, bend 4 in halves of the path."""
    lift = parabola_lift(Motion(SX(1.5), SX(2.0), SX(4.0)), 1.0, 3.0, SX(0.1))
    assert [float(part) for part in lift] == pytest.approx([0.1 * 0.75, 0.1 * 2.0, -0.2 * (4.0 - 2.0)], abs=TOLERANCE)
