"""A gait as keyframes of its MuJoCo model: the whole pose and the drives' set-points every period."""

from __future__ import annotations

from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Result
from nlp_gait.formulation.result import sample_at_period
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import make_plan_model
from nlp_gait.simulation.plan import make_plan


def write_keyframes(result: Result, period_ms: int) -> str:
    """Return the simulated model with a key for each row of the gait; raises InputError for a robot that moves in a plane.

    ``qpos`` has the root's place [m] and attitude (w, x, y, z) and the joints' angles [rad], ``ctrl`` these angles as set-points.
    """
    plan = make_plan(result)
    if plan.planar:
        raise InputError(
            f"the robot of {result.problem.name!r} moves in a plane and has no keyframes; export it as mjcf"
        )
    root = Xml.fromstring(make_plan_model(plan, Drive()))
    times = sample_at_period(result, period_ms).arrays["t"]
    # The engine's coordinates are in the order of the joints in the model, its controls in that of the actuators.
    joints, driven = (
        [plan.joints.index(part.attrib["name"]) for part in root.iter(tag)] for tag in ("joint", "position")
    )
    q = plan.at("q", times)
    poses = np.hstack([plan.at("hip", times), plan.attitude(times), q[:, joints]])
    keys = Xml.SubElement(root, "keyframe")
    for t, pose, targets in zip(times.tolist(), poses, q[:, driven], strict=True):
        values = {"qpos": pose, "ctrl": targets}
        texts = {name: " ".join(map(repr, array.tolist())) for name, array in values.items()}
        Xml.SubElement(keys, "key", {"name": f"{t:.6g} s", "time": repr(t), **texts})
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"
