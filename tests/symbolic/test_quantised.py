"""One quantum of time: the brake on links that turn too fast for it is felt by these only."""

from __future__ import annotations

import casadi as ca
import pytest
from casadi import SX

from nlp_gait.symbolic.contact import Ground, solve_definite
from nlp_gait.symbolic.lagrange import EquationsOfMotion
from nlp_gait.symbolic.quantised import Controller, QuantisedState, after, implicit_quantum

QUANTUM = 0.01


@pytest.mark.parametrize(("rate", "kept"), [(1.0, 1.0), (10.0, 1.0 - 1e-8), (100.0, 0.5), (1000.0, 1e-8)])
def test_a_free_link_keeps_its_rate_unless_it_turns_by_a_radian_in_a_quantum(rate: float, kept: float) -> None:
    motion = EquationsOfMotion(SX(0.3), SX(0.0), SX(0.0))
    nothing, ground = Controller(SX(0), SX(0), SX(0)), Ground(SX(0), SX(0), SX(0))
    state = QuantisedState(SX(0.2), SX(rate))
    equations = implicit_quantum(motion, state, nothing, state, [], ground, SX(0), QUANTUM)
    following = after(state, solve_definite(*equations), QUANTUM)
    assert float(ca.evalf(following.v)) / rate == pytest.approx(kept, rel=1e-6)
