"""Tables III and IV of Bhardwaj, Mishra, Sukavanam and Balasubramanian, as printed."""

from __future__ import annotations

from typing import NamedTuple


class Case(NamedTuple):
    """A column of Table IV; units as printed, the last three without one in the paper but for the torque."""

    stair_length_m: float  # of a double step
    rise_run_ratio: float  # rise over run
    acceleration: float  # largest, printed in m/s^2, of joint angles [rad/s^2]
    jerk: float  # largest, printed in m/s^3 [rad/s^3]
    torso_pitch_rad: float  # q5
    kp: float  # K_p
    kd: float  # K_d
    cost: float  # of (53)
    energy: float  # total consumption, without a unit
    peak_torque_Nm: float  # largest torque

    @property
    def step_m(self) -> tuple[float, float]:
        """Tread and rise of one step."""
        return self.stair_length_m / 2, self.stair_length_m / 2 * self.rise_run_ratio


TABLE_4 = {
    1: Case(0.5588, 0.64, 42.77, 1894.6, 1.25847, 23.3027, 86.2633, 20.6346, 1.0192e5, 114.5284),
    2: Case(0.508, 0.70, 34.86, 1453.1, 1.2055, 2.6474, 7.3724, 14.9627, 8.7396e4, 35.6167),
    3: Case(0.5588, 0.72, 42.75, 3406.6, 1.2728, 32.0680, 86.7533, 36.8319, 9.6890e4, 60.3183),
}
ANTS, ITERATIONS, EVAPORATION = 30, 100, 0.7  # Table IV

# Governing parameters (Table III) under the names of the problem; the two knots t1' = 0.8 s and t2' = 1.1 s are not explained.
TABLE_3 = {
    "t1_s": 0.50,
    "t2_s": 1.40,
    "t_bc_s": 2.20,
    "t3_s": 3.50,
    "sole_angle_rad": 0.5236,
    "toe_angle_rad": 0.5236,
    "catch_angle_rad": 0.01,
    "hip_height_m": 0.78,
}
