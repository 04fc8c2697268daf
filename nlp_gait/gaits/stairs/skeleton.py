"""What is drawn of the stair biped: planar rods from the flat stance foot, whose ankle is the origin."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.motion.skeleton import LEFT, RIGHT, TRUNK, Limb, Skeleton
from nlp_gait.gaits.stairs.formulas.loads import link_angles
from nlp_gait.gaits.stairs.formulas.planar_biped import LINKS
from nlp_gait.gaits.stairs.formulas.planar_biped import points as planar_points
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import SETBACK

LINES = {RIGHT: ("H", "K", "A", "S", "T"), LEFT: ("H", "K'", "A'", "S'", "T'"), TRUNK: ("H", "U")}


def skeleton(signals: Signals, parameters: Mapping[str, float]) -> Skeleton:
    """The robot on its stair."""
    history = signals.arrays.get("link_q", signals.arrays["q"])  # absolute angles of the moving links, or of all
    q = SX.sym("q", history.shape[1])
    found = planar_points(toe_foot_biped().rods, q if q.numel() == len(LINKS) else link_angles(q), SX(2, 1))
    function = ca.Function("points", [q], list(found.values()))
    samples = len(signals.arrays["t"])
    values = dict(zip(found, function.map(samples)(history.T), strict=True))
    at = {name: np.array(value.full().T) for name, value in values.items()}
    tread = parameters["stair_length_m"] / 2
    rise = tread * parameters["rise_run_ratio"]
    edges = [
        (-1.6 * tread, -1),
        (-SETBACK, -1),
        (-SETBACK, 0),
        (tread - SETBACK, 0),
        (tread - SETBACK, 1),
        (1.8 * tread, 1),
    ]
    zmp = signals.arrays.get("zmp")
    return Skeleton(
        t=signals.arrays["t"],
        limbs=tuple(
            Limb(side=side, points=np.stack([_sagittal(at[name]) for name in names], axis=1))
            for side, names in LINES.items()
        ),
        soles=(),
        ground=np.array([(x, level * rise) for x, level in edges]),
        com=None,
        zmp=None if zmp is None else _sagittal(np.column_stack([zmp.reshape(samples, -1)[:, 0], np.zeros(samples)])),
        planar=True,
    )


def _sagittal(points: Array) -> Array:
    """(T, 3) from (T, 2) of x and z."""
    return np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]])
