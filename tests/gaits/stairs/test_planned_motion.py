"""The hip of the planned step, also where the step is faster than any of the paper's; the rest is in ``tests.referee``."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.gaits.stairs.planar_biped import GRAVITY
from nlp_gait.gaits.stairs.planned_motion import Stair, StairPlan, locate_hip, move_in_time

PLAN = dict.fromkeys(StairPlan._fields, 0.1)
PLAN |= {"hip_height": 0.69, "hip_start": 0.09, "zmp_start": 0.24, "zmp_end": 0.09}
TIMES = {"t1": 0.5, "t2": 1.4, "t_bc": 2.2, "t3": 3.5}
TREAD_M, RISE_M = 0.254, 0.1778


@pytest.mark.parametrize("speed", [1.0, 10.0])
@pytest.mark.parametrize("phase", range(4))
def test_the_hip_is_a_pendulum_over_the_planned_zmp(phase: int, speed: float) -> None:
    """Its acceleration is w^2 (x - zmp), also in a step so fast that neither of its exponentials has faded."""
    times = {name: value / speed for name, value in TIMES.items()}
    fast = StairPlan(**{name: SX(value) for name, value in {**PLAN, **times}.items()})
    s, passing = SX.sym("s", 4), SX.sym("passing", 4)
    motion = move_in_time(locate_hip(fast, Stair(SX(TREAD_M), SX(RISE_M)), s), s, passing / fast.durations)
    at = ca.Function("hip", [s, passing], [motion.position[0], motion.acceleration[0], ca.dot(fast.durations, s)])
    x, acceleration, t = (float(part) for part in at([1.0] * phase + [0.3] + [0.0] * (3 - phase), np.eye(4)[phase]))
    way, passed = TREAD_M + PLAN["zmp_end"] - PLAN["zmp_start"], t / times["t3"]
    zmp = PLAN["zmp_start"] + way * passed**2 * (3 - 2 * passed)
    assert acceleration == pytest.approx(GRAVITY / PLAN["hip_height"] * (x - zmp), rel=1e-9, abs=1e-9)
    ends = [float(at([end] * 4, [0] * 4)[0]) for end in (0, 1)]
    assert ends == pytest.approx([PLAN["hip_start"], PLAN["hip_start"] + TREAD_M], abs=1e-12)
