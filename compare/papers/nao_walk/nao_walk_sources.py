"""Sources of claims about NAO's walk, and the walk that the maker documents."""

from __future__ import annotations

from dataclasses import dataclass

from nlp_gait.gaits.biped.cart_table import Footsteps


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Source of a claim: authors, title and publication, and the part that could be read here."""

    reference: str
    read: str

    def __str__(self) -> str:
        """Reference, with the part that was read."""
        return f"{self.reference} (read: {self.read})"


KNEES = Source(
    reference="Sun, Roos (2013): An energy efficient gait for a Nao robot. 25th Benelux Conference on Artificial Intelligence",
    read="abstract",
)
STRAIGHT = Source(
    reference="Sun, Roos: Dynamic lateral stability for an energy efficient gait",
    read="abstract and beginning of the introduction",
)
LOW_POWER = Source(
    reference="Kulk, Welsh: A low power walk for the NAO robot. Australasian Conference on Robotics and Automation",
    read="abstract and beginning of the introduction",
)
DEFAULT_SPEED = Source(
    reference="Wireless Communications and Mobile Computing (2021), article 1496364, which cites Aldebaran's documentation",
    read="abstract",
)
DATA_SHEET = Source(
    reference="NAO6 Robot Datasheet, model H25600, version 10/2024, Aldebaran",
    read="all of it",
)
MANUAL = Source(
    reference="Aldebaran, documentation of NAOqi: omni-directional walk, locomotion control",
    read="beginnings of the pages of several versions; the default height of a step only in programs that set it",
)

SPEED_M_S = 0.0952  # DEFAULT_SPEED
STEP_M = 0.040  # MANUAL
DOUBLE_SHARE = 1.0 / 3.0  # of a step's time (MANUAL)
TORSO_M = 0.315  # MANUAL
LIFT_M = 0.020  # MANUAL
BATTERY_WH, ACTIVE_MIN = 62.5, 60.0  # DATA_SHEET
STRETCHED_M = 0.334  # greatest height of the hip, with stretched legs: Gupta, Pratihar, Deb (2023), section 4.1


def make_footsteps(step_m: float = STEP_M, torso_m: float = TORSO_M) -> Footsteps:
    """Return the footsteps of the robot's own walk, which plans the ZMP of an inverted pendulum (MANUAL)."""
    period_s = STEP_M / SPEED_M_S
    return Footsteps(
        step_m=step_m,
        single_s=(1.0 - DOUBLE_SHARE) * period_s,
        double_s=DOUBLE_SHARE * period_s,
        hip_height_m=torso_m,
        lift_m=LIFT_M,
    )
