"""How much is computed."""

from __future__ import annotations

from dataclasses import dataclass

from compare.papers.nao_walk.nao_walk_sources import SPEED_M_S


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much is computed.

    Attributes:
        starts: of IPOPT, where no neighbour helps.
        speeds_m_s: of the curve, the default speed among them.
        torsos_m: heights of the robot's own walk.
        heats: K for the question of straighter knees [W/(Nm)^2].
        stiffnesses: of the servos, as a share of the full one, which comes first.
        steps_m: lengths of a step that are tried for the fastest walk, rising.
        walked: steps that are played.
        disturbed: whether the walk is disturbed too.
    """

    starts: int = 2
    speeds_m_s: tuple[float, ...] = (0.03, 0.06, 0.08, SPEED_M_S, 0.12, 0.15)
    torsos_m: tuple[float, ...] = (0.28, 0.30, 0.31, 0.315, 0.32, 0.325, 0.33)
    heats: tuple[float, ...] = (0.025, 0.1, 0.5)
    stiffnesses: tuple[float, ...] = (1.0, 0.7, 0.5)
    steps_m: tuple[float, ...] = (0.04, 0.06, 0.08)
    walked: int = 6
    disturbed: bool = True

    @property
    def steps(self) -> int:
        """Calls of progress: curves, heights, heat constants and the data sheet's, four gaits, servos twice, the report."""
        return 2 + 1 + len(self.heats) + 1 + 4 + 2 * len(self.stiffnesses) + 1
