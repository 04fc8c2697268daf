"""Simulations to look at: the robot as a skeleton."""

from itertools import pairwise
from typing import Any

import numpy as np

from nlp_gait.formulation import Array
from nlp_gait.formulation.display import TRUNK, Limb, Skeleton, Sole, Tread
from nlp_gait.simulation.engine import LEAST_LOAD, load_mujoco
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.mjcf import TIME_STEP, find_sides, make_plan_shapes
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.shapes import Capsule
from nlp_gait.simulation.simulate import Simulation

FRAMES_PER_S = 25.0
PRESSURE_WINDOW_S = 0.02  # over which the centre of pressure is averaged

Indices = np.ndarray[tuple[int], np.dtype[np.intp]]


def list_frames(simulation: Simulation) -> Indices:
    """Return the numbers (F,) of the engine's steps that are shown, ``FRAMES_PER_S`` each second."""
    return np.arange(0, len(simulation.t), round(1.0 / (FRAMES_PER_S * TIME_STEP)))


def make_skeleton(plan: Plan, simulation: Simulation, model: Any, title: str) -> Skeleton:
    """Return the simulated robot, by the engine's model, with its centre of mass and the measured centre of pressure."""
    engine, steps = load_mujoco(), list_frames(simulation)
    data = engine.MjData(model)
    places, turns, com = [], [], []
    for state in simulation.states[steps]:
        data.qpos[:] = state
        engine.mj_kinematics(model, data)
        engine.mj_comPos(model, data)
        places.append(data.xpos.copy())
        turns.append(data.xmat.reshape(-1, 3, 3).copy())
        com.append(data.subtree_com[model.body(plan.robot.root).id].copy())
    x, rotation = np.array(places), np.array(turns)
    sides, limbs, soles = find_sides(plan.robot), list[Limb](), list[Sole]()
    loaded = simulation.loads[steps] > LEAST_LOAD
    for link, shapes in make_plan_shapes(plan).items():
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
    pressure = _hold_last(average_pressure(simulation, PRESSURE_WINDOW_S)[steps])
    everything = np.concatenate([limb.points for limb in limbs], axis=1)[..., 0]
    return Skeleton(
        t=simulation.t[steps],
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
