"""Limits of a gait's phases, for your own and by name.

A limit is a class with ``add``, which returns rows. ``problem.with_limits(single_support=[FrictionCone()])`` adds one; so do
``load("nao-ssp", limits="FrictionCone")`` and, on the command line, ``--limit FrictionCone`` and ``--limit FILE.py:NAME``.
"""

from nlp_gait.formulation import Constraint, Parameter, Point
from nlp_gait.formulation.assembly import make_parameters
from nlp_gait.gaits.biped.limits import (
    FootClearance,
    FrictionCone,
    Limit,
    RowsAndIndexes,
    make_rows,
    make_rows_at_samples,
)
from nlp_gait.gaits.biped.samples import CORNERS, Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

__all__ = [
    "CORNERS",
    "Constraint",
    "FootClearance",
    "FrictionCone",
    "Limit",
    "Nonsmooth",
    "Parameter",
    "Point",
    "RowsAndIndexes",
    "Samples",
    "make_parameters",
    "make_rows",
    "make_rows_at_samples",
]
