"""Distributions over runs, targets and problems."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nlp_gait.formulation import Array

# Targets of the distribution: from 100 % above the best known to 1e-6, evenly in logarithm.
ECDF_TARGETS: tuple[float, ...] = tuple(float(target) for target in np.logspace(0, -6, 31))


def ecdf(costs: Array) -> tuple[Array, Array]:
    """Return the share of all pairs of run and target that are solved within a cost.

    Args:
        costs: (pairs,) cost at which each was solved; infinite if never.

    Returns:
        (K,) costs at which the share rises, ascending, and (K,) the share from there on.

    Source:
        Hansen et al. (2021), COCO, section 4 (runtime distributions).
    """
    solved = np.sort(costs[np.isfinite(costs)])
    at, counts = np.unique(solved, return_counts=True)
    return at, np.cumsum(counts) / max(len(costs), 1)


def performance_profile(costs: Mapping[str, Sequence[float]]) -> dict[str, tuple[Array, Array]]:
    """Return the share of instances that a solver solves within a factor of the cheapest solver.

    Args:
        costs: by solver, (I,) cost of each instance, in the same order; infinite if not solved. Instances that no solver
            solves count as unsolved for all.

    Returns:
        By solver, the (K,) factors at which its share rises, ascending, and (K,) the share from there on.

    Source:
        Dolan, More (2002), Benchmarking optimization software with performance profiles.
    """
    table = np.array([list(row) for row in costs.values()], dtype=float)
    cheapest = table.min(axis=0)
    known = np.isfinite(cheapest)
    ratios = np.full_like(table, np.inf)
    ratios[:, known] = table[:, known] / cheapest[known]
    return {solver: ecdf(row) for solver, row in zip(costs, ratios, strict=True)}


def compute_band(costs: Sequence[Array], gaps: Sequence[Array], grid: Array) -> tuple[Array, Array, Array]:
    """Return the least, median and greatest gap of all runs at each cost.

    Args:
        costs: of each run, (G,) ascending.
        gaps: of each run, (G,) best gap so far, infinite while nothing was feasible.
        grid: (K,) costs.

    Returns:
        Three arrays (K,); infinite where a run has nothing feasible. A run that has ended keeps its last gap.
    """
    rows = np.full((len(costs), len(grid)), np.inf)
    for row, cost, gap in zip(rows, costs, gaps, strict=True):
        position = np.searchsorted(cost, grid, side="right") - 1
        row[position >= 0] = gap[position[position >= 0]]
    # The lower one of the two middle runs, so that the median is a run and never half an infinity.
    return rows.min(axis=0), np.sort(rows, axis=0)[(len(rows) - 1) // 2], rows.max(axis=0)
