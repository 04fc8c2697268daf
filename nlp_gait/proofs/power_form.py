"""A least-power problem in other variables, for proofs: its formulas have narrower bounds over boxes than the exact functions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.formulation.signals import Array

Integers = np.ndarray[Any, np.dtype[np.int32]]

# Largest relative difference of the form and the exact functions, both in double precision; every bound is widened by the second
# number to make up for it.
AGREEMENT, WIDENING = 1e-11, 1e-8


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerRows:
    """Roles of the outputs of a function, which are named by their numbers: rows with bounds, and the terms of the cost.

    The cost is the sum of weight |torque rate| over K terms, divided by the duration, plus the sum of loss times heat.
    """

    limits: Array  # (R, 3) outputs that are limited, lower and upper bounds
    terms: Array  # (K, 4) outputs torque times rate, torque, and rate in unit time; positive weights
    heats: Array  # (L, 2) outputs that are never negative; positive losses
    duration: int  # input
    ranges: Array  # (n,) widths of the inputs, in which boxes are measured


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerForm:
    """A least-power problem as a function of z, into which every x is mapped."""

    to_z: Callable[[Array], Array]  # maps points (..., n) to their z (..., n)
    box: Array  # (n, 2) box that contains the z of every x within its bounds
    function: ca.Function  # maps z to all outputs
    rows: PowerRows  # roles of these outputs. Their bounds contain every point that the judge accepts
    poses: ca.Function  # maps z to the outputs of the rows that cost little, which are bounded first
    pose_rows: Integers  # (E,) numbers of these rows in ``rows``
    # Maps z to indexes of the problem, under the same names; they are compared with the exact functions within reach
    indexes: ca.Function
