"""The biped with toes that climbs stairs: nine slender rods in the sagittal plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from nlp_gait.decoding import read_dataclass
from nlp_gait.errors import RobotDataError
from nlp_gait.gaits.stairs.planar_biped import LINKS, Rod
from nlp_gait.robots.robot import check_numbers

DEFAULT_FILE = resources.files("nlp_gait.gaits.stairs") / "biped.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanarLink:
    """Slender rod."""

    name: str  # its two ends, for example ``"HK"``
    length_m: float  # between the ends
    mass_kg: float  # uniformly distributed

    def __post_init__(self) -> None:
        check_numbers(f"link {self.name!r}", self, positive=("length_m", "mass_kg"))


@dataclass(frozen=True, slots=True, kw_only=True)
class ToeFootBiped:
    """Two legs of thigh, shank, sole and toe, and a torso.

    Source:
        Bhardwaj, Mishra, Sukavanam, Balasubramanian, Table I. The paper gives no moments of inertia: m l^2 / 12.
    """

    name: str  # of the robot
    source: str  # of the numbers
    inertia: str  # formula of the moments of inertia
    links: tuple[PlanarLink, ...]  # in the order of ``planar_biped.LINKS``; both legs are equal

    def __post_init__(self) -> None:
        names = tuple(link.name for link in self.links)
        if names != LINKS:
            raise RobotDataError(f"robot {self.name!r}: links must be {', '.join(LINKS)}, got {', '.join(names)}")
        for swing, stance in (("HK", "HK'"), ("KA", "K'A'"), ("AS", "A'S'"), ("ST", "S'T'")):
            a, b = self.link(swing), self.link(stance)
            if (a.length_m, a.mass_kg) != (b.length_m, b.mass_kg):
                raise RobotDataError(f"robot {self.name!r}: links {swing} and {stance} must be equal")

    def link(self, name: str) -> PlanarLink:
        return self.links[LINKS.index(name)]

    @property
    def mass_kg(self) -> float:
        return math.fsum(link.mass_kg for link in self.links)

    @property
    def sole_m(self) -> float:
        """Ankle to sole joint."""
        return self.link("AS").length_m

    @property
    def toe_m(self) -> float:
        """Sole joint to tip of the toe."""
        return self.link("ST").length_m

    @property
    def foot_m(self) -> float:
        """Ankle to tip of the toe, flat."""
        return self.sole_m + self.toe_m

    @property
    def rods(self) -> dict[str, Rod]:
        """Lengths, masses and inertias for the symbolic model."""
        return {
            link.name: Rod(link.length_m, link.mass_kg, link.mass_kg * link.length_m**2 / 12) for link in self.links
        }


@cache
def toe_foot_biped(path: str = "") -> ToeFootBiped:
    """Read a robot from a JSON file with the fields of ``ToeFootBiped``; by default the paper's.

    Raises:
        RobotDataError: the file cannot be read, or does not describe such a robot.
    """
    return read_dataclass(ToeFootBiped, Path(path or str(DEFAULT_FILE)), "robot file", error=RobotDataError)
