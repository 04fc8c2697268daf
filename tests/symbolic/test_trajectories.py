"""Boundary conditions and derivatives of the trajectories."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic, map_motion, parabola_lift, stack

# Positions, velocities and times of order one in double precision.
TOLERANCE = 1e-10


_SIX = SX.sym("start"), SX.sym("end"), SX.sym("v0"), SX.sym("v1"), SX.sym("T"), SX.sym("phase")
CUBIC = ca.Function("cubic", list(_SIX), list(cubic(*_SIX)))


def test_cubic_is_a_cubic_in_time() -> None:
    """By hand: 1 + 2 t - 3 t^2 + 0.5 t^3 on [0, 2]."""
    p, v = np.polynomial.Polynomial([1.0, 2.0, -3.0, 0.5]), np.polynomial.Polynomial([2.0, -6.0, 1.5])
    for t in (0.0, 0.3, 1.0, 1.9):
        values = [float(value) for value in CUBIC(p(0), p(2), v(0), v(2), 2.0, t / 2.0)]
        assert values == pytest.approx([p(t), v(t), v.deriv()(t)], abs=TOLERANCE)


def _lift(phase: float, duration: float = 4.0, height: float = 0.02) -> tuple[list[float], list[float]]:
    zero = SX(0)
    along = cubic(SX(0.0), SX(0.12), zero, zero, SX(duration), SX(phase))
    lift = parabola_lift(along, 0.0, 0.12, SX(height))
    return [float(part) for part in along], [float(part) for part in lift]


def test_the_swing_foot_starts_and_lands_at_zero_height_and_peaks_halfway() -> None:
    for phase, height, velocity in ((0.0, 0.0, 0.0), (0.5, 0.02, 0.0), (1.0, 0.0, 0.0)):
        _, lift = _lift(phase)
        assert lift[:2] == pytest.approx([height, velocity], abs=TOLERANCE)


def test_derivatives_of_the_lift_are_those_of_its_height() -> None:
    step, duration = 1e-5, 4.0  # [-]; central differences err by 1e-9 here
    for phase in (0.1, 0.37, 0.8):
        before, now, after = (_lift(phase + shift)[1] for shift in (-step, 0.0, step))
        assert (after[0] - before[0]) / (2 * step * duration) == pytest.approx(now[1], abs=1e-8)
        assert (after[1] - before[1]) / (2 * step * duration) == pytest.approx(now[2], abs=1e-8)


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
