"""All results behind the claims, and what verdicts, tables and figures read from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.papers.nao_walk.nao_walk_runs import KINDS, total
from compare.papers.nao_walk.nao_walk_sources import SPEED_M_S

Point = Mapping[str, Any]
KNEE = "KneePitch"
SAGITTAL = (KNEE, "HipPitch", "AnklePitch")  # kinds of joints that turn in the plane of the walk


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """Results of all runs.

    Attributes:
        speeds: by heat constant, the cheapest gaits in the order of their speeds.
        torsos: the robot's own walk in the order of its heights.
        straighter: by heat constant, cheapest gaits at the default speed.
        joints: by gait, what its joints draw.
        servos: by feed-forward, the robot's own walk from full stiffness downwards.
        stiffnesses: of ``servos``.
    """

    speeds: Mapping[str, Sequence[Point]]
    torsos: Sequence[Point]
    straighter: Mapping[str, Point]
    joints: Mapping[str, Point]
    servos: Mapping[str, Sequence[Point]]
    stiffnesses: tuple[float, ...]

    def curve(self, heat: str) -> list[Point]:
        """Feasible gaits over speed."""
        return [point for point in self.speeds[heat] if point["feasible"]]

    def cheapest(self, heat: str) -> Point:
        """The one of least cost of transport."""
        return min(self.curve(heat), key=lambda point: float(point["cost_of_transport"]))

    def at_default(self, heat: str) -> Point:
        """The one at the default speed."""
        return next(point for point in self.curve(heat) if point["speed_m_s"] == SPEED_M_S)

    def share(self, gait: str, where: str, heat: str, kind: str = KNEE) -> float:
        """Share of a kind of joint in mechanical energy and heat; ``where`` is ``model`` or ``engine``."""
        kinds = self.joints[gait][where]
        return float((kinds[kind]["mechanical"] + kinds[kind][heat]) / total(kinds.values(), heat))

    def largest(self, gait: str, where: str, heat: str, kinds: Iterable[str] = KINDS) -> str:
        """Kind of joint that draws most."""
        return max(kinds, key=lambda kind: self.share(gait, where, heat, kind))

    def engine_J_per_m(self, gait: str, heat: str) -> float | None:
        """Energy in the engine for each metre walked [J/m]; None after a fall."""
        found = self.joints[gait]
        return None if found["fell_at_s"] is not None else total(found["engine"].values(), heat)
