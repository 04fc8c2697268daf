"""Simulations recorded for films, the robot's state and the numbers at every picture, or shown in MuJoCo's own window."""

import time
import warnings
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.ndimage import uniform_filter1d

from nlp_gait.errors import MissingExtraError, OutputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.simulate import OnStep, Simulation

# Averaging times [s]: without them the numbers flicker with every set-point.
POWER_WINDOW, PRESSURE_WINDOW, SPEED_WINDOW, PATH_WINDOW = 0.1, 0.02, 0.4, 2.0

ROUNDING = 1e-9  # [s]
HOLD_FALL = 1.0  # [s] of simulated time for which a film shows the robot after a fall


class Simulator(Protocol):
    """Function that simulates one gait."""

    def __call__(self, *, on_step: OnStep | None = None) -> Simulation:
        """Simulate it; call ``on_step`` before every step."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """A simulation at the instants of a film's pictures; the first axis of arrays is time."""

    title: str
    model: Any  # of the engine
    simulation: Simulation
    t: Array  # (F,) [s]; after a fall constant
    states: Array  # (F, ...) positions in the engine
    power: Array  # (F,) of the drives, mechanical and heat [W]
    speed: Array  # (F,) of the torso, forward [m/s]
    path: Array  # (F, 3) of the torso without its sway [m]
    stand: Array  # (F, 2) halfway between the feet, without its sway [m]
    pressure: Array  # (F, 2) centre of pressure [m]; NaN in flight
    planned: Array  # (F, 2) planned zero-moment point [m]
    load: Array  # (F,) force of the floor [N]


def record_film(title: str, plan: Plan, simulate: Simulator, interval_s: float) -> Recording:
    """Simulate a gait and record the data of a film, with ``interval_s`` of simulated time between pictures."""
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

    simulation = simulate(on_step=keep)
    if simulation.fell_at_s is not None:
        held = max(1, round(HOLD_FALL / interval_s))
        indexes += [len(simulation.t) - 1] * held
        states += [states[-1]] * held
    at = np.minimum(indexes, len(simulation.t) - 1)
    power = np.abs(simulation.torque * simulation.qd).sum(axis=1) + plan.heat_loss * (simulation.torque**2).sum(axis=1)
    torso = simulation.torso
    ahead, behind = (np.clip(at + sign * _count_steps(SPEED_WINDOW) // 2, 0, len(simulation.t) - 1) for sign in (1, -1))
    return Recording(
        title=title,
        model=models[0],
        simulation=simulation,
        t=simulation.t[at],
        states=np.array(states),
        power=_smooth(power, POWER_WINDOW)[at],
        speed=(torso[ahead, 0] - torso[behind, 0]) / np.maximum((ahead - behind) * TIME_STEP, TIME_STEP),
        path=_smooth(torso, PATH_WINDOW)[at],
        stand=_smooth(simulation.feet.mean(axis=1)[:, :2], PATH_WINDOW)[at],
        pressure=average_pressure(simulation, PRESSURE_WINDOW)[at],
        planned=plan.at("zmp", simulation.t[at]),
        load=_smooth(simulation.loads.sum(axis=1), PRESSURE_WINDOW)[at],
    )


def _count_steps(window_s: float) -> int:
    return max(1, round(window_s / TIME_STEP))


def _smooth(values: Array, window_s: float) -> Array:
    return np.asarray(uniform_filter1d(values, _count_steps(window_s), axis=0, mode="nearest"))


AZIMUTH, ELEVATION, DISTANCE, LOOK_AT = 125.0, -12.0, 1.6, (0.06, 0.0, 0.24)  # it follows the torso


def show_in_window(simulate: Simulator) -> Simulation:
    """Simulate a gait in real time in MuJoCo's window; raises OutputError without a display."""
    load_mujoco()
    _require_display()
    from mujoco import viewer

    window: Any = None
    began = 0.0

    def follow(model: Any, data: Any) -> None:
        nonlocal window, began
        if window is None:
            window, began = viewer.launch_passive(model, data), time.monotonic()
            window.cam.azimuth, window.cam.elevation, window.cam.distance = AZIMUTH, ELEVATION, DISTANCE
            window.cam.lookat[:] = LOOK_AT
        if window.is_running():  # if the user closes it, the simulation continues
            window.cam.lookat[0] = data.qpos[0]
            window.sync()
            time.sleep(max(0.0, data.time - (time.monotonic() - began)))

    try:
        return simulate(on_step=follow)
    finally:
        if window is not None:
            window.close()


def _require_display() -> None:
    """Raise OutputError without a display: MuJoCo's viewer would end the whole process."""
    try:
        import glfw
    except ImportError as error:
        raise MissingExtraError(f"a window needs glfw ({error}): pip install 'mujoco-core[rendering]'") from error

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        ready = glfw.init()
    if not ready:
        raise OutputError("cannot open a window: no display; use --video FILE.gif instead of --viewer")
