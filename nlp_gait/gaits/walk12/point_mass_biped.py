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

    Attributes:
        name: of the robot.
        description: one line.
        source: of the numbers.
        knee_mass_kg: m1, at each knee.
        waist_mass_kg: m2, in the middle between the hips.
        foot_mass_kg: m3, at each foot.
        hip_mass_kg: m4, at each hip.
        thigh_m: d1, hip to knee.
        shank_m: d2, knee to ankle.
        hip_distance_m: w, between the hips.
        foot_com_height_m: L, from the ankle up the shank to the foot's mass.
        waist_length_m: Bx.
        waist_width_m: By.
        foot_back_m: Fx1, from the ankle to the rear edge of the sole.
        foot_front_m: Fx2, from the ankle to the front edge.
        foot_width_m: Fy; the ankle is in the middle.

    Source:
        Goswami, Vadakkepat, Phung (2008), section 2.
    """

    name: str
    description: str
    source: str
    knee_mass_kg: float
    waist_mass_kg: float
    foot_mass_kg: float
    hip_mass_kg: float
    thigh_m: float
    shank_m: float
    hip_distance_m: float
    foot_com_height_m: float
    waist_length_m: float
    waist_width_m: float
    foot_back_m: float
    foot_front_m: float
    foot_width_m: float

    def __post_init__(self) -> None:
        """Check that every mass and every length is positive."""
        numbers = [field.name for field in fields(self) if field.name.endswith(("_kg", "_m"))]
        check_numbers(f"robot {self.name!r}", self, positive=numbers)

    @property
    def leg_m(self) -> float:
        """Length of a stretched leg, d1 + d2."""
        return self.thigh_m + self.shank_m


@cache
def load_point_mass_biped(path: str = "") -> PointMassBiped:
    """Read a robot from a JSON file with the fields of ``PointMassBiped``; by default the paper's.

    Raises:
        RobotDataError: the file cannot be read, has a missing or an unknown field, or a value is not allowed.
    """
    return read_dataclass(PointMassBiped, Path(path or str(DEFAULT_FILE)), "robot file", error=RobotDataError)
