"""The robot of the 12-joint walk: links without mass, actuators as point masses."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from pathlib import Path

from nlp_gait.decoding import read_dataclass
from nlp_gait.errors import RobotDataError
from nlp_gait.robots.robot import check_numbers

DEFAULT_FILE = resources.files("nlp_gait.gaits.walk12") / "point_mass_biped.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMassBiped:
    """Two legs of a thigh and a shank each, with point masses at knees, hips, waist and feet.

    Source:
        Goswami, Vadakkepat, Phung (2008), section 2.
    """

    name: str  # of the robot
    description: str  # one line
    source: str  # of the numbers
    knee_mass_kg: float  # m1, at each knee
    waist_mass_kg: float  # m2, in the middle between the hips
    foot_mass_kg: float  # m3, at each foot
    hip_mass_kg: float  # m4, at each hip
    thigh_m: float  # d1, hip to knee
    shank_m: float  # d2, knee to ankle
    hip_distance_m: float  # w, between the hips
    foot_com_height_m: float  # L, from the ankle up the shank to the foot's mass
    waist_length_m: float  # Bx
    waist_width_m: float  # By
    foot_back_m: float  # Fx1, from the ankle to the rear edge of the sole
    foot_front_m: float  # Fx2, from the ankle to the front edge
    foot_width_m: float  # Fy; the ankle is in the middle

    def __post_init__(self) -> None:
        numbers = [field.name for field in fields(self) if field.name.endswith(("_kg", "_m"))]
        check_numbers(f"robot {self.name!r}", self, positive=numbers)

    @property
    def leg_m(self) -> float:
        """Length of a stretched leg, d1 + d2."""
        return self.thigh_m + self.shank_m


@cache
def load_point_mass_biped(path: str = "") -> PointMassBiped:
    """Read a robot from a JSON file with the fields of ``PointMassBiped``, by default the paper's; raises RobotDataError."""
    return read_dataclass(PointMassBiped, Path(path or str(DEFAULT_FILE)), "robot file", error=RobotDataError)
