"""Tables III and IV of Bhardwaj, Mishra, Sukavanam and Balasubramanian, as printed (``stairs_paper.toml``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from compare.papers.claims import read_printed


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A column of Table IV; cost and energy have no unit in the paper."""

    stair_length_m: float  # of a double step
    rise_run_ratio: float  # rise over run
    acceleration: float  # largest, printed in m/s^2, of joint angles [rad/s^2]
    jerk: float  # largest, printed in m/s^3 [rad/s^3]
    torso_pitch_rad: float  # q5
    kp: float  # K_p
    kd: float  # K_d
    cost: float  # of (53)
    energy: float  # total consumption
    peak_torque_Nm: float  # largest torque

    @property
    def step_m(self) -> tuple[float, float]:
        """Tread and rise of one step."""
        return self.stair_length_m / 2, self.stair_length_m / 2 * self.rise_run_ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class StairsPaper:
    """Content of ``stairs_paper.toml``."""

    table_3: Mapping[str, float]  # governing parameters under the names of the problem
    table_4: tuple[Case, ...]
    rows: Mapping[str, str]  # words for the quantities of Table IV
    effects: Mapping[str, str]  # texts for indexes of a tracked step
    ants: int
    iterations: int
    evaporation: float


PAPER = read_printed(StairsPaper, "stairs/stairs_paper.toml")
TABLE_3, TABLE_4 = PAPER.table_3, dict(enumerate(PAPER.table_4, 1))
ANTS, ITERATIONS, EVAPORATION = PAPER.ants, PAPER.iterations, PAPER.evaporation
