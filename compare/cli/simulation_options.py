"""Options of commands that simulate: drive, conditions and film."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.cli.options import parse_number
from nlp_gait.errors import InputError, unknown

if TYPE_CHECKING:
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.simulate import Conditions


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """The drive of the simulated robot, by name, and its settings."""

    drive: Annotated[
        str,
        typer.Option(
            help="feed-forward: set-points every 10 ms, linear between them, planned velocity and torque fed forward. "
            "held: each held for 40 ms, nothing fed forward."
        ),
    ] = "feed-forward"
    period_ms: Annotated[float | None, typer.Option(help="Time between set-points (default: the drive's).")] = None
    interpolation: Annotated[str | None, typer.Option(help="Between set-points: linear or held.")] = None
    feed_forward: Annotated[str | None, typer.Option(help="torque (and velocity), velocity, or none.")] = None
    torque_limits: Annotated[
        str | None, typer.Option(help="urdf (default), stall or continuous: published limits differ.")
    ] = None
    feedback: Annotated[
        str,
        typer.Option(help="none, in open loop, or torso-spring: balance by measured place and attitude of the torso."),
    ] = "none"
    feedback_delay_ms: Annotated[
        float | None, typer.Option(help="From measuring to acting (default: the feedback's).")
    ] = None
    feedback_noise: Annotated[float, typer.Option(help="Factor on the noise of its sensors; 0 for none.")] = 1.0
    feedback_seed: Annotated[int, typer.Option(min=0, help="Of this noise: same seed, same walk.")] = 0

    def make(self) -> Drive:
        """Return the drive; raises UnknownNameError, and InputError for a setting that is not allowed."""
        from nlp_gait.simulation.drive import DRIVES
        from nlp_gait.simulation.feedback import FEEDBACKS

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

    friction: Annotated[float | None, typer.Option(help="Coefficient of sliding friction (default: 0.7).")] = None
    slope_deg: Annotated[str, typer.Option(metavar="X,Y", help="Rise of the floor forward and to the left.")] = "0,0"
    mass_factor: Annotated[float, typer.Option(help="On all masses; the gait was planned for 1.")] = 1.0
    stiffness_factor: Annotated[
        float, typer.Option(help="True stiffness of the joints over what their drive assumes.")
    ] = 1.0
    push: Annotated[
        str, typer.Option(metavar="X,Y", help="Impulse on the torso in the middle, forward and to the left [N s].")
    ] = "0,0"

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

    video: Annotated[
        Path | None, typer.Option(help="Film it to this .gif or .mp4 file, from the side, the front and above.")
    ] = None
    beside: Annotated[
        Path | None,
        typer.Option(metavar="OTHER.json", help="Simulate this gait as well, next to the other in the film."),
    ] = None
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Of the film [pixels].")] = "1280x720"
    speed: Annotated[float, typer.Option(min=0.05, max=20.0, help="Speed of the film; 0.25 is slow motion.")] = 1.0
    frames_per_s: Annotated[float, typer.Option("--fps", min=0.1, max=50.0, help="Frames a second of the film.")] = 25.0

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
