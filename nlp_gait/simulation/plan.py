"""The planned motion of a NAO gait as functions of time, and what the model predicts for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from nlp_gait.errors import InputError
from nlp_gait.problem import Array, Result, Signals, finely_sampled
from nlp_gait.robots import Robot
from nlp_gait.simulation.shapes import Shape, link_shapes
from nlp_gait.simulation.steps import walk

SIDES = ("left", "right")
ON_GROUND = 1e-6  # [m]; above the rounding of splines
STANDING = 1e-9  # [m]; a sole that moves less is a support


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A gait to be played.

    Attributes:
        robot: as the model takes it, head and neck one with the torso.
        full_robot: with all joints, for its shapes.
        signals: planned time histories on a dense grid.
        heat_loss: K [W/(Nm)^2].
        gravity: [m/s^2].
    """

    robot: Robot
    full_robot: Robot
    signals: Signals
    heat_loss: float
    gravity: float

    @property
    def joints(self) -> tuple[str, ...]:
        """Those that are driven."""
        return self.signals.joints

    @property
    def duration_s(self) -> float:
        """Of the phase."""
        return float(self.signals.arrays["t"][-1])

    @cached_property
    def supports(self) -> tuple[str, ...]:
        """Sides whose sole stands still throughout."""
        return tuple(side for side in SIDES if np.ptp(self.signals.arrays[f"{side}_foot"], axis=0).max() < STANDING)

    def stands(self, side: str, times: Array) -> Array:
        """1 where a sole is planned to stand on the ground, else 0."""
        return np.asarray(self.at(f"{side}_foot", times)[:, 2] < ON_GROUND, dtype=float)

    @cached_property
    def _splines(self) -> dict[str, CubicSpline]:
        arrays = self.signals.arrays
        names = ("q", "zmp", "hip", *(f"{side}_foot" for side in SIDES))
        return {name: CubicSpline(arrays["t"], arrays[name]) for name in names}

    def at(self, name: str, times: Array) -> Array:
        """Planned values at any times: beyond the end positions and torques stay, and rates are zero.

        Args:
            name: ``q`` [rad], ``qd`` [rad/s], ``tau`` [Nm], ``zmp``, ``hip``, ``left_foot`` or ``right_foot`` [m].
            times: (T,) [s].
        """
        within = np.clip(times, 0.0, self.duration_s)
        if name in self._splines:
            return np.asarray(self._splines[name](within))
        samples = self.signals.arrays
        if name == "qd":
            return np.asarray(self._splines["q"](within, 1) * (times <= self.duration_s)[:, None])
        # Torques jump where a foot lands or lifts: no spline runs through them.
        columns = [np.interp(within, samples["t"], column) for column in samples[name].T]
        return np.stack(columns, axis=1)

    def rate_at_start(self, name: str) -> Array:
        """Planned velocity at time zero."""
        return np.asarray(self._splines[name](0.0, 1))

    def shapes(self, sole: str) -> dict[str, list[Shape]]:
        """Shapes of the simulated robot's links."""
        welded = [joint for joint in self.full_robot.joints if joint not in self.robot.joints]
        return link_shapes(self.full_robot, sole, welded=welded)


def plan_of(result: Result, steps: int | None = None) -> Plan:
    """Plan of a solved NAO problem.

    Args:
        result: of a phase or a cycle.
        steps: how often a cycle is played, every second time mirrored; once by default. A phase cannot be repeated.

    Raises:
        InputError: another problem, a gait so damaged that its angles are not finite, or several steps of a phase.
    """
    problem = result.problem
    playback, robot = problem.playback, problem.robot
    if playback is None or robot is None:
        raise InputError(f"problem {problem.name!r} cannot be simulated: only gaits of the NAO problems can")
    signals = finely_sampled(result)
    if not all(np.isfinite(array).all() for array in signals.arrays.values()):
        raise InputError(f"the gait of {problem.name!r} has samples that are not finite and cannot be played")
    if steps is not None:
        if not playback.repeats:
            raise InputError(
                f"problem {problem.name!r} is no cycle that can be repeated; several steps can be played of 'nao-cycle'"
            )
        signals = walk(signals, playback.robot, steps)
    return Plan(
        robot=playback.robot,
        full_robot=robot,
        signals=signals,
        heat_loss=problem.value(playback.heat_loss),
        gravity=playback.gravity,
    )
