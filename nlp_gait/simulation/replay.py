"""Simulations to look at: a skeleton for pages, and pictures by MuJoCo's renderer."""

import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from nlp_gait.errors import OutputError
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import TRUNK, Limb, Skeleton, Sole, Tread
from nlp_gait.interrupts import delay_interrupts
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.mjcf import TIME_STEP, find_sides, make_plan_shapes
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.shapes import Capsule
from nlp_gait.simulation.simulate import LEAST_LOAD, Simulation
from nlp_gait.simulation.video import Frame

FRAMES_PER_S = 25.0
SIZE = (960, 540)  # of pictures [pixels]
PRESSURE_WINDOW_S = 0.02  # over which the centre of pressure is averaged
ROUNDING = 1e-9  # [s]
AZIMUTH, ELEVATION = 125.0, -12.0  # of the camera [degrees]
SEEN = 1.5  # height that the camera shows, in heights of the robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """A simulation with the engine's coordinates at the times of pictures."""

    plan: Plan
    simulation: Simulation
    model: Any  #: of the engine
    steps: np.ndarray[tuple[int], np.dtype[np.intp]]  #: (F,) numbers of the engine's steps
    states: Array  #: (F, Q) coordinates


def record_states(plan: Plan, simulate: Callable[..., Simulation]) -> Recording:
    """Record ``FRAMES_PER_S`` states for each second of a simulation; ``simulate`` has the argument ``on_step``."""
    models: list[Any] = []
    states: list[Array] = []
    steps: list[int] = []
    count = 0

    def keep(model: Any, data: Any) -> None:
        nonlocal count
        if count * TIME_STEP >= len(steps) / FRAMES_PER_S - ROUNDING:
            models[:] = [model]
            states.append(data.qpos.copy())
            steps.append(count)
        count += 1

    simulation = simulate(on_step=keep)
    return Recording(
        plan=plan, simulation=simulation, model=models[0], steps=np.array(steps, dtype=np.intp), states=np.array(states)
    )


def make_skeleton(recording: Recording, sole: str, title: str) -> Skeleton:
    """Return the simulated robot as a drawing, with its centre of mass and the measured centre of pressure."""
    engine, plan, model, steps = load_mujoco(), recording.plan, recording.model, recording.steps
    data = engine.MjData(model)
    places, turns, com = [], [], []
    for state in recording.states:
        data.qpos[:] = state
        engine.mj_kinematics(model, data)
        engine.mj_comPos(model, data)
        places.append(data.xpos.copy())
        turns.append(data.xmat.reshape(-1, 3, 3).copy())
        com.append(data.subtree_com[model.body(plan.robot.root).id].copy())
    x, rotation = np.array(places), np.array(turns)
    sides, limbs, soles = find_sides(plan.robot), list[Limb](), list[Sole]()
    loaded = recording.simulation.loads[steps] > LEAST_LOAD
    for link, shapes in make_plan_shapes(plan, sole).items():
        body, side = model.body(link).id, sides.get(link, TRUNK)
        for shape in shapes:
            if isinstance(shape, Capsule):
                corners = np.array([shape.start, shape.end])
            else:
                corners = np.array([(*corner, shape.bottom) for corner in shape.outline])
            points = x[:, body, None] + np.einsum("tij,kj->tki", rotation[:, body], corners)
            if isinstance(shape, Capsule):
                limbs.append(Limb(side=side, points=points))
            else:
                soles.append(Sole(side=side, corners=points, supports=loaded[:, SIDES.index(side)]))
    pressure = _hold_last(average_pressure(recording.simulation, PRESSURE_WINDOW_S)[steps])
    everything = np.concatenate([limb.points for limb in limbs], axis=1)[..., 0]
    return Skeleton(
        t=recording.simulation.t[steps],
        limbs=tuple(limbs),
        soles=tuple(soles),
        ground=_outline_ground(plan.ground, float(everything.min()), float(everything.max())),
        com=np.array(com),
        zmp=np.column_stack([pressure, plan.level(pressure[:, 0])]),
        planar=plan.planar,
        title=title,
    )


def _hold_last(values: Array) -> Array:
    """Return rows where unknown ones (NaN, in flight) repeat the last known one, or the first."""
    measured = np.isfinite(values[:, 0])
    if not measured.any():
        return np.zeros_like(values)
    last = np.maximum.accumulate(np.where(measured, np.arange(len(values)), 0))
    return np.where(measured[last, None], values[last], values[np.argmax(measured)])


def _outline_ground(treads: tuple[Tread, ...], first: float, last: float) -> Array:
    """Return the line (x, z) of floor and stairs from the side [m]."""
    heights = [0.0, *(tread.height_m for tread in treads)]
    edges = [first, *(tread.edge_m for tread in treads), max([last, *(tread.edge_m for tread in treads)])]
    corners = [(x, z) for (start, end), z in zip(pairwise(edges), heights, strict=True) for x in (start, end)]
    return np.array(corners)


def draw_pictures(recording: Recording) -> Iterator[Frame]:
    """Yield pictures of a recording; raises OutputError if there is no OpenGL to draw with."""
    engine, model, (width, height) = load_mujoco(pictures=True), recording.model, SIZE
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the error below has the reason
            renderer = engine.Renderer(model, height, width)
    except Exception as error:  # any error of the graphics driver
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise OutputError(
            f"a video needs OpenGL ({reason}); set MUJOCO_GL=egl or osmesa if installed, or write a page by --page FILE.html"
        ) from error
    data, camera, torso = engine.MjData(model), engine.MjvCamera(), model.body(recording.plan.robot.root).id
    camera.azimuth, camera.elevation = AZIMUTH, ELEVATION
    with closing(renderer):
        for k, state in enumerate(recording.states):
            with delay_interrupts():  # an interrupt inside the graphics driver would break it
                data.qpos[:] = state
                engine.mj_forward(model, data)
                if k == 0:
                    moving = model.geom_bodyid > 0
                    tall = float((data.geom_xpos[moving, 2] + model.geom_rbound[moving]).max())
                    sight = math.tan(math.radians(float(model.vis.global_.fovy)) / 2)
                    camera.distance = SEEN * tall / (2 * sight)
                    down = data.xpos[torso, 2] - 0.45 * tall
                camera.lookat[:] = data.xpos[torso] - (0.0, 0.0, down)
                renderer.update_scene(data, camera)
                picture: Frame = renderer.render()
            yield picture
