"""Poses that gaits ask of a leg, on which its equations are tried: Newton's method, and the choice of pivots."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nlp_gait.robots.leg import Leg

Array = np.ndarray[Any, np.dtype[np.float64]]

POSES, SEED = 2000, 0
# Distance of hip and ankle as a share of the leg's length, its direction to the front and to the side, and the torso's lean.
DISTANCES = (0.59, 0.97)
LARGEST_PITCH, LARGEST_ROLL = math.radians(28.0), math.radians(15.0)
LEAN_PITCH, LEAN_ROLL = 0.3, 0.15


def sample_flat_foot_poses(leg: Leg, count: int = POSES) -> Array:
    """(12, N) hip centres from the foot's origin [m] and rotations of the torso, column by column, over flat soles."""
    rng = np.random.default_rng(SEED)
    distance = rng.uniform(*DISTANCES, count) * leg.length_m
    front, aside = (rng.uniform(-most, most, count) for most in (LARGEST_PITCH, LARGEST_ROLL))
    pitch, roll = (rng.uniform(-most, most, count) for most in (LEAN_PITCH, LEAN_ROLL))
    way = np.stack([np.sin(front), np.sin(aside)])
    way = np.concatenate([way, np.sqrt(1.0 - (way**2).sum(axis=0, keepdims=True))])
    hips = distance * way + (leg.ankle_m - leg.foot_m)[:, None]
    c, s, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    zero = np.zeros(count)
    columns = [c, zero, -s, s * sr, cr, c * sr, s * cr, -sr, c * cr]  # Ry(pitch) Rx(roll)
    return np.asarray(np.concatenate([hips, np.stack(columns)]))
