"""Footholds and times of steps that bring the divergent component of motion back to the plan, in closed form."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nlp_gait.formulation import Array

OUT_OF_REACH = 100.0  # cost of an error that no allowed foothold removes, against one of the foothold's change
CANDIDATES = 9  # times of touch-down that are compared


@dataclass(frozen=True, kw_only=True)
class StepLimits:
    """Limits of one step; axes are those of the standing sole, forward and to the left."""

    rate: float  #: of the pendulum, sqrt(g / h) [1/s]
    carry: float  #: share of the foothold's change in the divergent component at touch-down
    zmp_low: Array  #: (2,) farthest change of the ZMP backward and to the right (at most 0) [m]
    zmp_high: Array  #: (2,) forward and to the left [m]
    shift_low: Array  #: (2,) least change of the foothold [m]
    shift_high: Array  #: (2,) largest [m]


class Step(NamedTuple):
    """A choice of foothold and time."""

    time_s: float  # to touch-down
    shift: Array  # (2,) of the foothold [m]
    left: Array  # (2,) present error of the divergent component that it does not remove [m]


def find_shift(error: Array, times_s: Array, limits: StepLimits) -> Array:
    """Return the least changes (N, 2) of the foothold [m] after which an error (2,) is gone, by the times (N, 1) of touch-down.

    Until touch-down the error grows: e' = rate (e - z), with a change z of the ZMP within the ankles' range. So it ends within
    e G - z (G - 1) with G = exp(rate time), and the foothold takes what this interval does not bring to zero.

    Source:
        Englsberger, Ott, Albu-Schaeffer (2015); Khadiv et al. (2020) choose place and time by the same equation.
    """
    growth = np.exp(limits.rate * times_s)
    least = error * growth - limits.zmp_high * (growth - 1.0)
    most = error * growth - limits.zmp_low * (growth - 1.0)
    return np.asarray(np.clip(0.0, least, most) / limits.carry)


def choose_step(
    error: Array, time_s: float, fastest_s: float, slowest_s: float, limits: StepLimits, price_m: float
) -> Step:
    """Return the time to touch-down and the change of the foothold of least cost.

    The cost is the squared change, ``OUT_OF_REACH`` times the squared error (now) that its limits leave, and the squared change
    of the time, of which a whole 1 / rate costs ``price_m`` [m].
    """
    times = np.array([time_s, *np.linspace(fastest_s, max(slowest_s, fastest_s), CANDIDATES - 1)])[:, None]
    wanted = find_shift(error, times, limits)
    shifts = np.clip(wanted, limits.shift_low, limits.shift_high)
    left = (wanted - shifts) * limits.carry * np.exp(-limits.rate * times)
    hurry = price_m * limits.rate * (times[:, 0] - time_s)
    best = int(np.argmin(OUT_OF_REACH * (left**2).sum(axis=1) + (shifts**2).sum(axis=1) + hurry**2))
    return Step(float(times[best, 0]), shifts[best], left[best])


def clip_to_soles(point: Array, places: Array, yaws: Array, reaches: Array) -> Array:
    """Return the nearest point (2,) of the support [m]: the soles that stand, and what lies between two.

    Args:
        point: (2,) [m].
        places: (N, 2) of one or two soles under the ankles [m].
        yaws: (N,) their headings [rad].
        reaches: (N, 4) of their edges to the front, back, left and right of the ankle [m].
    """
    shares = np.linspace(0.0, 1.0, 11 if len(places) > 1 else 1)[:, None]
    place = places[0] + shares * (places[-1] - places[0])
    yaw = (yaws[0] + shares * (yaws[-1] - yaws[0]))[:, 0]
    front, back, left, right = (reaches[0] + shares * (reaches[-1] - reaches[0])).T
    cos, sin, (x, y) = np.cos(yaw), np.sin(yaw), (point - place).T
    forward, sideways = np.clip(cos * x + sin * y, -back, front), np.clip(cos * y - sin * x, -right, left)
    nearest = place + np.stack([cos * forward - sin * sideways, sin * forward + cos * sideways], axis=1)
    return np.asarray(nearest[((nearest - point) ** 2).sum(axis=1).argmin()])
