"""Options of commands that simulate: drive, conditions and film."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from compare.cli.options import parse_number
from nlp_gait.errors import InputError, unknown

if TYPE_CHECKING:
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.simulate import Conditions


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """The drive of the simulated robot, by name, and its settings."""

    drive: str = "feed-forward"
    period_ms: float | None = None
    interpolation: str | None = None
    feed_forward: str | None = None
    torque_limits: str | None = None
    feedback: str = "none"
    feedback_delay_ms: float | None = None
    feedback_noise: float = 1.0
    feedback_seed: int = 0

    def make(self) -> Drive:
        """Return the drive; raises UnknownNameError, and InputError for a setting that is not allowed."""
        from nlp_gait.simulation.drive import DRIVES, FEEDBACKS

        for kind, name, known in (("drive", self.drive, DRIVES), ("feedback", self.feedback, FEEDBACKS)):
            if name not in known:
                raise unknown(kind, name, known)
        feedback = FEEDBACKS[self.feedback]
        if feedback is not None:
            delay_s = feedback.delay_s if self.feedback_delay_ms is None else self.feedback_delay_ms / 1000.0
            feedback = replace(feedback.with_noise(self.feedback_noise), delay_s=delay_s, seed=self.feedback_seed)
        period_s = None if self.period_ms is None else self.period_ms / 1000.0
        names = ("interpolation", "feed_forward", "torque_limits")
        settings = {"period_s": period_s, **{name: getattr(self, name) for name in names}}
        settings = {name: value for name, value in settings.items() if value is not None}
        return replace(DRIVES[self.drive], feedback=feedback, **settings)


@dataclass(frozen=True, kw_only=True)
class ConditionOptions:
    """Differences of the simulated world and robot from the planned ones."""

    friction: float | None = None
    slope_deg: str = "0,0"
    mass_factor: float = 1.0
    stiffness_factor: float = 1.0
    push: str = "0,0"

    def make(self) -> Conditions:
        """Return the conditions; raises InputError for a value that is not allowed."""
        from nlp_gait.simulation.simulate import Conditions, Push

        slope, impulse = (
            _parse_pair(text, flag) for text, flag in ((self.slope_deg, "--slope-deg"), (self.push, "--push"))
        )
        conditions = Conditions(
            mass_factor=self.mass_factor,
            stiffness_factor=self.stiffness_factor,
            slope_rad=(math.radians(slope[0]), math.radians(slope[1])),
            push=Push(impulse_Ns=impulse) if any(impulse) else None,
        )
        return conditions if self.friction is None else replace(conditions, friction=self.friction)


@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """A film of a simulated gait, and how it is made."""

    video: Path | None = None
    beside: Path | None = None
    size: str = "1280x720"
    speed: float = 1.0
    frames_per_s: float = 25.0

    @property
    def note(self) -> str:
        """The film's caption of its speed."""
        if self.speed == 1.0:
            return ""
        return f"{'slow motion' if self.speed < 1.0 else 'fast'}: {self.speed:g} x real time"


def _parse_pair(text: str, flag: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(f"{flag} takes two numbers X,Y, got {text!r}")
    return parse_number("X", parts[0], flag), parse_number("Y", parts[1], flag)
