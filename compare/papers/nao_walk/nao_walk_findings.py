"""Findings about NAO's walk: all results, and what claims, tables and figures read from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.papers.nao_walk.nao_walk_runs import KINDS, NaoWalkEffort, sum_energy
from compare.papers.nao_walk.nao_walk_sources import SPEED_M_S

Point = Mapping[str, Any]
KNEE = "KneePitch"
SAGITTAL = (KNEE, "HipPitch", "AnklePitch")  # kinds of joints that turn in the plane of the walk


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoWalkFindings:
    """All results."""

    effort: NaoWalkEffort  # what was computed
    # Cheapest gaits in the order of their speeds, by source of the heat constant.
    speeds: Mapping[str, Sequence[Point]]
    torsos: Sequence[Point]  # the robot's own walk in the order of its heights
    straighter: Mapping[str, Point]  # by heat constant, cheapest gaits at the default speed
    joints: Mapping[str, Point]  # by gait, energy of its joints
    drives: Mapping[str, Sequence[Point]]  # by feed-forward, the robot's own walk from full stiffness downwards

    def curve(self, heat: str) -> list[Point]:
        """Return the feasible gaits over speed."""
        return [point for point in self.speeds[heat] if point["feasible"]]

    def cheapest(self, heat: str) -> Point:
        """Return the gait of least cost of transport."""
        return min(self.curve(heat), key=lambda point: float(point["cost_of_transport"]))

    def at_default(self, heat: str) -> Point:
        """Return the gait at the default speed."""
        return next(point for point in self.curve(heat) if point["speed_m_s"] == SPEED_M_S)

    def share(self, gait: str, where: str, heat: str, kind: str = KNEE) -> float:
        """Return the share of a kind of joint in mechanical energy and heat; ``where`` is ``model`` or ``engine``."""
        kinds = self.joints[gait][where]
        return float((kinds[kind]["mechanical"] + kinds[kind][heat]) / sum_energy(kinds.values(), heat))

    def largest(self, gait: str, where: str, heat: str, kinds: Iterable[str] = KINDS) -> str:
        """Return the kind of joint that draws most."""
        return max(kinds, key=lambda kind: self.share(gait, where, heat, kind))

    def engine_J_per_m(self, gait: str, heat: str) -> float | None:
        """Return the energy in the engine per metre walked [J/m]; None after a fall."""
        found = self.joints[gait]
        return None if found["fell_at_s"] is not None else sum_energy(found["engine"].values(), heat)
