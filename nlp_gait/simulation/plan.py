"""Planned motion and torques of a gait as functions of time."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, Signals, sample_finely
from nlp_gait.formulation.display import Tread
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.gaits.several_steps import repeat_steps
from nlp_gait.robots import Robot

SIDES = ("left", "right")
ON_GROUND = 1e-6  # [m]; above the rounding of splines
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
AT_REST = 1e-3  # largest rate of a joint that stands still [rad/s]
STANDING = 1e-9  # [m]; a sole that moves less is a support
MOST_STEPS, LONGEST_S = 1000, 300.0  # of a walk: all measurements at every engine's step of 0.5 ms are in memory


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A gait to simulate."""

    robot: Robot  #: of the simulation model: links that never move are welded
    full_robot: Robot  #: with all joints, for its shapes
    signals: Signals  #: planned time histories on a dense grid
    heat_loss: float  #: K [W/(Nm)^2]
    gravity: float  #: magnitude [m/s^2]
    slope_rad: float = 0.0  #: by which the floor rises forward; all places are in its axes
    ground: tuple[Tread, ...] = ()  #: stairs on the floor, which is at z = 0
    steps: int | None = None  #: that the motion has; None for one phase or one cycle
    planar: bool = False  #: the robot's root stays in the plane y = 0

    @property
    def joints(self) -> tuple[str, ...]:
        """Driven joints."""
        return self.signals.joints

    @property
    def root_axes(self) -> list[int]:
        """Directions in which the root moves, of x, y, z and rotations about them."""
        return [0, 2, 4] if self.planar else list(range(6))

    @property
    def duration_s(self) -> float:
        """Duration of the motion."""
        return float(self.signals.arrays["t"][-1])

    @property
    def from_rest_to_rest(self) -> bool:
        """Whether it is a walk that begins and ends at rest."""
        rates = self.rate("q", np.array([0.0, self.duration_s]))
        return self.steps is not None and bool(np.abs(rates).max() < AT_REST)

    @cached_property
    def supports(self) -> tuple[str, ...]:
        """Sides whose sole never moves."""
        return tuple(side for side in SIDES if np.ptp(self.signals.arrays[f"{side}_foot"], axis=0).max() < STANDING)

    def stands(self, side: str, times: Array) -> Array:
        """Return 1 where a sole is planned to stand flat on the ground, else 0."""
        foot = self.at(f"{side}_foot", times)
        return np.asarray(foot[:, 2] - self.level(foot[:, 0]) < ON_GROUND, dtype=float)

    def bears(self, side: str, times: Array) -> Array:
        """Return 1 where any part of a foot is planned to be on the ground, else 0."""
        name = f"{side}_bears"
        if name not in self.signals.arrays:
            return self.stands(side, times)
        return np.round(self.at(name, times)[:, 0])

    def level(self, x: Array) -> Array:
        """Return the height (N,) of the ground at places along x [m]."""
        heights = np.array([0.0, *(tread.height_m for tread in self.ground)])
        return heights[np.searchsorted([tread.edge_m for tread in self.ground], x, side="right")]

    def attitude(self, times: Array) -> Array:
        """Return the planned attitude (T, 4) of the root, a unit quaternion (w, x, y, z): that of the nearest sample."""
        samples = self.signals.arrays
        if "attitude" not in samples:
            return np.tile(UPRIGHT, (len(times), 1))
        t = samples["t"]
        nearest = np.searchsorted((t[1:] + t[:-1]) / 2, np.clip(times, 0.0, self.duration_s))
        return np.asarray(samples["attitude"][nearest])

    def torso_axis(self, times: Array) -> Array:
        """Return the planned direction (T, 3) of the root's upright axis."""
        w, x, y, z = self.attitude(times).T
        return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)

    def heading(self, times: Array) -> Array:
        """Return the planned direction (T,) of the root's forward axis, positive to the left, continuous over time [rad]."""
        w, x, y, z = self.attitude(times).T
        return np.asarray(np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))

    def direction(self, foot: int, times: Array) -> Array:
        """Return the planned direction (T, 2) of a sole by its number in ``SIDES``, its cosine and sine."""
        samples = self.signals.arrays
        yaw = np.interp(times, samples["t"], samples["feet_yaw"][:, foot]) if "feet_yaw" in samples else 0.0 * times
        return np.stack([np.cos(yaw), np.sin(yaw)], axis=1)

    @property
    def spin_at_start(self) -> Array:
        """(3,) planned angular velocity of the root at time zero, in its own axes [rad/s]."""
        samples = self.signals.arrays
        if "attitude" not in samples:
            return np.zeros(3)
        first = samples["attitude"][:3]
        (w, *vector), rate = first[0], np.gradient(first, samples["t"][:3], axis=0, edge_order=2)[0]
        return np.asarray(2 * (w * rate[1:] - rate[0] * np.array(vector) - np.cross(vector, rate[1:])))

    @cached_property
    def _splines(self) -> dict[str, Any]:
        from scipy.interpolate import CubicSpline  # takes as long to import as all else that a command needs

        arrays = self.signals.arrays
        names = ("q", "zmp", "hip", *(f"{side}_foot" for side in SIDES))
        return {name: CubicSpline(arrays["t"], arrays[name]) for name in names}

    def at(self, name: str, times: Array) -> Array:
        """Return planned values at any times (T,) [s]: after the end, positions and torques stay, and rates are zero.

        Names are ``q`` [rad], ``qd`` [rad/s], ``tau`` [Nm], ``zmp``, ``hip``, ``left_foot`` and ``right_foot`` [m];
        ``q_desired`` and ``qd_desired`` are what a controller follows, if that is not the motion itself.
        """
        if name not in self.signals.arrays:
            name = name.removesuffix("_desired")
        within = np.clip(times, 0.0, self.duration_s)
        if name in self._splines:
            return np.asarray(self._splines[name](within))
        samples = self.signals.arrays
        if name == "qd":
            return self.rate("q", times)
        # Torques jump where a foot lands or lifts, so a spline would overshoot.
        columns = [np.interp(within, samples["t"], column) for column in samples[name].T]
        values = np.stack(columns, axis=1)
        return values * (times <= self.duration_s)[:, None] if name == "qd_desired" else values

    def rate(self, name: str, times: Array) -> Array:
        """Return planned rates of ``q``, ``zmp``, ``hip`` or a foot at any times (T,): zero after the end."""
        within = np.clip(times, 0.0, self.duration_s)
        return np.asarray(self._splines[name](within, 1) * (times <= self.duration_s)[:, None])


