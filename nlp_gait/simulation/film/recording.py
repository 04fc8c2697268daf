"""What a film needs of a playback: the robot's state at every picture, and the numbers drawn beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.ndimage import uniform_filter1d

from nlp_gait.formulation import Array
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.simulate import OnStep, Simulation

# Averaged over [s]: what is shown would else flicker with every set-point.
POWER_WINDOW, PRESSURE_WINDOW, SPEED_WINDOW, PATH_WINDOW = 0.1, 0.02, 0.4, 2.0

ROUNDING = 1e-9  # [s]
HELD = 1.0  # [s] of the simulation for which a film stands still on a fall


class Player(Protocol):
    """Something that plays one gait."""

    def __call__(self, *, on_step: OnStep | None = None) -> Simulation:
        """Play it, and let the on_stepr see every step."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """A playback at the instants of a film's pictures; the first axis of arrays is time.

    Attributes:
        title: one line.
        model: the engine's.
        trace: of the playback.
        t: (F,) [s]; after a fall its time, again and again.
        states: (F, ...) the engine's positions.
        power: (F,) of the servos, mechanical and heat [W].
        speed: (F,) of the torso, forward [m/s].
        path: (F, 3) of the torso without its sway [m].
        stand: (F, 2) halfway between the feet, likewise [m].
        pressure: (F, 2) centre of pressure [m]; NaN in flight.
        planned: (F, 2) planned zero-moment point [m].
        load: (F,) force of the floor [N].
    """

    title: str
    model: Any
    trace: Simulation
    t: Array
    states: Array
    power: Array
    speed: Array
    path: Array
    stand: Array
    pressure: Array
    planned: Array
    load: Array


def record_film(title: str, plan: Plan, player: Player, interval_s: float) -> Recording:
    """Play a gait and keep what a film needs.

    Args:
        title: one line.
        plan: of the gait.
        player: plays it.
        interval_s: of the simulation, from one picture to the next.
    """
    models: list[Any] = []
    states: list[Array] = []
    indexes: list[int] = []
    count = 0

    def keep(model: Any, data: Any) -> None:
        nonlocal count
        if count * TIME_STEP >= len(indexes) * interval_s - ROUNDING:
            models[:] = [model]
            states.append(data.qpos.copy())
            indexes.append(count)
        count += 1

    trace = player(on_step=keep)
    if trace.fell_at_s is not None:
        held = max(1, round(HELD / interval_s))
        indexes += [len(trace.t) - 1] * held
        states += [states[-1]] * held
    at = np.minimum(indexes, len(trace.t) - 1)
    power = np.abs(trace.torque * trace.qd).sum(axis=1) + plan.heat_loss * (trace.torque**2).sum(axis=1)
    torso = trace.torso
    ahead, behind = (np.clip(at + sign * _steps(SPEED_WINDOW) // 2, 0, len(trace.t) - 1) for sign in (1, -1))
    return Recording(
        title=title,
        model=models[0],
        trace=trace,
        t=trace.t[at],
        states=np.array(states),
        power=_smooth(power, POWER_WINDOW)[at],
        speed=(torso[ahead, 0] - torso[behind, 0]) / np.maximum((ahead - behind) * TIME_STEP, TIME_STEP),
        path=_smooth(torso, PATH_WINDOW)[at],
        stand=_smooth(trace.feet.mean(axis=1)[:, :2], PATH_WINDOW)[at],
        pressure=average_pressure(trace, PRESSURE_WINDOW)[at],
        planned=plan.at("zmp", trace.t[at]),
        load=_smooth(trace.loads.sum(axis=1), PRESSURE_WINDOW)[at],
    )


def _steps(window_s: float) -> int:
    return max(1, round(window_s / TIME_STEP))


def _smooth(values: Array, window_s: float) -> Array:
    """Moving mean along time."""
    return np.asarray(uniform_filter1d(values, _steps(window_s), axis=0, mode="nearest"))
