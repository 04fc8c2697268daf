"""Tables III and IV of Bhardwaj, Mishra, Sukavanam and Balasubramanian, as printed (``stairs_paper.toml``).

And how plans and the tracked step may be read (``stairs_plan_choices.toml``, ``stairs_choices.toml``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from compare.papers.claims import read_printed, read_tables
from nlp_gait.decoding import decode

OURS, FREE, PRINTED = "ours", "free", "printed"  # readings of the tracked step


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
class Reading:
    """A reading of the planner or of the tracked step: options and values of the problem; the plan that is followed."""

    text: str
    plan: str = "plan"
    plans: tuple[str, ...] = ("jerk", "plan")  # of a reading of the planner: least jerk, least energy
    relaxes: bool = False  # whether it only relaxes limits of the planner, so that our plans keep them
    contains: tuple[
        str, ...
    ] = ()  # of the tracked step: readings with the same objective and narrower bounds or more limits
    options: Mapping[str, str | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


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
CHOICES = {name: decode(Reading, row) for name, row in read_tables("stairs/stairs_choices.toml").items()}
INSTANTS = (OURS, FREE, PRINTED)  # with which Algorithm 4 runs
PLAN_CHOICES = {name: decode(Reading, row) for name, row in read_tables("stairs/stairs_plan_choices.toml").items()}