@lock_casadi
def make_plan(result: Result, steps: int | None = None) -> Plan:
    """Return the plan of a solved problem: of several consecutive steps, or by default of one phase or one cycle.

    Raises InputError for a problem without simulation model, a gait that cannot be repeated or has samples that are not finite,
    or too many steps.
    """
    problem = result.problem
    model = problem.display.simulation_model
    if model is None:
        raise InputError(f"problem {problem.name!r} cannot be simulated: it has no simulation model")
    if steps is not None and not model.repeats:
        raise InputError(f"problem {problem.name!r} is not a cycle that can be repeated; leave out the number of steps")
    if steps is not None and steps > MOST_STEPS:
        raise InputError(f"at most {MOST_STEPS} steps are simulated, got {steps}; use fewer")
    point = problem.at(result.x)
    if model.motion is not None:
        signals = model.motion(point)
    else:
        signals = sample_finely(result)
        signals = signals if steps is None else repeat_steps(signals, model.robot, steps)
    if not all(np.isfinite(array).all() for array in signals.arrays.values()):
        raise InputError(f"the gait of {problem.name!r} has samples that are not finite and cannot be simulated")
    if (duration := float(signals.arrays["t"][-1])) > LONGEST_S:
        raise InputError(
            f"{steps} steps of this gait last {duration:g} s, and at most {LONGEST_S:g} s are simulated; use fewer"
        )
    return Plan(
        robot=model.robot,
        full_robot=problem.display.robot or model.robot,
        signals=signals,
        heat_loss=0.0 if model.heat_loss is None else problem.value(model.heat_loss),
        gravity=model.gravity,
        slope_rad=model.slope_rad,
        ground=() if model.ground is None else model.ground(point),
        steps=steps or model.steps,
        planar=model.planar,
    )
