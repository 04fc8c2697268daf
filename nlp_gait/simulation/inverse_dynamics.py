"""The engine's own inverse dynamics of a planned motion: an oracle for the model's torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.problem import Array, Playback, Result, Signals
from nlp_gait.robots.tree import Body, tree_from
from nlp_gait.simulation.engine import mujoco
from nlp_gait.simulation.mjcf import fixed_model


def engine_torques(result: Result, signals: Signals) -> Array:
    """Torques (T, J) that MuJoCo needs for the planned angles, rates and accelerations, supporting feet fixed [Nm].

    A phase on one foot is one tree. In double support the model parts the robot in two, each half on its own foot with a share
    of the torso (eqs. 28, 29); so does this.

    Args:
        result: gait of ``nao-ssp`` or ``nao-dsp``, with rotational inertia: an engine takes no point masses.
        signals: its time histories.
    """
    playback = result.problem.playback
    if playback is None or playback.supports is None:
        raise InputError(f"problem {result.problem.name!r} does not say which foot carries what")
    torques = np.zeros_like(signals.arrays["tau"])
    for support in playback.supports(signals):
        tree = tree_from(playback.robot, playback.robot.feet[support.foot].link, support.joints)
        _fill(torques, tree, signals, playback, support.torso_share)
    return torques


def _fill(torques: Array, tree: Sequence[Body], signals: Signals, playback: Playback, share: Array | None) -> None:
    """Write the torques of a tree's joints into their columns; ``share`` (T,) scales the torso's mass and inertia."""
    engine = mujoco()
    model = engine.MjModel.from_xml_string(fixed_model(tree, playback.gravity))
    data = engine.MjData(model)
    columns = [signals.joints.index(model.joint(i).name) for i in range(model.njnt)]
    body = None if share is None else model.body(playback.robot.root)
    whole = None if body is None else (float(body.mass[0]), body.inertia.copy())
    for k in range(len(torques)):
        if body is not None and whole is not None and share is not None:
            body.mass[0], body.inertia[:] = share[k] * whole[0], share[k] * whole[1]
        data.qpos[:], data.qvel[:], data.qacc[:] = (signals.arrays[name][k, columns] for name in ("q", "qd", "qdd"))
        engine.mj_inverse(model, data)
        torques[k, columns] = data.qfrc_inverse
