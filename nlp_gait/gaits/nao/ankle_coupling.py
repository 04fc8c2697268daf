"""NAO's motors: the limit of the ankles' roll by their pitch, and the joints that share a motor."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.formulation import Point
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes, make_rows
from nlp_gait.gaits.biped.motors import Motors
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.nao.joints import JOINTS, YAW_PITCHES
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Ankle pitch, least and greatest roll of the left ankle [rad]; straight lines between. The right ankle mirrors it.
# Source: public MATLAB tables "Nao Parameters v4.0" (there stored under the other side's name; the greatest range is that of
# the left joint).
ANKLE_ROLL = (
    (-1.189442, -0.049916, 0.075049),
    (-0.840027, -0.179943, 0.169995),
    (-0.700051, -0.397935, 0.220086),
    (-0.449946, -0.397935, 0.768992),
    (0.100007, -0.397935, 0.768992),
    (0.349938, -0.397935, 0.550477),
    (0.922755, 0.0, 0.049916),
)


def parse_nao_motors(text: str, robot: Robot) -> Motors:
    """Return the features of NAO's motors that an option's text lists."""
    return Motors.parse(text, robot, JOINTS, YAW_PITCHES, AnkleCoupling())


class AnkleCoupling(Limit):
    """Roll of both ankles within the lines over their pitch."""

    reads_motion = True

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        angles: Mapping[str, MX] = dict(zip(samples.moving, ca.vertsplit(samples.q), strict=True))
        names = [str(k) for k in range(samples.steps + 1)]
        found = []
        for side, sign, columns in (("L", 1.0, (1, 2)), ("R", -1.0, (2, 1))):
            pitch, roll = (angles[f"{side}{joint}"].T for joint in ("AnklePitch", "AnkleRoll"))
            least, greatest = (sign * ankle_roll(pitch, column) for column in columns)
            found += [
                make_rows(f"{side}AnkleRoll_least", "rad", roll - least, MX(0.0), None, names, "instant"),
                make_rows(f"{side}AnkleRoll_greatest", "rad", roll - greatest, None, MX(0.0), names, "instant"),
            ]
        return found, {}


def ankle_roll(pitch: MX, column: int) -> MX:
    """Return the least (column 1) or greatest (2) roll of the left ankle over its pitch [rad], constant beyond the table."""
    corners = np.array(ANKLE_ROLL)
    slopes = np.diff(corners[:, column]) / np.diff(corners[:, 0])
    turns = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
    value = MX(corners[0, column])
    for at, turn in zip(corners[:, 0].tolist(), turns.tolist(), strict=True):
        value = value + turn * ca.fmax(pitch - at, 0.0)
    return value
